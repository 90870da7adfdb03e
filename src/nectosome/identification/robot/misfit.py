"""Residuals of a simulated robot against recordings of it, and their derivatives by its unknown quantities."""

import copy
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.core.rows import on_device
from nectosome.description import get_value, resolve
from nectosome.description.variables import Box, Variable
from nectosome.mechanism import Robot, from_rest, in_plane, moves_in_plane
from nectosome.model.build import Template, build, instantiate, template_of
from nectosome.search.executors.processes import processors
from nectosome.solve.integrate import Settings, begin, integrate
from nectosome.solve.readings import Reading, values_of
from nectosome.solve.sensitivity import APART, SensitivityState, by_differences
from nectosome.solve.static import at_rest, frozen_drives

from ..fits.misfit import Misfit
from .static_shapes import RestingRobot, Rests, rests, shapes
from .trial_clocks import robot_times, time_derivatives
from .trials import Compared, RobotTrial

READINGS, DERIVATIVES = "readings", "derivatives"  # what is evaluated
RTOL, _MOST = 1e-5, 200_000
_ATOL = 1e-2  # of the relative tolerance
_FIRST_STEP = 1e-4  # s
_EDGE = 0.02  # of a range
_PRECISION = 0.01  # of standard errors, of a fit of motions: tolerances of their steps make more of it
_SAME = 13  # decimals of places that are the same parameters
_RECENT = 2  # parameters whose readings and derivatives are kept
_APART = 1e-6  # of a trial's length: how far apart its motion is read for its derivative by time

_T = TypeVar("_T")


