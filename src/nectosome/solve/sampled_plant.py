"""A robot whose command is set anew at each sample and held between: one compiled step, whatever the command."""

import math
from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Handover, State, Status
from nectosome.core.remember import remembered, runs_long
from nectosome.description import RobotDescription, check_no_update_rate, get_value, numeric_paths, resolve
from nectosome.io.schema.quantity import Quantity
from nectosome.mechanism import Diagnosis, Robot, Tree, from_rest, in_plane, moves_in_plane
from nectosome.model import Template, build, instantiate, template_of
from nectosome.units import InputError

from .integrate import Settings, begin, integrate
from .readings import Reading, reading_of
from .results import diagnose_all

# a rate, the number beside it that keeps its angle continuous where it changes, and radians per unit of it and second
_PHASES = {"frequency": ("phase", 2 * math.pi), "rate": ("start", 1.0)}
_FIRST = 1e-3  # s, the first step at most


class PlantState(NamedTuple):
    """State of a robot between two samples."""

    sample: int  # its number
    state: State
    reading: float  # the present one; full turns counted
    step: float  # length of the next time step [s]
    numbers: Float[np.ndarray, "n"]  # of the robot, as they were held in the sample before


class HoldInterval(NamedTuple):
    """Motion of a robot while a command is held, at even instants up to the end of the sample."""

    time: Float[np.ndarray, "m"]  # [s]
    reading: Float[np.ndarray, "m"]  # full turns counted
    position: Float[np.ndarray, "m parts 3"]  # of each part's first station [m]
    state: State  # leaves [m, ...]


class SampledPlant:
    """A robot that is simulated in samples dt [s] long; in each one a quantity has the value that is commanded.

    - command: path or alias; an alias of several paths sets all of them.
    - reading: the measured quantity (see `reading_of`).
    - instants: how many are recorded in each sample.

    Where the frequency or rate of a drive changes, its angle is continuous: the phase takes up the jump. A prescribed
    joint or rod changes to the new motion within the sample, without a jump of its velocity or acceleration. All else
    jumps, such as forces and torques; where a mass or a length jumps, momentum is not conserved.

    Raises InputError for an unknown quantity or reading, for one that only sets how the robot starts, and for an update
    rate.
    """

    def __init__(
        self,
        description: RobotDescription,
        command: str,
        reading: str,
        dt: float,
        instants: int = 1,
        rtol: float = 1e-4,
        atol: float = 1e-6,
    ):
        self.description, self.command, self.dt = description, command, dt
        known = numeric_paths(description)
        self.paths = tuple(resolve(description, command))
        self._phases: dict[str, tuple[str, float]] = {}  # path of the phase of a commanded rate
        for path in self.paths:
            _check_acts(path)
        check_no_update_rate(description, self.paths)
        for path in self.paths:
            place, _, name = path.rpartition(".")
            phase, turns = _PHASES.get(name, ("", 0.0))
            if f"{place}.{phase}" in known:
                self._phases[path] = f"{place}.{phase}", turns
        self.quantity: Quantity = known[self.paths[0]]
        changing = (*self.paths, *(phase for phase, _ in self._phases.values()))
        template, self._numbers = template_of(description, changing)
        self._index = {path: template.paths.index(path) for path in changing}
        robot = build(description)
        self.parts = robot.tree.names
        self.coordinates = robot.coordinate_names
        self.displacements = robot.displacements
        self._state = remembered(from_rest, robot, jnp.zeros(()), robot.initial()).state
        self.reading = reading_of(robot, reading)
        prescribed = any(".motion." in path for path in self.paths)
        self._structure = _Structure(template, self.reading, moves_in_plane(robot), prescribed, instants)
        self._settings = Settings("implicit", *(jnp.asarray(x) for x in (rtol, atol, 200_000, dt)))

    @property
    def initial_command(self) -> float:
        """The command in the description."""
        return float(get_value(self.description, self.command))

    def start(self) -> tuple[PlantState, HoldInterval]:
        """State and motion at t = 0, by the description."""
        time, states = jnp.zeros(1), jax.tree.map(lambda x: x[None], self._state)
        observed = remembered(_begin, self._structure, self._numbers, time, states)
        reading, position = map(np.asarray, observed)
        state = PlantState(0, self._state, float(reading[0]), min(_FIRST, 0.1 * self.dt), np.asarray(self._numbers))
        return state, HoldInterval(np.zeros(1), reading, position, states)

    def hold(self, before: PlantState, command: float) -> tuple[PlantState, HoldInterval | None, Status]:
        """One sample more, with this command; without a hold interval where the simulation fails."""
        t = before.sample * self.dt
        numbers = before.numbers.copy()
        for path in self.paths:
            i = self._index[path]
            numbers[i] = command
            if path in self._phases:
                phase, turns = self._phases[path]
                numbers[self._index[phase]] += turns * (before.numbers[i] - command) * t
        times = (jnp.asarray(x, dtype=float) for x in (t, before.step))
        found = remembered(_hold, self._structure, before.numbers, numbers, *times, before.state, self._settings)
        status = Status(int(found.status))
        if status != Status.SOLVED:
            return before, None, status
        reading = np.asarray(found.reading)
        if self.reading.turns:
            reading = np.unwrap(np.append(before.reading, reading))[1:]
        last = jax.tree.map(lambda a: a[-1], found.states)
        interval = HoldInterval(np.asarray(found.time), reading, np.asarray(found.position), found.states)
        after = PlantState(before.sample + 1, last, float(reading[-1]), float(found.step), numbers)
        return after, interval, status

    def diagnosis(self, before: PlantState, after: PlantState, interval: HoldInterval) -> Diagnosis:
        """Forces, powers and positions of all stations at the instants of a hold interval between two states."""
        times = (jnp.asarray(x, dtype=float) for x in (before.sample * self.dt, self.dt, interval.time))
        found = remembered(_diagnose, self._structure, before.numbers, after.numbers, *times, interval.state)
        return jax.tree.map(np.asarray, found)


