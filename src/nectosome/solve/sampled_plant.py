"""A robot whose command is set anew at each sample and held between: one compiled step, whatever the command."""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Handover, State, Status
from nectosome.core.remember import remembered
from nectosome.description import RobotDescription, get_value, numeric_paths, resolve
from nectosome.description.fields import Quantity
from nectosome.mechanism import Diagnosis, Robot, in_plane, moves_in_plane
from nectosome.model import Template, build, instantiate, template_of
from nectosome.units import InputError

from .integrate import Settings, begin, integrate
from .readings import Reading, reading_of
from .results import diagnose_all

# what a held rate has turned by: with which number the angle goes on where the rate changes, and by how much a second
_GOES_ON = {"frequency": ("phase", 2 * math.pi), "rate": ("start", 1.0)}
_FIRST = 1e-3  # s, the first step at most


class PlantState(NamedTuple):
    """Where a robot stands between two samples."""

    sample: int  # how many have passed
    state: State
    reading: float  # what is measured, as it is now; full turns counted
    step: float  # length of the next time step [s]
    numbers: Float[np.ndarray, "n"]  # of the robot, as they were held in the sample before


class HoldInterval(NamedTuple):
    """What a robot did while a command was held, at even moments up to the end of the sample."""

    time: Float[np.ndarray, "m"]  # [s]
    reading: Float[np.ndarray, "m"]  # what is measured; full turns counted
    position: Float[np.ndarray, "m parts 3"]  # of each part's first station [m]
    state: State  # leaves [m, ...]


class SampledPlant:
    """A robot that is taken on by samples dt [s] long; in each one a quantity has the value that is commanded.

    - command: path or alias; an alias of several paths sets all of them.
    - reading: what is measured (see `reading_of`).
    - moments: how many are kept of each sample.

    A drive goes on where it is when its frequency or rate changes: the phase takes what the change would make it jump
    by. A joint or rod that is made to move goes over to the new motion within the sample, without a jump of its
    velocity or acceleration. All else jumps: forces and torques may; of a mass or a length that jumps the momentum
    is not kept.

    Raises InputError for an unknown quantity or reading, and for a quantity that says only how the robot starts.
    """

    def __init__(
        self,
        description: RobotDescription,
        command: str,
        reading: str,
        dt: float,
        moments: int = 1,
        rtol: float = 1e-4,
        atol: float = 1e-6,
    ):
        self.description, self.command, self.dt = description, command, dt
        known = numeric_paths(description)
        self.paths = tuple(resolve(description, command))
        for path in self.paths:
            _check_acts(path)
        self.quantity: Quantity = known[self.paths[0]]
        going_on = {path: _partner(path) for path in self.paths}
        self._partners = {path: other for path, other in going_on.items() if other is not None and other[0] in known}
        partners = tuple(other for other, _ in self._partners.values())
        blueprint, self._numbers = template_of(description, (*self.paths, *partners))
        self._place = {path: blueprint.paths.index(path) for path in (*self.paths, *partners)}
        robot = build(description)
        self.parts = tuple(part.name for part in robot.tree.parts)
        self.coordinates = robot.coordinate_names
        self.displacements = robot.displacements
        self._state = robot.initial()
        self.reading = reading_of(robot, reading)
        made = any(".motion." in path for path in self.paths)
        self._plan = _Plan(blueprint, self.reading, moves_in_plane(robot), made, moments)
        limits = (jnp.asarray(x) for x in (rtol, atol, 200_000, dt))
        self._settings = Settings("implicit", *limits)

    @property
    def resting(self) -> float:
        """The command as the description has it."""
        return float(get_value(self.description, self.command))

    def start(self) -> tuple[PlantState, HoldInterval]:
        """The robot at t = 0, as its description says."""
        time, states = jnp.zeros(1), jax.tree.map(lambda x: x[None], self._state)
        seen = remembered(_begin, self._plan, self._numbers, time, states)
        reading, position = map(np.asarray, seen)
        standing = PlantState(0, self._state, float(reading[0]), min(_FIRST, 0.1 * self.dt), np.asarray(self._numbers))
        return standing, HoldInterval(np.zeros(1), reading, position, states)

    def hold(self, standing: PlantState, command: float) -> tuple[PlantState, HoldInterval | None, Status]:
        """One sample more, with this command; what happened is None where the robot did not get through it."""
        t = standing.sample * self.dt
        numbers = standing.numbers.copy()
        for path in self.paths:
            before = numbers[self._place[path]]
            numbers[self._place[path]] = command
            if path in self._partners:
                other, turns = self._partners[path]
                numbers[self._place[other]] += turns * (before - command) * t
        of_time = (jnp.asarray(x, dtype=float) for x in (t, standing.step))
        found = remembered(_hold, self._plan, standing.numbers, numbers, *of_time, standing.state, self._settings)
        status = Status(int(found.status))
        if status != Status.SOLVED:
            return standing, None, status
        reading = np.asarray(found.reading)
        if self.reading.turns:
            reading = np.unwrap(np.append(standing.reading, reading))[1:]
        last = jax.tree.map(lambda a: a[-1], found.states)
        held = HoldInterval(np.asarray(found.time), reading, np.asarray(found.position), found.states)
        return PlantState(standing.sample + 1, last, float(reading[-1]), float(found.step), numbers), held, status

    def diagnosis(self, before: PlantState, after: PlantState, held: HoldInterval) -> Diagnosis:
        """Forces, powers and the place of all stations at the moments of a sample, from where it stood before it."""
        of_time = (jnp.asarray(x, dtype=float) for x in (before.sample * self.dt, self.dt))
        found = remembered(
            _diagnose, self._plan, before.numbers, after.numbers, *of_time, jnp.asarray(held.time), held.state
        )
        return jax.tree.map(np.asarray, found)