class RobotMisfit:
    """Trials of one robot, and what is unknown: quantities of all of them, then starts, shifts and drifts of clocks."""

    def __init__(
        self,
        trials: Sequence[RobotTrial],
        variables: Sequence[Variable],
        compared: Sequence[Compared],
        bend: float | None = None,  # of Huber's loss [standard errors]
        rtol: float = RTOL,  # of time steps
    ):
        self.trials, self.compared, self.bend, self.rtol = tuple(trials), tuple(compared), bend, rtol
        self._unknowns = _unknowns(self.trials, variables)
        self.box = Box(tuple(one.variable for one in self._unknowns))
        known = [path for trial in trials for start in trial.starts for path in start.paths]
        also = tuple(dict.fromkeys([path for one in self._unknowns for path in one.paths] + known))
        templates = [template_of(trial.description, (*also, *trial.set_paths)) for trial in trials]
        first = next((trial.description for trial in trials if trial.rows is None), None)
        flat = first is not None and moves_in_plane(build(first))
        readings, signs = tuple(one.reading for one in compared), jnp.array([one.sign for one in compared])
        self._programs = [
            (RestingRobot(of, readings, signs), x)
            if trial.rows is not None
            else (_Equations(of, readings, signs, flat, trial.released), jnp.stack([x, x]) if trial.released else x)
            for trial, (of, x) in zip(trials, templates, strict=True)
        ]
        self._groups = [_alike(trial) for trial in trials]
        self._recent = dict[tuple[str, bytes], Any]()
        self.each: Callable[[str, float], None] | None = None  # called after evaluations: of what, processor seconds
        self._longest = 2 * max(trial.time.size for trial in trials) * len(compared)  # of rates of as many clocks

    @property
    def variables(self) -> tuple[Variable, ...]:
        """All that is unknown: quantities of the robot, starts, shifts and drifts of clocks."""
        return tuple(one.variable for one in self._unknowns)

    @property
    def shared(self) -> tuple[bool, ...]:
        """Whether several trials have them, of each: a start or a clock may be that of one."""
        return tuple(len(one.trials) > 1 for one in self._unknowns)

    def of_few(self, most: int) -> tuple["RobotMisfit", list[int]]:
        """The misfit of so many motions at most, evenly spread, by the same programs; places of its parameters here."""
        if len(self.trials) <= most or any(trial.rows is not None for trial in self.trials):
            return self, [*range(len(self._unknowns))]
        chosen = np.unique(np.linspace(0, len(self.trials) - 1, most).round().astype(int)).tolist()
        few = copy.copy(self)
        few.trials, few._recent, few._unknowns = tuple(self.trials[i] for i in chosen), {}, []
        few._programs, few._groups = ([each[i] for i in chosen] for each in (self._programs, self._groups))
        own = [k for k, one in enumerate(self._unknowns) if one.trials & {*chosen}]
        for one in (self._unknowns[k] for k in own):
            few._unknowns.append(one._replace(trials=frozenset(i for i, j in enumerate(chosen) if j in one.trials)))
        few.box = Box(tuple(one.variable for one in few._unknowns))
        return few, own

    def described(self) -> Float[np.ndarray, "p"]:
        """Values that the robot is described with, of clocks that are right; a start as in its own trial."""
        each = (self.trials[min(one.trials)].description if one.paths else None for one in self._unknowns)
        pairs = zip(each, self._unknowns, strict=True)
        return np.array([0.0 if robot is None else get_value(robot, one.paths[0]) for robot, one in pairs], float)

    def begin(self) -> Float[np.ndarray, "p"]:
        """Where a fit begins: these values where they are in their ranges, else the middles of these.

        A little inside: from a bound on, steps of least squares within bounds are too short to gain anything.
        """
        own = self.box.places(self.described())
        return self.box.values(np.where((own >= 0) & (own <= 1), np.clip(own, _EDGE, 1 - _EDGE), 0.5))

    def computed(self, theta: Float[np.ndarray, "p"]) -> list[Float[np.ndarray, "k n"]]:
        """Readings of the robot with these parameters in each trial; NaN from where its motion could not be computed.

        NaN too in rows without an equilibrium. A heading goes on beyond half a turn, by as many turns as the measured
        one.
        """
        found = self._once(READINGS, theta, lambda i: self._computed(i, theta))
        return [self._turned(values.copy(), trial) for values, trial in zip(found, self.trials, strict=True)]

    def _once(self, what: str, theta: Float[np.ndarray, "p"], of: Callable[[int], _T]) -> list[_T]:
        """`of` each trial, side by side; kept, since a fit, its intervals and its warnings ask for it in turn."""
        key = f"{what} {self.rtol}", np.round(self.box.places(theta), _SAME).tobytes()
        if key not in self._recent:
            began = time.process_time()
            found = [of(0)]  # what is to be compiled is compiled once
            with ThreadPoolExecutor(processors()) as pool:
                found += pool.map(of, range(1, len(self.trials)))
            if self.each is not None:
                self.each(what, time.process_time() - began)
            same = [one for one in self._recent if one[0] == key[0]]
            for one in same[: len(same) - _RECENT + 1]:
                del self._recent[one]
            self._recent[key] = found
        return self._recent[key]

    def _computed(self, i: int, theta: Float[np.ndarray, "p"]) -> Float[np.ndarray, "k m"]:
        if self.trials[i].rows is None:
            return self._computed_at(i, theta)
        return self._read_at_rest(i, theta)[0]

    def _computed_at(
        self, i: int, theta: Float[np.ndarray, "p"], later: tuple[float, ...] = (0.0,)
    ) -> Float[np.ndarray, "k *later_n"]:
        """Readings, each at the times that the clocks of its column say, each time so much later [s]."""
        times, count, places = self._schedule(i, theta, later)
        found = np.asarray(remembered(_computed, *self._numbers(i, theta), times, count, on_device(self.rtol)))
        return np.take_along_axis(found, places, axis=-1)

    def at_rest(self, i: int, theta: Float[np.ndarray, "p"]) -> Rests:
        """Shapes of a trial at rest."""
        return rests(*self._rows(i, theta), self.trials[i].time.size)

    def _read_at_rest(
        self, i: int, theta: Float[np.ndarray, "p"]
    ) -> tuple[Float[np.ndarray, "k m"], Float[np.ndarray, "p k m"]]:
        """Readings of these shapes, and derivatives along the trial's directions."""
        found, size = self.at_rest(i, theta), self.trials[i].time.size
        read = remembered(shapes, *self._rows(i, theta), found.state, self._directions(i, theta))
        readings, along = (np.asarray(x)[..., :size] for x in read)
        return np.where(found.status[:size] == int(Status.SOLVED), readings, np.nan), along

    def _rows(self, i: int, theta: Float[np.ndarray, "p"]) -> tuple[RestingRobot, Float[Array, "m n"]]:
        """Numbers of all rows of a trial at rest, padded so that trials of one structure share a program."""
        trial, (robot, numbers) = self.trials[i], self._numbers(i, theta)
        assert trial.rows is not None
        places = [robot.template.paths.index(path) for path in trial.rows.paths]
        most = max(one.time.size for one in self.trials if one.rows is not None)
        rows = np.pad(trial.rows.values, ((0, most - trial.time.size), (0, 0)), mode="edge")
        return robot, jnp.broadcast_to(numbers, (most, *numbers.shape)).at[:, np.array(places, int)].set(rows)

    def _turned(self, values: Float[np.ndarray, "k m"], trial: RobotTrial) -> Float[np.ndarray, "k n"]:
        for c, one in enumerate(self.compared):
            if one.reading.turns and trial.rows is None:
                values[c] = np.unwrap(values[c])
                off = (trial.measured[c] - values[c]) / (2 * np.pi)
                off = off[np.isfinite(off)]
                values[c] += 2 * np.pi * np.round(np.median(off)) if off.size else 0.0
        return values

    def seconds(self, theta: Float[np.ndarray, "p"]) -> float:
        """Processor time of an evaluation of all trials by that of the first one [s], and not of its compiling."""
        self.computed(theta)
        began = time.process_time()
        self._computed(0, theta)
        return (time.process_time() - began) * len(self.trials)

    def misfit(self, errors: Float[np.ndarray, "k"]) -> Misfit:
        """Residuals over all that was measured, with a standard error of each column."""

        def residuals(rows: Float[np.ndarray, "m p"]) -> Float[np.ndarray, "m r"]:
            return np.stack([self._residuals(self.computed(row), errors) for row in rows])

        def derivatives(theta: Float[np.ndarray, "p"]) -> Float[np.ndarray, "r p"]:
            found = self._once(DERIVATIVES, theta, lambda i: self._derivatives(i, theta))
            each = zip(found, self.trials, strict=True)
            parts = [(x / errors[:, None])[:, np.isfinite(trial.measured)] for x, trial in each]
            return np.concatenate(parts, axis=1).T / self.box.derivatives(theta)

        precision = 0.0 if all(trial.rows is not None for trial in self.trials) else _PRECISION
        return Misfit(residuals, self.box, derivatives, bend=self.bend, precision=precision)

    def residuals(self, theta: Float[np.ndarray, "p"]) -> list[Float[np.ndarray, "k n"]]:
        """Computed less measured of each trial, NaN where nothing is compared; of a heading the shorter way round."""
        return [self._left(y, trial) for y, trial in zip(self.computed(theta), self.trials, strict=True)]

    def _left(self, computed: Float[np.ndarray, "k n"], trial: RobotTrial) -> Float[np.ndarray, "k n"]:
        left = computed - trial.measured
        turns = np.array([one.reading.turns for one in self.compared])[:, None]
        return np.where(turns, np.arctan2(np.sin(left), np.cos(left)), left)

    def _residuals(
        self, computed: Sequence[Float[np.ndarray, "k n"]], errors: Float[np.ndarray, "k"]
    ) -> Float[np.ndarray, "r"]:
        rows = zip(computed, self.trials, strict=True)
        return np.concatenate([(self._left(y, one) / errors[:, None])[np.isfinite(one.measured)] for y, one in rows])

    def _derivatives(self, i: int, theta: Float[np.ndarray, "p"]) -> Float[np.ndarray, "p k n"]:
        """Derivatives of a trial's readings by the parameters' places in their ranges."""
        trial = self.trials[i]
        found = np.zeros((len(self._unknowns), *trial.measured.shape))
        along, moving = self._along(i, theta), self._moving(i)
        found[moving] = along[: len(moving)]
        clocks = [k for k, one in enumerate(self._unknowns) if not one.paths and i in one.trials]
        rates, known = self.rates(i, theta) if clocks else 0.0, self._clock_values(theta)
        for k in clocks:
            by = time_derivatives(trial.clocks, trial.times, known, self._unknowns[k].variable.name)
            found[k] = rates * by * self.box.derivatives(theta)[k]
        return found

    def _along(self, i: int, theta: Float[np.ndarray, "p"]) -> Float[np.ndarray, "m k n"]:
        """Derivatives of a trial's readings along its directions."""
        if self.trials[i].rows is not None:
            return self._read_at_rest(i, theta)[1]
        times, count, places = self._schedule(i, theta)
        numbers, rtol = self._numbers(i, theta), on_device(self.rtol)
        found = np.asarray(remembered(_jacobian, *numbers, times, count, rtol, self._directions(i, theta)))
        return np.take_along_axis(found, places[None], axis=-1)

    def rates(self, i: int, theta: Float[np.ndarray, "p"]) -> Float[np.ndarray, "k n"]:
        """Derivatives of a trial's readings by the robot's time: central differences along the motion.

        Steps of the integration do not depend on where it is read, and between them it is a cubic: differences over a
        millionth of its length are the derivatives of what is computed, to rounding.
        """
        h = _APART * float(self.trials[i].time[-1])
        before, after = np.split(self._computed_at(i, theta, (-h, h)), 2, axis=-1)
        apart = after - before
        turns = np.array([one.reading.turns for one in self.compared])[:, None]
        return np.where(turns, np.arctan2(np.sin(apart), np.cos(apart)), apart) / (2 * h)

    def _numbers(self, i: int, theta: Float[np.ndarray, "p"]) -> tuple[Any, Float[Array, "*two n"]]:
        """The robot of a trial besides its numbers, and these with the parameters."""
        equations, numbers = self._programs[i]
        place, numbers = equations.template.paths.index, np.array(numbers)
        for x, one in zip(theta.tolist(), self._unknowns, strict=True):
            if i in one.trials:
                for path in one.paths:
                    numbers[1 if one.before else ..., place(path)] = x
        for path, x in self.trials[i].held.items():
            numbers[1, place(path)] = x
        return equations, on_device(numbers)

    def values_of(self, i: int, theta: Float[np.ndarray, "p"]) -> dict[str, float]:
        """Numbers of the robot in a trial that are unknown, by their paths: those that it had before its start last."""
        each = zip(theta.tolist(), self._unknowns, strict=True)
        return {path: x for x, one in each if i in one.trials for path in one.paths}

    def _clock_values(self, theta: Float[np.ndarray, "p"]) -> dict[str, float]:
        each = zip(theta.tolist(), self._unknowns, strict=True)
        return {one.variable.name: x for x, one in each if not one.paths}

    def robot_times(self, i: int, theta: Float[np.ndarray, "p"]) -> Float[np.ndarray, "k n"]:
        """Times of the robot at which the readings of a trial were made [s]."""
        return robot_times(self.trials[i].clocks, self.trials[i].times, self._clock_values(theta))

    def _schedule(
        self, i: int, theta: Float[np.ndarray, "p"], later: tuple[float, ...] = (0.0,)
    ) -> tuple[Float[Array, "t"], Int[Array, ""], Int[np.ndarray, "k *later_n"]]:
        """Times at which a trial's motion is read, in order, how many, and the place of each reading among them.

        Columns of one clock share them. They are padded so that trials of one structure share a program, whatever
        clocks they have.
        """
        groups = self._groups[i]
        times = self.robot_times(i, theta)
        each = np.maximum(np.concatenate([times + one for one in later], axis=1), 0.0)
        time = each[[groups.index(g) for g in range(len({*groups}))]].ravel()
        order = np.argsort(time, kind="stable")
        places = np.empty(time.size, int)
        places[order] = np.arange(time.size)
        padded = np.pad(time[order], (0, self._longest - time.size), mode="edge")
        return jnp.asarray(padded), on_device(np.array(time.size)), places.reshape(-1, each.shape[1])[groups]

    def _moving(self, i: int) -> list[int]:
        """Places of the parameters that a trial's motion depends on."""
        return [k for k, one in enumerate(self._unknowns) if one.paths and i in one.trials]

    def _directions(self, i: int, theta: Float[np.ndarray, "p"]) -> Float[Array, "m *two n"]:
        """Derivatives of a template's numbers by the parameters' places in their ranges, as many rows in each trial."""
        (equations, numbers), wide, moving = self._programs[i], self.box.derivatives(theta), self._moving(i)
        paths = equations.template.paths
        rows = np.zeros((max(len(self._moving(j)) for j in range(len(self.trials))), *numbers.shape))
        for row, k in zip(rows, moving, strict=False):
            own = self._unknowns[k]
            row[(1 if own.before else ..., [paths.index(path) for path in own.paths])] = wide[k]
        return jnp.asarray(rows)


