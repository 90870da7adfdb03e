"""Periodic motion (limit cycle) of a robot with periodic drives, found as a root, and its stability."""

from collections.abc import Iterable
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Solution, State, Status
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import all_on_device, on_device
from nectosome.core.tracers import known, traced, without_derivatives
from nectosome.description import check_updates, drive_period, numeric_values, samples_at_updates
from nectosome.description.period import drive_frequencies
from nectosome.io.summary import Summary
from nectosome.mechanism import Robot, check_inertia, reduced, stand_in
from nectosome.model import RobotLike, description_of, robot_of, robot_without_ramps
from nectosome.units import check_share, check_whole, read_positive

from .cycle_means import OF_A_CYCLE, CycleMeans, CyclePath, cycle_means, mean_data
from .equal_limbs import EQUAL_LIMBS, one_limb, with_equal_limbs
from .multipliers import NO_MULTIPLIERS, Multipliers, cycle_multipliers, grows
from .orbit import cycle_settings, orbit
from .results import Results, Run, Trajectory, at_hand, at_one_time, attributes_of, drive_limits
from .stream import goes_along, in_still_water, in_stream, with_stream
from .summaries.cycle_summary import cycle_summary
from .symmetry import change_over, find_symmetry
from .turns import free_hinges, with_crank
from .without_cycle import WithoutCycle, instead_of_cycle, periods_agree

_SAME = 1e-9  # relative difference of residuals that counts as equal
_TURNS = 1e-6  # [rad per cycle] below, rotation is within the gap of the cycle
_NOTHING = 1e-12  # [rad] below, rotation is rounding


class Screw(NamedTuple):
    """A rotation about a line and a translation along it."""

    axis: Float[np.ndarray, "3"]  # direction of the line; without rotation that of the translation, 0 without motion
    point: Float[np.ndarray, "3"]  # of the line, nearest to the origin [m]; NaN without rotation
    angle: float  # of rotation [rad], 0 to pi
    along: float  # translation [m]

    def radius(self, position: Float[np.ndarray, "3"]) -> float:
        """Distance [m] of a position from the line, the radius of its path; inf without rotation."""
        if self.angle == 0:
            return np.inf
        return float(np.linalg.norm(np.cross(self.axis, position - self.point)))


def screw_of(
    start: tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]],
    end: tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]],
) -> Screw:
    r"""Screw motion from one pose (R, p) to another, in the outer frame (Chasles; Murray, Li, Sastry 1994, sec. 2.3).

    The displacement $x \to R x + d$, with $R = R_1 R_0^T = e^{[a]\theta}$ and $d = p_1 - R p_0$, maps to itself the
    line along a through

    $$ c = \tfrac12 \left(d_\perp + \cot\tfrac\theta2\; a \times d_\perp\right), \quad d_\perp = d - (a \cdot d)\, a $$

    A rotation by more than pi appears as the shorter one in the other direction.
    """
    from scipy.spatial.transform import Rotation

    R = end[0] @ start[0].T
    d = end[1] - R @ start[1]
    turn = Rotation.from_matrix(R).as_rotvec()
    angle = float(np.linalg.norm(turn))
    if angle < _NOTHING:
        distance = float(np.linalg.norm(d))
        return Screw(d / distance if distance > 0 else d, np.full(3, np.nan), 0.0, distance)
    axis = turn / angle
    along = float(axis @ d)
    across = d - along * axis
    return Screw(axis, 0.5 * (across + np.cross(axis, across) / np.tan(0.5 * angle)), angle, along)