class _Plan(eqx.Module):
    """What of a commanded robot is structure."""

    blueprint: Template
    reading: Reading
    flat: bool = eqx.field(static=True)  # it moves in a plane
    made: bool = eqx.field(static=True)  # the command is part of a prescribed motion
    moments: int = eqx.field(static=True)


class _Found(NamedTuple):
    time: Array
    states: State
    reading: Array
    position: Array
    step: Array
    status: Array


def _seen(plan: _Plan, robot: Robot, time: Array, states: State) -> tuple[Array, Array]:
    """What is measured, and where all parts are, at some moments."""
    first = np.array([place.stations.start for place in robot.tree.layout])

    def one(t: Array, x: State) -> tuple[Array, Array]:
        q, *_ = robot.tree.complete(t, x.q, x.v)
        return plan.reading.value(robot, t, x), robot.tree.shape(q).position[first]

    return jax.vmap(one)(time, states)


def _begin(plan: _Plan, numbers: Array, time: Array, states: State) -> tuple[Array, Array]:
    return _seen(plan, instantiate(plan.blueprint, numbers), time, states)


def _hold(plan: _Plan, before: Array, numbers: Array, t: Array, step: Array, x: State, settings: Settings) -> _Found:
    dt = jnp.asarray(settings.longest)
    robot = _within(plan, before, numbers, t, dt)
    times = t + dt * jnp.arange(1, plan.moments + 1) / plan.moments
    equations = in_plane(robot) if plan.flat else robot
    m, states = integrate(equations, begin(t, x, settings, step), times, settings)

    return _Found(times, states, *_seen(plan, robot, times, states), m.h, m.status)


def _diagnose(plan: _Plan, before: Array, numbers: Array, t: Array, dt: Array, time: Array, states: State) -> Diagnosis:
    return diagnose_all(_within(plan, before, numbers, t, dt), time, states)


def _within(plan: _Plan, before: Array, numbers: Array, t: Array, dt: Array) -> Robot:
    """The robot in the sample that begins at t."""
    robot = instantiate(plan.blueprint, numbers)
    return _handed_over(instantiate(plan.blueprint, before), robot, t, dt) if plan.made else robot


def _handed_over(before: Robot, after: Robot, t: Array, dt: Array) -> Robot:
    """The robot whose prescribed motions go over from those of before to those of after."""
    parts = []
    for old, new in zip(before.tree.parts, after.tree.parts, strict=True):
        if new.prescribed is not None:
            new = eqx.tree_at(lambda p: p.prescribed, new, Handover(old.prescribed, new.prescribed, t, dt))  # type: ignore[arg-type]
        shaped = tuple(Handover(a, b, t, dt) for a, b in zip(old.strain_signals, new.strain_signals, strict=True))
        parts.append(eqx.tree_at(lambda p: p.strain_signals, new, shaped) if shaped else new)
    return eqx.tree_at(lambda r: r.tree.parts, after, tuple(parts))


def _partner(path: str) -> tuple[str, float] | None:
    """Path of the number that takes what a change of this one would make an angle jump by, and its rate."""
    place, _, name = path.rpartition(".")
    if name not in _GOES_ON:
        return None
    other, turns = _GOES_ON[name]
    return f"{place}.{other}", turns


def _check_acts(path: str) -> None:
    """Raise InputError for a quantity that says only how the robot starts."""
    *_, last = path.split(".")
    if ".joint.start." in path or path.endswith((".joint.position", ".joint.velocity")) or last == "ramp":
        raise InputError("says how the robot starts, and nothing after that: it is no command.", field=path)