class _Unknown(NamedTuple):
    """What is unknown of some trials."""

    variable: Variable
    paths: tuple[str, ...]  # of numbers of the robot; none of a clock
    trials: frozenset[int]  # their places
    before: bool = False  # of the robot before its start alone


def _unknowns(trials: Sequence[RobotTrial], variables: Sequence[Variable]) -> list[_Unknown]:
    every = frozenset(range(len(trials)))
    out = [_Unknown(v, tuple(resolve(trials[0].description, v.name)), every) for v in variables]
    for i, trial in enumerate(trials):
        starts = (start for start in trial.starts if isinstance(start.value, Variable))
        out += [_Unknown(start.value, start.paths, frozenset([i]), start.before) for start in starts]  # pyright: ignore
    clocks = [{v for clock in trial.clocks for v in clock.unknown} for trial in trials]
    late = dict.fromkeys(v for trial in trials for clock in trial.clocks for v in clock.unknown)
    out += [_Unknown(v, (), frozenset(i for i in every if v in clocks[i])) for v in late]
    return out


def _alike(trial: RobotTrial) -> list[int]:
    """A number for each column, from 0, the same for columns of the same clocks."""
    keys = [tuple(c in clock.columns for clock in trial.clocks) for c in range(trial.measured.shape[0])]
    return [list(dict.fromkeys(keys)).index(key) for key in keys]


