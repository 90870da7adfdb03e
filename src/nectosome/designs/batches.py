"""Motions of many robots of one structure: steady, or periodic with their drives."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered, runs_long
from nectosome.core.side_by_side import side_by_side
from nectosome.description import (
    RobotDescription,
    check_no_ramps,
    check_numbers,
    check_updates,
    drive_frequencies,
    drive_period,
    like_periods,
    resolve,
    samples_at_updates,
    update_rates,
    without_ramps,
)
from nectosome.io.schema.structure import changed
from nectosome.mechanism import Robot, continuous_loops, in_plane, moves_in_plane
from nectosome.model import Template, instantiate, template_of
from nectosome.solve import (
    CycleMeans,
    Symmetry,
    cycle_means,
    equilibrium,
    find_symmetry,
    goes_along,
    in_still_water,
    periodic,
    with_crank,
    with_stream,
)
from nectosome.solve.equal_limbs import EQUAL_LIMBS
from nectosome.solve.multipliers import largest_multiplier
from nectosome.solve.orbit import cycle_settings, settled_orbit
from nectosome.solve.small_motions import SmallMotion, Stability, eigenvalues, linearised
from nectosome.units import InputError

from .axes import SweepAxis

_WIDTH = 28  # robots in the plane that a processor computes side by side; in space it takes one after another
_MANY = 1000  # parts of a sweep whose points are computed alone, from which on a part has more than one
_SLOW_RTOL = 1e-6  # of what settles slowly: its cycle is off by that of many cycles together
_FOUND = tuple(int(s) for s in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE))
_SURELY_STABLE = 0.98  # a batch whose largest multiplier is below it is stable; others `periodic` judges one by one
_INSTANT = 1e-4  # s, over which means of a steady motion are taken


class SharedStructure(eqx.Module):
    """What robots that differ in numbers only have in common."""

    template: Template
    symmetry: Symmetry
    flat: bool = eqx.field(static=True)  # they move in the plane
    carried: bool = eqx.field(static=True)  # a uniform current carries them along


@dataclass(frozen=True)
class RobotPoints:
    """Numbers of robots of one structure: all that a worker needs of them."""

    kind: SharedStructure
    numbers: Float[np.ndarray, "k p"]
    periods: Float[np.ndarray, "k"]  # [s]; 0 of a steady motion, and where it is found with the motion
    samples: int
    rtol: float
    width: int  # how many are computed side by side
    whole: bool  # every limb is solved, also where equal ones do the same

    @property
    def robot(self) -> Robot:
        """The first of them."""
        return _robot(self.kind.template, self.numbers[0])

    def part(self, span: np.ndarray) -> "RobotPoints":
        """Some of them, as they are sent to a worker."""
        numbers, periods = self.numbers[span], self.periods[span]
        return RobotPoints(self.kind, numbers, periods, self.samples, self.rtol, self.width, self.whole)

    def solved(self) -> dict[str, np.ndarray]:
        """Means, and the status, of the motions of all points; NaN where there is none."""
        if self.width == 1 and len(self.periods) > 1:
            each = [self.part(np.array([k])).solved() for k in range(len(self.periods))]
            return {name: np.concatenate([one[name] for one in each]) for name in each[0]}
        if self.kind.symmetry.crank is not None or (self.periods.any() and not self.kind.flat):
            return self._alone()
        size = len(self.periods)
        padded = np.resize(np.arange(size), self.width)  # one program for all parts
        numbers, periods = jnp.asarray(self.numbers[padded]), self.periods[padded]
        if not periods.any():
            means, status, around = remembered(_steady, self.kind, numbers)
        else:
            times = jnp.asarray(np.linspace(0.0, periods, self.samples, axis=1))
            means, status, around = remembered(_periodic, self.kind, numbers, times, jnp.asarray(self.rtol))
        out = {name: np.array(x)[:size] for name, x in means._asdict().items()}
        status = np.array(status)[:size]
        for k in np.flatnonzero(status == int(Status.SOLVED)):
            status[k] = int(self._judged(jax.tree.map(lambda x, k=k: np.asarray(x[k]), around)))
        for k in np.flatnonzero(status == int(Status.NO_PERIOD)):
            robot = _robot(self.kind.template, self.numbers[k])
            rtol = min(self.rtol, _SLOW_RTOL)
            one = periodic(robot, self.periods[k], samples=self.samples, rtol=rtol, atol=1e-2 * rtol)
            status[k] = int(one.status)
            for name, x in one.means()._asdict().items():
                out[name][k] = np.asarray(x)
        good = np.isin(status, _FOUND)
        for x in out.values():
            x[~good] = np.nan
        return out | {"status": status}

    def _judged(self, around: Any) -> Status:
        """Whether a motion that was solved is stable, by small motions or the multipliers of a cycle.

        NO_PERIOD where the derivative of the batch does not tell: `periodic` judges alone. Steps over a stop that are
        just short enough leave 4 in the derivative where the motion forgets its start.
        """
        if isinstance(around, SmallMotion):
            return Status.SOLVED if Stability.of(eigenvalues(around, self.kind.symmetry)).stable else Status.UNSTABLE
        stable = largest_multiplier(self.kind.symmetry, around) < _SURELY_STABLE
        return Status.SOLVED if stable else Status.NO_PERIOD

    def _alone(self) -> dict[str, np.ndarray]:
        """The same of a single point by the search of `periodic`, and for how many limbs one stands.

        Where a motor finds its own, the period [s] as well.
        """
        turns = self.kind.symmetry.crank is not None
        rtol = self.rtol if turns else min(self.rtol, _SLOW_RTOL)
        template = self.kind.template
        values = dict(zip(template.paths, self.numbers[0].tolist(), strict=True))
        robot = self.robot.described(changed(template.plan.description, values))
        period = None if turns else self.periods[0]
        found = periodic(robot, period, samples=self.samples, rtol=rtol, atol=1e-2 * rtol, whole=self.whole)
        means, period = {name: np.full(own, np.nan) for name, own in self.shapes().items()}, np.nan
        if int(found.status) in _FOUND:
            means, period = found.means()._asdict(), found.stats["period"]
        each = means | {"status": int(found.status), EQUAL_LIMBS: int(found.stats.get(EQUAL_LIMBS, 1))}
        each |= {"period": period} if turns else {}
        return {name: np.asarray(x)[None] for name, x in each.items()}

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each mean of one point."""
        robot = self.robot
        still = jax.tree.map(lambda x: jnp.stack([x, x]), robot.initial())
        means: CycleMeans = eqx.filter_eval_shape(cycle_means, robot, jnp.zeros(2), still)
        return {name: x.shape for name, x in means._asdict().items()}