class Periodic(Run):
    """A cycle: a Run from t = 0 to the period. `stats["multiplier"]` is the largest magnitude among `multipliers`.

    A disturbance of the state is multiplied by them in each cycle; directions along the symmetry are excluded.
    """

    multipliers: np.ndarray = eqx.field(kw_only=True)  # complex Floquet multipliers, the largest first; none if traced
    multiplier_errors: np.ndarray = eqx.field(kw_only=True)  # of each
    title: ClassVar[str] = "periodic motion"

    @property
    def reason(self) -> str:
        """Its status in words, with what is left of a gap, and the disturbances that it is about."""
        reason, left = super().reason, float(self.residual)
        if self.multipliers.size and left > 1:
            limit = float(self.stats["residual_limit"])
            reason += f"; its ends meet within {left:.2g} tolerances of a step only, of {limit:.3g} that are accepted,"
            run, start = self.value, jax.tree.map(lambda x: x[0], self.value.state)
            touches = eqx.filter_eval_shape(run.system.gaps, run.time[0], start) is not None
            what = "contacts, stops and slack tendons amplify" if touches else "the motion amplifies"
            reason += f" as {what} errors of steps"
        return with_equal_limbs(reason, self.stats)

    @property
    def speed(self) -> Float[Array, ""]:
        """Mean speed of the first part's first station through the water [m/s], as in `means`."""
        return self.means().speed

    def means(self) -> CycleMeans:
        """Means and peaks over the cycle."""
        return self._means

    @cached_property
    def _means(self) -> CycleMeans:
        trajectory = self.value
        return remembered(cycle_means, trajectory.system, trajectory.time, trajectory.state)

    def course(self) -> CyclePath:
        """Circle or helix of the root body through the water over the cycles; radius inf without rotation."""
        robot, time, states = self.value.system, self.value.time, self.value.state
        time, states = jax.tree.map(np.asarray, (time, states))  # what JAX takes apart it compiles programs for
        ends = [remembered(_pose, robot, time[k], jax.tree.map(lambda x, k=k: x[k], states)) for k in (0, -1)]
        start, end = ((np.asarray(R), np.asarray(p)) for R, p in ends)
        carried = np.asarray(self.means().water_velocity) * float(time[-1])
        screw = screw_of(start, (end[0], end[1] - carried))
        if screw.angle <= _TURNS:
            return CyclePath(np.inf, 0.0, screw.axis, np.inf)
        per_turn = 2 * np.pi / screw.angle
        return CyclePath(screw.radius(start[1]), screw.angle / float(time[-1]), screw.axis, per_turn * screw.along)

    def instead(self) -> WithoutCycle:
        """What the motion does where no cycle of this period was found, by a run of more periods from its end."""
        robot, last = self.value.system, jax.tree.map(lambda x: x[-1], self.value.state)
        if goes_along(robot):
            last = remembered(in_stream, robot, self.value.time[-1], last, on_device(-1.0))
            robot = in_still_water(robot)
        return instead_of_cycle(robot, find_symmetry(robot), last, float(self.stats["period"]))

    def results(self, settings: dict[str, Any] | None = None) -> Results:
        """Results of the cycle as of any run, its multipliers, and its means that are single numbers."""
        found = super().results(settings)
        if self.value.time.shape[0] > 1:
            each = self.means()._asdict()
            single = {name: ((), at_hand(each[name]), unit) for name, (dims, unit) in OF_A_CYCLE.items() if not dims}
            found = found._replace(data=found.data | single)
        return found._replace(data=found.data | self._multiplier_data())

    def mean_results(self, settings: dict[str, Any] | None = None) -> Results:
        """Means and largest magnitudes over the cycle, and limits of its servos, as results."""
        robot = self.value.system
        data, names = mean_data(robot, self.means())
        return Results(data | drive_limits(robot) | self._multiplier_data(), names, attributes_of(self, settings))

    def summary(self, each: bool = False, multipliers: bool = False) -> Summary:
        """Cycle averages, stroke, powers, as the command line prints them; with `each`, each load on each part.

        With `multipliers`, all of them with their errors.
        """
        means = self.mean_results()
        return cycle_summary(means.arrays, self.course(), means.attributes, each, multipliers)

    def _multiplier_data(self) -> dict[str, Any]:
        real, imaginary = np.real(self.multipliers), np.imag(self.multipliers)
        parts = {"real": real, "imaginary": imaginary, "error": self.multiplier_errors}
        return {f"multiplier_{name}": (("multiplier",), x, "1") for name, x in parts.items()}


def _pose(robot: Robot, t: Array, x: State) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
    """Rotation and position of the root body's first station."""
    shape = robot.tree.shape(robot.tree.complete(t, x.q, x.v)[0])
    return shape.rotation[0], shape.position[0]