def _settings(rtol: Float[Array, ""]) -> Settings:
    """How to integrate; derivatives are those by places in the ranges, so that their tolerances are those of states."""
    return Settings("implicit", rtol, _ATOL * rtol, jnp.asarray(_MOST), sensitivity_atol=_ATOL * rtol)


class _Equations(eqx.Module):
    """What a robot is besides its numbers, and what of it is compared."""

    template: Template
    readings: tuple[Reading, ...]
    signs: Float[Array, "k"]
    flat: bool = eqx.field(static=True)
    released: bool = eqx.field(static=True)  # whether numbers are those of the robot, then those that it had before

    def made(self, numbers: Float[Array, "*two n"]) -> tuple[Any, Robot, State]:
        """Equations of motion, the robot, and how it begins: NaN where it had no equilibrium before."""
        robot = instantiate(self.template, numbers[0] if self.released else numbers)
        begins = robot.initial()
        if self.released:
            rests = at_rest(frozen_drives(instantiate(self.template, numbers[1]))).value
            begins = State(rests.q, begins.v, rests.z)
        start = from_rest(robot, jnp.zeros(()), begins)
        return (in_plane(robot) if self.flat else robot), robot, start.state

    def read(self, robot: Robot, t: Array, x: State) -> Float[Array, "k"]:
        """Readings at a time."""
        return self.signs * values_of(self.readings, robot, t, x)