@dataclass(frozen=True)
class RobotBatch(RobotPoints):
    """Robots of one structure, point by point of a grid of quantities."""

    description: RobotDescription
    axes: tuple[SweepAxis, ...]  # the last one runs fastest

    def spans(self) -> list[np.ndarray]:
        """Indices of the points that are computed together: those of like periods, which take as many steps.

        Those that are computed alone go together where there are many, so that nobody keeps book of each.
        """
        order = np.argsort(self.periods, kind="stable")
        width = self.width if self.width > 1 else min(max(1, order.size // _MANY), _WIDTH)
        return [order[k : k + width] for k in range(0, order.size, width)]


def batches_of(
    description: RobotDescription,
    axes: tuple[SweepAxis, ...],
    samples: int,
    rtol: float,
    whole: bool = False,
    draws: Sequence[Mapping[str, float]] = (),
) -> RobotBatch:
    """Points of the grid of the axes, the last of which runs fastest.

    - draws: other values by path, each for the whole grid: a last axis. What the axes set, no draw changes.

    Raises InputError where drives have no period, and where the ends of the axes differ in what their motion may do.
    """
    paths = [resolve(description, a.name) for a in axes]
    check_no_ramps(description, (a.name for a in axes))
    description = without_ramps(description)
    set_by_axes = {path for group in paths for path in group}
    drawn = [path for path in (draws[0] if draws else ()) if path not in set_by_axes]
    template, base = template_of(description, (*(path for group in paths for path in group), *drawn))
    grid = np.array([*product(*(a.values for a in axes))])
    numbers = np.tile(np.asarray(base), (len(grid), 1))
    for k, group in enumerate(paths):
        numbers[:, [template.paths.index(path) for path in group]] = grid[:, k, None]
    corner = _corners(axes)
    if draws:
        numbers = np.repeat(numbers, len(draws), axis=0)
        columns = [template.paths.index(path) for path in drawn]
        numbers[:, columns] = np.tile([[draw[path] for path in drawn] for draw in draws], (len(grid), 1))
        # what the motion may do in space is that of all draws
        corner = [*range(len(draws)), *(k * len(draws) for k in corner if k)]
    for k in corner:
        each = dict(zip(template.paths, numbers[k].tolist(), strict=True))
        check_numbers(changed(description, {path: each[path] for path in (*set_by_axes, *drawn)}))
    corners = [_robot(template, numbers[k]) for k in corner]
    carried = all(goes_along(robot) for robot in corners)
    corners = [in_still_water(robot) for robot in corners] if carried else corners
    symmetry, *others = (find_symmetry(robot) for robot in corners)
    if any(other != symmetry for other in others):
        raise InputError("changes what the robot is free to do without end. Sweep its parts apart.", field="over")
    turning = (with_crank(robot, symmetry, robot.initial()) for robot in corners)
    symmetry = next((each for each in turning if each.crank is not None), symmetry)
    kind = SharedStructure(template, symmetry, all(moves_in_plane(robot) for robot in corners), carried)
    periods = np.zeros(len(numbers))
    if not symmetry.steady:
        each, samples = _periods(description, axes, samples)
        periods = np.repeat(each, len(draws) or 1)
        _check_same_periods(description, [{path: draw[path] for path in drawn} for draw in draws])
    width = 1 if symmetry.crank is not None else side_by_side(_WIDTH if kind.flat else 1, len(numbers))
    if draws:
        axes = (*axes, SweepAxis("draw", tuple(map(float, range(len(draws)))), "", "number"))
    return RobotBatch(kind, numbers, periods, samples, rtol, width, whole, description, axes)


def _periods(
    description: RobotDescription, axes: tuple[SweepAxis, ...], samples: int
) -> tuple[Float[np.ndarray, "k"], int]:
    """Period [s] of each point, and at least `samples` times of a cycle with the updates of all points among them.

    Few points stand for the others, whose periods and updates are the same. Raises InputError for the first point that
    has no period, then for the first whose updates do not fit into it.
    """
    alike = [like_periods(description, a.name, a.values) for a in axes]
    chosen = [sorted(set(firsts)) for firsts in alike]
    few = product(*([a.values[k] for k in own] for a, own in zip(axes, chosen, strict=True)))
    paths = [resolve(description, a.name) for a in axes]
    changes = ({path: x for group, x in zip(paths, values, strict=True) for path in group} for values in few)
    robots = [changed(description, each) for each in changes]
    periods = [drive_period(robot) for robot in robots]
    rates = [update_rates(robot) for robot in robots] if update_rates(description) else [()] * len(robots)
    for own, period in zip(rates, periods, strict=True):
        check_updates(own, period)
    counts = {rate * period for own, period in zip(rates, periods, strict=True) for rate in own}
    where = np.ix_(*(np.searchsorted(own, firsts) for own, firsts in zip(chosen, alike, strict=True)))
    each = np.array(periods).reshape([len(own) for own in chosen])[where].ravel()
    return each, samples_at_updates(counts, 1.0, samples)


def _check_same_periods(description: RobotDescription, draws: Sequence[Mapping[str, float]]) -> None:
    """Raise InputError where the frequency of a drive is not known exactly."""
    own = drive_frequencies(description)
    for draw in draws:
        for path, frequency in drive_frequencies(changed(description, draw)).items():
            if frequency != own.get(path):
                why = "is not known exactly, and a sweep needs one period for all draws. Leave its +- out, or take"
                raise InputError(f"{why} periodic --spread.", field=path)


def _corners(axes: tuple[SweepAxis, ...]) -> list[int]:
    """Indices of the points where every axis is at one of its ends."""
    shape = tuple(len(a.values) for a in axes)
    index = np.arange(int(np.prod(shape))).reshape(shape)
    return sorted(int(index[end]) for end in product(*({0, n - 1} for n in shape)))


def _robot(template: Template, numbers: np.ndarray) -> Robot:
    """Robot of one point."""
    return remembered(instantiate, template, jnp.asarray(numbers))


@runs_long
def _periodic(kind: SharedStructure, numbers: Array, times: Array, rtol: Array) -> tuple[CycleMeans, Array, Array]:
    """Means over the cycles of robots in the plane, statuses, and derivatives of the state after by that before."""

    def one(numbers: Array, times: Array) -> tuple[CycleMeans, Array, Array]:
        robot = instantiate(kind.template, numbers)
        settings = cycle_settings("explicit", times[-1], rtol, 1e-2 * rtol)
        still = in_still_water(robot) if kind.carried else robot
        found = settled_orbit(in_plane(still), kind.symmetry, robot.initial(), times, settings)
        states = found.value.states
        states = with_stream(robot, times, states) if kind.carried else states
        return cycle_means(robot, times, states), found.status, found.value.monodromy

    return _each(one, numbers, times)


@runs_long
def _steady(kind: SharedStructure, numbers: Array) -> tuple[CycleMeans, Array, SmallMotion]:
    """Means of steady motions, over an instant, statuses, and small motions about them."""

    def one(numbers: Array) -> tuple[CycleMeans, Array, SmallMotion]:
        robot = continuous_loops(instantiate(kind.template, numbers))
        still = in_still_water(robot) if kind.carried else robot
        found = equilibrium(still, kind.symmetry, robot.initial(), jnp.asarray(False))
        x, times = found.value.state, jnp.array([0.0, _INSTANT])
        later = State(robot.advance(x.q, x.v, times[1]), x.v, x.z)
        states = jax.tree.map(lambda *x: jnp.stack(x), x, later)
        means = cycle_means(robot, times, with_stream(robot, times, states) if kind.carried else states)
        return means, found.status, linearised(still, x)

    return _each(one, numbers)


def _each(one: Callable[..., Any], *points: Array) -> Any:
    """All points side by side; one point without the cost of a batch."""
    if len(points[0]) > 1:
        return jax.vmap(one)(*points)
    return jax.tree.map(lambda x: x[None], one(*(x[0] for x in points)))