def periodic(
    robot: RobotLike,
    period: float | str | Array | None = None,
    *,
    settings: Iterable[str] = (),
    guess: State | None = None,
    samples: int = 129,
    rtol: float = 1e-6,
    atol: float = 1e-8,
    whole: bool = False,
    multipliers: bool = True,
) -> Periodic:
    """Relative periodic orbit of a robot whose drives repeat themselves with `period`, seconds or text such as "0.5s".

    The robot is given by name, path, description or built, with `settings` such as "f=2Hz"; without a period, that of
    its description's drives is taken (see `drive_period`). Where a motor turns a hinge at a speed of its own, and no
    drive has a frequency, the period is that of a whole turn of the hinge, and found with the cycle; `guess` and the
    start of the robot say at which angle the cycle begins. Ramps of its drives are left out. All that its equations
    depend on returns after a period; place and heading may go on. It is looked for from `guess` (a state at t = 0),
    else from rest, and of what a uniform current carries along seen from the water. Status SOLVED; SETTLED where it was
    found by waiting; UNSTABLE where a multiplier is above 1; NO_PERIOD; OTHER_PERIOD where the drives do not repeat
    themselves; NO_TURN where a motor stalls. What sampled loops of servos hold is among the states, each with a
    multiplier of 0; `samples` are as many more that updates are among them. The ends of the cycle meet within what
    `rtol` and `atol` allow for one time step, of numbers as large as they get in the cycle; where contacts, stops
    or limits of drives amplify errors of steps, within a quarter as many as there are steps, at most 100 (see
    `residual` and `stats["residual_limit"]`). Derivatives with respect to robot and period are those of `orbit`,
    forward only; a traced robot has its status, and no multipliers. Of limbs that are equal, go evenly around an axis
    and do the same, one is solved with its share of the body, unless `whole`: the multipliers are those of disturbances
    alike on all of them then. Without `multipliers` they are as exact as the search needed them, which their errors
    say, or as it takes to tell stability, at half the cost. Raises InputError for what is no robot, where its drives
    have no period or its loops no whole number of updates in it, and for a period, sample count or tolerance that makes
    no sense.
    """
    check_whole(samples, "samples", 2)
    check_share(rtol, "rtol")
    check_share(atol, "atol")
    seconds: Any = period if period is None or traced(period) else read_positive(period, "time", "period")
    given, outside = robot, robot_without_ramps(robot_of(robot, settings))
    carried = goes_along(outside)
    robot = in_still_water(outside) if carried else outside
    guess = in_stream(outside, jnp.zeros(()), guess, -1.0) if carried and guess is not None else guess
    pure, like = traced(robot, seconds, guess), stand_in(robot)
    check_inertia(like)
    x = begins = robot.initial() if guess is None else guess
    limb = None if pure or whole else one_limb(robot, x)
    if limb is not None:
        robot, like, x = limb.robot, limb.robot, limb.start
    symmetry, none, change = find_symmetry(robot), NO_MULTIPLIERS, on_device(0.0)
    if seconds is None and free_hinges(robot, symmetry):
        symmetry = with_crank(like, symmetry, like.initial() if pure else x)
        if symmetry.crank is None:
            return _result(at_one_time(outside, begins), np.nan, Status.NO_TURN, {}, none, on_device(np.nan))
        seconds = 1.0  # times are fractions of what is found
    else:
        if seconds is None:
            seconds = _period_of(robot) if robot.example.value else drive_period(description_of(given, settings))
        if robot.update_rates is not None:
            rates, lasts = np.asarray(like.update_rates).tolist(), known(seconds)
            lasts = drive_period(description_of(like)) if lasts is None else float(lasts)
            check_updates(rates, lasts)
            samples = samples_at_updates(rates, lasts, samples)
        if x.v.size:
            change = change_over(robot, seconds)
        if not pure and float(change) > _SAME:
            return _result(at_one_time(outside, begins), seconds, Status.OTHER_PERIOD, {}, none, on_device(np.nan))
    times = jnp.linspace(0.0, 1.0, samples) * seconds if traced(seconds) else np.linspace(0.0, seconds, samples)
    stepping = cycle_settings("implicit", without_derivatives(seconds), *all_on_device(rtol, atol))
    found: Solution = remembered(orbit, reduced(robot), symmetry, x, times, stepping, multipliers or pure)
    if pure:
        lasts, status = times[-1] if found.value.period is None else found.value.period, found.status
        status = jnp.where(change > _SAME, int(Status.OTHER_PERIOD), status)
        closed = (status == int(Status.SOLVED)) | (status == int(Status.SETTLED))
        status = jnp.where(closed & grows(symmetry, found.value), int(Status.UNSTABLE), status)
        times = jnp.asarray(times if found.value.period is None else times * lasts)
        states = with_stream(outside, times, found.value.states) if carried else found.value.states
        trajectory, stats = Trajectory(outside, times, states), {"period": lasts, **found.stats}
        return Periodic(
            trajectory, status, stats, found.residual, multipliers=none.values, multiplier_errors=none.errors
        )
    span = times
    if found.value.period is not None:
        seconds = float(found.value.period)
        times = times * seconds
    status, stats, judged = Status(int(found.status)), dict(found.stats), none
    states = found.value.states
    if limb is not None:
        states, stats = jax.tree.map(on_device, limb.whole_states(states)), stats | {EQUAL_LIMBS: limb.count}
    if status in (Status.SOLVED, Status.SETTLED):
        judged = cycle_multipliers(reduced(robot), symmetry, found.value, span, stepping, multipliers)
        sizes = {"multiplier": np.abs(judged.values), "multiplier_error": judged.errors}
        stats |= {key: on_device(each[0] if each.size else 0.0) for key, each in sizes.items()}
        if judged.grow:
            status = Status.UNSTABLE
        elif float(found.residual) > 1 and not periods_agree(robot, symmetry, found, float(seconds), stepping):
            status, judged = Status.NO_PERIOD, none
    states = remembered(with_stream, outside, times, states) if carried else states
    trajectory = Trajectory(outside, on_device(times), states)
    return _result(trajectory, seconds, status, stats, judged, found.residual)


def _period_of(robot: Robot) -> Array:
    """Period of the drives of a robot that `bind` traces [s], in the ratio of frequencies of the known one."""
    before, now = description_of(robot.example.value), numeric_values(robot.made_from.value)
    frequencies = drive_frequencies(before)
    period = drive_period(before)
    fastest = max(frequencies, key=frequencies.__getitem__)
    return period * abs(numeric_values(before)[fastest]) / jnp.abs(now[fastest])


def _result(trajectory: Trajectory, period, status: Status, stats, multipliers: Multipliers, residual) -> Periodic:
    stats = {key: on_device(value) for key, value in {"period": period, **stats}.items()}
    values, errors = multipliers
    return Periodic(trajectory, status, stats, residual, multipliers=values, multiplier_errors=errors)