@runs_long
def _computed(
    equations: _Equations,
    numbers: Float[Array, "*two n"],
    times: Float[Array, "t"],
    count: Int[Array, ""],
    rtol: Float[Array, ""],
) -> Float[Array, "k t"]:
    moving, robot, x = equations.made(numbers)
    settings = _settings(rtol)
    start = begin(jnp.zeros(()), x, settings, jnp.asarray(_FIRST_STEP))
    end, states = integrate(moving, start, times, settings)
    values = _of_first(count, lambda tx: equations.read(robot, *tx), (times, states))
    return jnp.where((end.status == int(Status.SOLVED)) | (times < end.end)[:, None], values, jnp.nan).T


@runs_long
def _jacobian(
    equations: _Equations,
    numbers: Float[Array, "*two n"],
    times: Float[Array, "t"],
    count: Int[Array, ""],
    rtol: Float[Array, ""],
    directions: Float[Array, "p *two n"],
) -> Float[Array, "p k t"]:
    """Derivatives of the readings: differences of motions close by, in the same time steps."""

    def change(direction: Array) -> Any:
        return jax.jvp(lambda x: eqx.filter(equations.made(x), eqx.is_inexact_array), (numbers,), (direction,))[1]

    moving, robot, x = equations.made(numbers)
    d_moving, d_robot, d_x = jax.vmap(change)(directions)
    settings = _settings(rtol)
    start = begin(jnp.zeros(()), SensitivityState(x, d_x), settings, jnp.asarray(_FIRST_STEP))
    system = by_differences(moving, d_moving, x, d_x)
    _, found = integrate(system, start, times, settings)

    own, fixed = eqx.partition(robot, eqx.is_inexact_array)
    apart = lambda x, d: jnp.concatenate([x[None], x + APART * d])  # noqa: E731
    robots = jax.tree.map(apart, own, d_robot)

    def at(here: tuple[Array, State, State]) -> Float[Array, "p k"]:
        t, x, dx = here
        read = jax.vmap(lambda numbers, x: equations.read(eqx.combine(numbers, fixed), t, x))
        values = read(robots, jax.tree.map(apart, x, dx))
        return (values[1:] - values[0]) / APART

    return jnp.moveaxis(_of_first(count, at, (times, found.x, found.derivatives)), 0, -1)


def _of_first(count: Int[Array, ""], of: Callable[[Any], Array], rows: Any) -> Float[Array, "t *any"]:
    """`of` each of so many first rows; 0 of others."""
    row = lambda k: jax.tree.map(lambda x: x[k], rows)  # noqa: E731
    like = jax.eval_shape(of, row(0))
    nothing = jnp.zeros((jax.tree.leaves(rows)[0].shape[0], *like.shape))
    return jax.lax.fori_loop(0, count, lambda k, found: found.at[k].set(of(row(k))), nothing)
