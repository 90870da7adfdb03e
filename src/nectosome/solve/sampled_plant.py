"""A robot whose commands are set anew at each sample and held between: one compiled step, whatever they are."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Handover, Mechanical, State, Status
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.description import RobotDescription, check_no_update_rate, get_value, numeric_paths, resolve, with_values
from nectosome.description.variables import Variable
from nectosome.io.schema.quantity import Quantity
from nectosome.mechanism import Diagnosis, Robot, Tree, from_rest, in_plane, moves_in_plane
from nectosome.model import Template, build, instantiate, template_of
from nectosome.units import InputError, check_choice

from .integrate import Settings, begin, integrate
from .readings import Reading, reading_of, values_of
from .results import diagnose_all

# a rate, the number beside it that keeps its angle continuous where it changes, and radians per unit of it and second
_PHASES = {"frequency": ("phase", 2 * math.pi), "rate": ("start", 1.0)}
FIRST_STEP = 1e-3  # s, the first step at most


class PlantState(NamedTuple):
    """State of a robot between two samples."""

    sample: int  # its number
    state: State
    readings: Float[np.ndarray, "r"]  # the present ones; full turns counted
    step: float  # length of the next time step [s]
    numbers: Float[np.ndarray, "n"]  # of the robot, as they were held in the sample before

    @property
    def reading(self) -> float:
        """The first reading."""
        return float(self.readings[0])


class HoldInterval(NamedTuple):
    """Motion of a robot while its commands are held, at even instants up to the end of the sample."""

    time: Float[np.ndarray, "m"]  # [s]
    readings: Float[np.ndarray, "m r"]  # full turns counted
    position: Float[np.ndarray, "m parts 3"]  # of each part's first station [m]
    state: State  # leaves [m, ...]

    @property
    def reading(self) -> Float[np.ndarray, "m"]:
        """The first reading."""
        return self.readings[:, 0]


class SampledPlant:
    """A robot that is simulated in samples dt [s] long; in each one some quantities have the values commanded.

    - commands: path or alias, or several; an alias of several paths sets all of them.
    - readings: the measured quantity, or several (see `reading_of`).
    - instants: how many are recorded in each sample.
    - drawn: quantities that each start of a `PlantBatch` sets, within these ranges.
    - method: of the time steps, as in `simulate`; "auto" takes explicit ones also where a robot moves in a plane.

    Where the frequency or rate of a drive changes, its angle is continuous: the phase takes up the jump. A prescribed
    joint or rod changes to the new motion within the sample, without a jump of its velocity or acceleration. All else
    jumps, such as forces and torques; where a mass or a length jumps, momentum is not conserved.

    Raises InputError for an unknown quantity or reading, for one that only sets how the robot starts, for an update
    rate, and for a quantity that two commands set, or that is drawn and commanded.
    """

    def __init__(
        self,
        description: RobotDescription,
        commands: str | Sequence[str],
        readings: str | Sequence[str],
        dt: float,
        instants: int = 1,
        rtol: float = 1e-4,
        atol: float = 1e-6,
        drawn: Sequence[Variable] = (),
        method: Literal["auto", "implicit", "explicit"] = "implicit",
    ):
        self.description, self.dt = description, dt
        self.commands = (commands,) if isinstance(commands, str) else tuple(commands)
        known = numeric_paths(description)
        self._paths = tuple(tuple(resolve(description, command)) for command in self.commands)
        paths = tuple(path for group in self._paths for path in group)
        phases: dict[str, tuple[str, float]] = {}  # path of the phase of a commanded rate
        for path in paths:
            _check_acts(path)
        ranges = [(path, one) for one in drawn for path in resolve(description, one.name)]
        check_no_update_rate(description, (*paths, *(path for path, _ in ranges)))
        for path in paths:
            place, _, name = path.rpartition(".")
            phase, turns = _PHASES.get(name, ("", 0.0))
            if f"{place}.{phase}" in known:
                phases[path] = f"{place}.{phase}", turns
        _check_apart(paths, phases, [path for path, _ in ranges])
        self.quantities: tuple[Quantity, ...] = tuple(known[group[0]] for group in self._paths)
        changing = (*paths, *(phase for phase, _ in phases.values()), *(path for path, _ in ranges))
        template, self.numbers = template_of(description, changing)
        self.places = tuple(
            tuple(
                CommandedNumber(
                    template.paths.index(path),
                    template.paths.index(phases[path][0]) if path in phases else None,
                    phases[path][1] if path in phases else 0.0,
                )
                for path in group
            )
            for group in self._paths
        )
        self.drawn = tuple(tuple(map(template.paths.index, resolve(description, one.name))) for one in drawn)
        robot = build(description)
        self.parts = robot.tree.names
        self.coordinates = robot.coordinate_names
        self.displacements = robot.displacements
        self._state = remembered(from_rest, robot, jnp.zeros(()), robot.initial()).state
        names = (readings,) if isinstance(readings, str) else readings
        self.readings = tuple(reading_of(robot, name) for name in names)
        prescribed = any(".motion." in path for path in paths)
        ends = [robot] if not ranges else [build(with_values(description, values)) for values in _ends(ranges)]
        flat = all(moves_in_plane(end) for end in (robot, *ends))
        self.structure = PlantStructure(template, self.readings, flat, prescribed, instants)
        check_choice(method, ("auto", "implicit", "explicit"), "method")
        if method == "auto":
            method = "explicit" if flat or robot.mild else "implicit"
        self.settings = Settings(method, *(jnp.asarray(x) for x in (rtol, atol, 200_000, dt)))

    @property
    def command(self) -> str:
        """The first command."""
        return self.commands[0]

    @property
    def quantity(self) -> Quantity:
        """What the first command sets."""
        return self.quantities[0]

    @property
    def reading(self) -> Reading:
        """The first reading."""
        return self.readings[0]

    @property
    def initial_command(self) -> float:
        """The first command in the description."""
        return float(get_value(self.description, self.command))

    def start(self) -> tuple[PlantState, HoldInterval]:
        """State and motion at t = 0, by the description."""
        time, states = jnp.zeros(1), jax.tree.map(lambda x: x[None], self._state)
        observed = remembered(_begin, self.structure, self.numbers, time, states)
        readings, position = map(np.asarray, observed)
        state = PlantState(0, self._state, readings[0], min(FIRST_STEP, 0.1 * self.dt), np.asarray(self.numbers))
        return state, HoldInterval(np.zeros(1), readings, position, states)

    def hold(self, before: PlantState, *commands: float) -> tuple[PlantState, HoldInterval | None, Status]:
        """One sample more, with these commands; without a hold interval where the simulation fails."""
        t = before.sample * self.dt
        numbers = before.numbers.copy()
        for i, value in commanded(self.places, before.numbers, commands, t).items():
            numbers[i] = value
        times = (jnp.asarray(x, dtype=float) for x in (t, before.step))
        found = remembered(_held_motion, self.structure, before.numbers, numbers, *times, before.state, self.settings)
        status = Status(int(found.status))
        if status != Status.SOLVED:
            return before, None, status
        readings = np.array(found.readings)
        for k, one in enumerate(self.readings):
            if one.turns:
                readings[:, k] = np.unwrap(np.append(before.readings[k], readings[:, k]))[1:]
        last = jax.tree.map(lambda a: a[-1], found.states)
        interval = HoldInterval(np.asarray(found.time), readings, np.asarray(found.position), found.states)
        after = PlantState(before.sample + 1, last, readings[-1], float(found.step), numbers)
        return after, interval, status

    def diagnosis(self, before: PlantState, after: PlantState, interval: HoldInterval) -> Diagnosis:
        """Forces, powers and positions of all stations at the instants of a hold interval between two states."""
        times = (jnp.asarray(x, dtype=float) for x in (before.sample * self.dt, self.dt, interval.time))
        found = remembered(_diagnose, self.structure, before.numbers, after.numbers, *times, interval.state)
        return jax.tree.map(np.asarray, found)


class CommandedNumber(NamedTuple):
    """Where a command stands among the numbers of a robot, and the phase that takes up its jumps."""

    at: int
    phase: int | None
    turn: float  # angle [rad] of that phase per unit of the command and second


def commanded(
    places: tuple[tuple[CommandedNumber, ...], ...], before: Any, commands: Iterable[Any], t: Any
) -> dict[int, Any]:
    """Numbers that change at time t [s] from those of the sample before, by their index; traced or not."""
    found: dict[int, Any] = {}
    for group, command in zip(places, commands, strict=True):
        for at, phase, turn in group:
            found[at] = command
            if phase is not None:
                found[phase] = before[phase] + turn * (before[at] - command) * t
    return found


class PlantStructure(eqx.Module):
    """What all commands of a robot have in common."""

    template: Template
    readings: tuple[Reading, ...]
    flat: bool = eqx.field(static=True)  # it moves in a plane
    prescribed: bool = eqx.field(static=True)  # a command is part of a prescribed motion
    instants: int = eqx.field(static=True)


class HeldMotion(NamedTuple):
    """Motion over a sample, traced, at its instants."""

    time: Array
    states: State
    readings: Array
    position: Array
    step: Array
    status: Array


def observed_at(plant: PlantStructure, robot: Robot, time: Array, states: State) -> tuple[Array, Array]:
    """Readings and positions of all parts at some times."""
    first = np.array([place.stations.start for place in robot.tree.layout])

    def one(t: Array, x: State) -> tuple[Array, Array]:
        q, *_ = robot.tree.complete(t, x.q, x.v)
        return values_of(plant.readings, robot, t, x), robot.tree.shape(q).position[first]

    return jax.vmap(one)(time, states)


def _begin(plant: PlantStructure, numbers: Array, time: Array, states: State) -> tuple[Array, Array]:
    return observed_at(plant, instantiate(plant.template, numbers), time, states)


@runs_long
def _held_motion(
    plant: PlantStructure, before: Array, numbers: Array, t: Array, step: Array, x: State, settings: Settings
) -> HeldMotion:
    robot = robot_in(plant, before, numbers, t, jnp.asarray(settings.longest))
    return motion_of(plant, robot, equations_of(plant, robot), t, step, x, settings)


def motion_of(
    plant: PlantStructure, robot: Robot, equations: Mechanical, t: Array, step: Array, x: State, settings: Settings
) -> HeldMotion:
    """Motion of a robot from the state x over a sample that begins at t [s].

    With contacts its last step ends with it. Else it goes beyond, which takes fewer steps, and its cubic is as good.
    """
    times = t + jnp.asarray(settings.longest) * jnp.arange(1, plant.instants + 1) / plant.instants
    if eqx.filter_eval_shape(equations.gaps, t, x) is not None:
        settings = replace(settings, stop=times[-1])
    m, states = integrate(equations, begin(t, x, settings, step), times, settings)
    return HeldMotion(times, states, *observed_at(plant, robot, times, states), m.h, m.status)


def equations_of(plant: PlantStructure, robot: Robot) -> Mechanical:
    """The equations of a robot of the plant, in the plane where it moves in one."""
    return in_plane(robot) if plant.flat else robot


@runs_long
def _diagnose(
    plant: PlantStructure, before: Array, numbers: Array, t: Array, dt: Array, time: Array, states: State
) -> Diagnosis:
    return diagnose_all(robot_in(plant, before, numbers, t, dt), time, states)


Numbers = Float[Array, "n"] | Sequence[Float[Array, ""]]


def robot_in(plant: PlantStructure, before: Numbers, numbers: Numbers, t: Array, dt: Array) -> Robot:
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


def _ends(ranges: Sequence[tuple[str, Variable]]) -> tuple[dict[str, float], dict[str, float]]:
    """All lower and all upper ends of ranges, by path."""
    return {path: one.lower for path, one in ranges}, {path: one.upper for path, one in ranges}


def _check_apart(paths: Sequence[str], phases: dict[str, tuple[str, float]], drawn: Sequence[str]) -> None:
    """Raise InputError for a quantity that is commanded twice, or both itself and by the rate that it continues.

    Likewise for one that is drawn twice, or drawn and commanded.
    """
    for k, path in enumerate(drawn):
        if path in (*paths, *drawn[:k]):
            raise InputError("is commanded: do not draw it too." if path in paths else "is drawn twice.", field=path)
    for k, path in enumerate(paths):
        if path in paths[:k]:
            raise InputError("is set by two commands.", field=path)
        if path in phases and phases[path][0] in paths:
            message = f"is commanded, so that {phases[path][0]} takes up its jumps: do not command that too."
            raise InputError(message, field=path)