class _Structure(eqx.Module):
    """What all commands of a robot have in common."""

    template: Template
    reading: Reading
    flat: bool = eqx.field(static=True)  # it moves in a plane
    prescribed: bool = eqx.field(static=True)  # the command is part of a prescribed motion
    instants: int = eqx.field(static=True)


class _Motion(NamedTuple):
    time: Array
    states: State
    reading: Array
    position: Array
    step: Array
    status: Array


def _observed(plant: _Structure, robot: Robot, time: Array, states: State) -> tuple[Array, Array]:
    """Readings and positions of all parts at some times."""
    first = np.array([place.stations.start for place in robot.tree.layout])

    def one(t: Array, x: State) -> tuple[Array, Array]:
        q, *_ = robot.tree.complete(t, x.q, x.v)
        return plant.reading.value(robot, t, x), robot.tree.shape(q).position[first]

    return jax.vmap(one)(time, states)


def _begin(plant: _Structure, numbers: Array, time: Array, states: State) -> tuple[Array, Array]:
    return _observed(plant, instantiate(plant.template, numbers), time, states)


@runs_long
def _hold(
    plant: _Structure, before: Array, numbers: Array, t: Array, step: Array, x: State, settings: Settings
) -> _Motion:
    dt = jnp.asarray(settings.longest)
    robot = _robot(plant, before, numbers, t, dt)
    times = t + dt * jnp.arange(1, plant.instants + 1) / plant.instants
    equations = in_plane(robot) if plant.flat else robot
    m, states = integrate(equations, begin(t, x, settings, step), times, settings)
    return _Motion(times, states, *_observed(plant, robot, times, states), m.h, m.status)


@runs_long
def _diagnose(
    plant: _Structure, before: Array, numbers: Array, t: Array, dt: Array, time: Array, states: State
) -> Diagnosis:
    return diagnose_all(_robot(plant, before, numbers, t, dt), time, states)


def _robot(plant: _Structure, before: Array, numbers: Array, t: Array, dt: Array) -> Robot:
    """The robot in the sample that begins at t; prescribed motions change from those of `before` to those now."""
    robot = instantiate(plant.template, numbers)
    if not plant.prescribed:
        return robot
    parts = []
    for old, new in zip(instantiate(plant.template, before).tree.parts, robot.tree.parts, strict=True):
        if new.prescribed is not None:
            new = eqx.tree_at(lambda p: p.prescribed, new, Handover(old.prescribed, new.prescribed, t, dt))  # type: ignore[arg-type]
        strains = tuple(Handover(a, b, t, dt) for a, b in zip(old.strain_signals, new.strain_signals, strict=True))
        parts.append(eqx.tree_at(lambda p: p.strain_signals, new, strains) if strains else new)
    return replace(robot, tree=Tree.of(parts))


def _check_acts(path: str) -> None:
    """Raise InputError for a quantity that only sets how the robot starts."""
    if ".joint.start." in path or path.endswith((".joint.position", ".joint.velocity", ".ramp")):
        raise InputError("says how the robot starts, and nothing after that: it is no command.", field=path)
