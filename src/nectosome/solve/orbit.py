r"""Periodic orbits by shooting, modulo the symmetry of the equations.

The unknown is a state x at the start of a cycle that returns to itself after a period T, modulo the symmetry: position
and heading of a swimmer may drift. With the flow $\Phi_T$ and displacements y of the state,

$$ F(y) = \Phi_T(x \oplus y) \ominus (x \oplus y) = 0, \quad y = -(D\Phi_T - 1)^{-1} F $$

by Newton's method; the derivative goes through the adaptive time steps. It costs many times as much as the cycle, so it
is kept while its corrections close the gap quickly, and recomputed at the solution. If a correction does not reduce the
gap, one cycle of free motion follows instead, as in the first cycles.

The orbit's derivatives follow from the implicit function theorem, $dy = -(D\Phi_T - 1)^{-1} dF$, with one integration
of the cycle and its sensitivities to y and to the changed parameters, under error control of both.

Of a robot without a clock the period is unknown (see `turns`). It takes the place of the crank's angle among y, and
with the flow f at the end the column of the derivative is $\partial F / \partial T = f$. Free motion goes from turn to
turn of the crank then. The derivative of the return to the same angle of the crank k is

$$ \frac{\partial P_i}{\partial y_j} = (D\Phi_T)_{ij} - \frac{f_i}{f_k} (D\Phi_T)_{kj} $$
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from nectosome.core import Solution, State, Status
from nectosome.core.linear_algebra import generalised_inverse
from nectosome.core.programs.remember import runs_long
from nectosome.core.rows import on_device
from nectosome.core.shared_derivatives import along
from nectosome.mechanism import Robot

from .integrate import Method, Settings, begin, integrate
from .runge_kutta import rms
from .sensitivity import SensitivityState, SensitivitySystem
from .symmetry import Model, Symmetry, near
from .turns import turn

_WAIT, _CYCLES = 2, 60  # cycles before Newton's method, and in total
_CORRECTIONS = 12
_QUICK = 0.1  # ratio of successive gaps up to which the derivative is kept
_NOISE = 20.0  # [tolerance of a step] accepted gap where corrections do not reduce it, an error of hundreds of steps
_SETTLE, _POLISH = 8, 4  # most cycles of free motion, and of Newton's method after them, side by side
_LOOSE, _LOOSE_STEPS = (1e-3, 1e-5), 25  # relative and absolute tolerance, and least steps, of that derivative
_FIRST_STEP = 1e-4  # [s]
_NOTHING = 1e-9  # elements of the gap's derivative below this are rounding errors


class Orbit(NamedTuple):
    """A periodic motion."""

    states: State  # at the given times, leaves [n, ...]; the first is the start of the cycle
    monodromy: Float[Array, "m m"]  # derivative of the state after a cycle by the state before, in displacements
    period: Float[Array, ""] | None = None  # [s], where it was unknown; the crank has no derivatives in monodromy then


class CycleAttempt(NamedTuple):
    """One cycle from a given state."""

    states: State  # at the given times
    gap: Float[Array, "m"]  # between its ends, modulo the symmetry
    allowed: Float[Array, "m"]  # tolerance at the largest magnitudes of the cycle
    size: Float[Array, ""]  # of the gap over the tolerance; at most 1: closed
    status: Array  # of the time integration

    @property
    def end(self) -> State:
        """State at the end."""
        return jax.tree.map(lambda x: x[-1], self.states)


class _OrbitSearch(NamedTuple):
    x: State
    period: Array | None  # [s], where it is unknown
    found: CycleAttempt
    monodromy: Array
    inverse: Array  # of the last derivative of the gap
    derive: Array  # recompute it in the next cycle
    best: Array  # size that a correction must halve; inf after a cycle of free motion
    corrections: Array
    cycles: Array
    waited: Array  # the last step was a cycle of free motion
    closed: Array
    done: Array


class _Correction(NamedTuple):
    """Newton's method after free motion."""

    x: State
    step: Array  # from x to what it corrects
    found: CycleAttempt  # from x
    left: Array  # the larger of gap and step over the tolerance
    rounds: Array


def between(robot: Model, symmetry: Symmetry, a: State, b: State) -> Float[Array, "m"]:
    """Displacement from a to b, 0 along the symmetry and without whole turns of cranks."""
    displacement = robot.displacements(b.q) - robot.displacements(a.q)
    if symmetry.turns:
        turning = np.isin(np.arange(displacement.shape[0]), symmetry.turns)
        turns = jnp.round(displacement / (2 * jnp.pi))
        if symmetry.crank is not None:  # one turn, no more and no less, also of another period
            turns = turns.at[symmetry.crank].set(jnp.sign(displacement[symmetry.crank]))
        displacement -= jnp.where(turning, 2 * jnp.pi * turns, 0.0)
    displacement = jnp.where(symmetry.rates(displacement.shape[0]), 0.0, displacement)
    if symmetry.spin and isinstance(robot, Robot):
        displacement = displacement.at[:3].set(symmetry.tilt(robot, a.q, b.q))
    return jnp.concatenate([displacement, b.v - a.v, ravel_pytree(b.z)[0] - ravel_pytree(a.z)[0]])


def cycle(
    robot: Model,
    symmetry: Symmetry,
    x: State,
    times: Float[Array, "n"],
    settings: Settings,
    derive: Bool[Array, ""] | bool = True,
) -> CycleAttempt:
    """States at times that increase from 0 to the period, and the gap between the last and the first.

    Derivatives are meaningless where not `derive`, and then cost little.
    """
    start = begin(jnp.zeros(()), x, settings, jnp.asarray(_FIRST_STEP))
    m, later = integrate(robot, start, times[1:], settings, derive=derive)
    states = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), x, later)
    gap = between(robot, symmetry, x, jax.tree.map(lambda x: x[-1], later))
    numbers = jax.vmap(lambda x: ravel_pytree((robot.displacements(x.q), x.v, x.z))[0])(states)
    allowed = settings.atol + settings.rtol * jnp.max(jnp.abs(numbers), axis=0)
    return CycleAttempt(states, gap, allowed, rms(gap / allowed), m.status)


def _before(x: State, times: Float[Array, "n"]) -> CycleAttempt:
    """Placeholder for the cycle before the first; it ends at x."""
    states = jax.tree.map(lambda x: jnp.broadcast_to(x, (times.shape[0], *x.shape)), x)
    gap = jnp.full(ravel_pytree((x.v, x.v, x.z))[0].shape, jnp.inf)
    return CycleAttempt(states, gap, jnp.ones(gap.shape), jnp.asarray(jnp.inf), jnp.asarray(int(Status.SOLVED)))


def settled_orbit(
    robot: Model, symmetry: Symmetry, guess: State, times: Float[Array, "n"], settings: Settings
) -> Solution:
    """Periodic orbit that free motion (transient) leads to, with status SOLVED, or NO_PERIOD after a few cycles.

    If the gap g shrinks by the factor s per cycle, the remaining distance is g/(1 - s): until it is within the
    tolerance, cycles need no derivatives. Newton's method follows, until gap and correction are within the tolerance,
    with one derivative, by a cycle at loose tolerances. Corrections shrink by its error, and the monodromy has it too:
    the largest multipliers of a tuna and a rowing robot, 0.713 and 1.211, are off by 0.002.
    """

    def more(carry: tuple[CycleAttempt, Array, Array]) -> tuple[CycleAttempt, Array, Array]:
        before, _, count = carry
        found = cycle(robot, symmetry, before.end, times, settings)
        shrinks = jnp.isfinite(before.size) & (found.size < before.size)
        share = jnp.where(shrinks, found.size / jnp.where(shrinks, before.size, 1.0), 0.0)
        left = jnp.where(shrinks | (found.size == 0), found.size / (1.0 - share), jnp.inf)
        return found, left, count + 1

    def going(carry: tuple[CycleAttempt, Array, Array]) -> Array:
        found, left, count = carry
        return (left > 1.0) & (found.status == solved) & (count < _SETTLE)

    def gap(y: Array) -> Array:
        return cycle(robot, symmetry, near(robot, x, y), times, loose).gap

    def judged(x: State, found: CycleAttempt, rounds: Array) -> _Correction:
        step = -inverse @ found.gap
        return _Correction(x, step, found, jnp.maximum(found.size, rms(step / found.allowed)), rounds)

    def correct(s: _Correction) -> _Correction:
        x = near(robot, s.x, s.step)
        return judged(x, cycle(robot, symmetry, x, times, settings), s.rounds + 1)

    def correcting(s: _Correction) -> Array:
        return ~(s.left <= 1.0) & jnp.isfinite(rms(s.step)) & (s.found.status == solved) & (s.rounds < _POLISH)

    solved, none, far = int(Status.SOLVED), jnp.zeros((), int), jnp.asarray(jnp.inf)
    waited, _, count = jax.lax.while_loop(going, more, (_before(guess, times), far, none))
    x = jax.tree.map(lambda x: x[0], waited.states)
    rtol, atol = jnp.asarray(_LOOSE)
    loose = Settings(settings.method, rtol, atol, settings.max_steps, longest=times[-1] / _LOOSE_STEPS)
    J = jax.jacfwd(gap)(jnp.zeros(waited.gap.size))
    inverse, monodromy = _solved(J), _along_velocities(robot, symmetry, x, J) + jnp.eye(len(J))
    s = jax.lax.while_loop(correcting, correct, judged(x, waited, none))
    status = jnp.where(s.left <= 1.0, solved, int(Status.NO_PERIOD))
    status = jnp.where(s.found.status == solved, status, s.found.status)
    stats = {"cycles": count + s.rounds, "corrections": s.rounds}
    return Solution(Orbit(s.found.states, monodromy), status, stats, s.left)


def cycle_settings(method: Method, period: Array | float, rtol: Array | float, atol: Array | float) -> Settings:
    """Settings of a cycle: at least a hundred steps, so that small disturbances are resolved also near rest."""
    return Settings(method, jnp.asarray(rtol), jnp.asarray(atol), on_device(100_000), longest=period / 100)


def _along_velocities(robot: Model, symmetry: Symmetry, x: State, J: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Derivative of the gap, which is in coordinates, along the velocities."""
    chart = jax.jacfwd(lambda y: between(robot, symmetry, x, near(robot, x, y)))(jnp.zeros(len(J)))
    return generalised_inverse(chart) @ J


def _solved(J: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Generalised inverse of DPhi - 1, with rounding errors set to 0."""
    return generalised_inverse(jnp.where(jnp.abs(J) > _NOTHING, J, 0.0))


@runs_long
def orbit(robot: Model, symmetry: Symmetry, guess: State, times: Float[Array, "n"], settings: Settings) -> Solution:
    """Periodic orbit from a guess, with status SOLVED, SETTLED (by free motion, not by Newton's method) or NO_PERIOD.

    `times` increase from 0 to the period. The residual is the root mean square of the gap between the ends of the
    cycle, over the tolerance. Works under jit and vmap.

    With a crank in `symmetry` the period is unknown, and `times` are fractions of it, as is the longest step of the
    settings. The status is NO_TURN where the crank does not turn. The period has derivatives too.

    The states have derivatives (forward mode only) with respect to the robot and to the period, at fixed fractions of
    the period. Along the symmetry the start is fixed. They are NaN if no orbit was found. They do not include the shift
    of a jump of a drive's acceleration to another fraction of the period.
    """
    return _orbit(robot, symmetry, guess, times, settings)


@eqx.filter_custom_jvp
def _orbit(robot: Model, symmetry: Symmetry, guess: State, times: Float[Array, "n"], settings: Settings) -> Solution:
    m, crank = ravel_pytree((guess.v, guess.v, guess.z))[0].shape[0], symmetry.crank
    hinge = np.arange(guess.v.shape[0]) == crank

    def started(s: _OrbitSearch) -> tuple[_OrbitSearch, Array]:
        """After free motion begin where a turn ends, with its period."""
        solved = jnp.asarray(int(Status.SOLVED))
        last = s.period
        if last is None:
            return s, solved
        free = ~jnp.isfinite(s.best) & ~s.closed

        def turned() -> tuple[State, Array, Array]:
            end, period, status = turn(robot, hinge, s.x, settings)
            back = jnp.where(hinge, robot.displacements(s.x.q) - robot.displacements(end.q), 0.0)
            q = robot.advance(end.q, back, jnp.ones(()))  # tolerances would grow with the angle
            return State(q, end.v, end.z), jnp.where(status == solved, period, last), status

        x, period, status = jax.lax.cond(free, turned, lambda: (s.x, last, solved))
        return s._replace(x=x, period=period), status

    def displaced(s: _OrbitSearch, y: Array) -> tuple[State, Array | None]:
        if crank is None or s.period is None:
            return near(robot, s.x, y), None
        return near(robot, s.x, y.at[crank].set(0.0)), s.period + y[crank]

    def derived(x: State, J: Array) -> tuple[Array, Array]:
        change = _along_velocities(robot, symmetry, x, J)
        return (change + jnp.eye(m) if crank is None else _return_map(change, crank)), _solved(J)

    def advance(s: _OrbitSearch) -> _OrbitSearch:
        s, turned = started(s)

        def gap(y: Array) -> tuple[Array, CycleAttempt]:
            x, period = displaced(s, y)
            found = cycle(robot, symmetry, x, *_scaled(times, settings, period), s.derive)
            return found.gap, found

        # one cycle with derivatives for both cases: its equations stand here once
        J, found = jax.jacfwd(gap, has_aux=True)(jnp.zeros(m))
        kept = s.monodromy, s.inverse
        monodromy, inverse = jax.lax.cond(s.derive, lambda: derived(s.x, J), lambda: kept)
        stalled = (jnp.isfinite(s.best) & (found.size >= 0.5 * s.best)) | (s.corrections >= _CORRECTIONS)
        closed = (found.size <= 1.0) | (stalled & (found.size <= _NOISE))
        first = s.cycles < _WAIT
        closer = (found.size < 0.5 * s.best) & (s.corrections < _CORRECTIONS) & ~first & ~closed
        step = -inverse @ found.gap
        corrected = displaced(s, step)
        newton = closer & jnp.all(jnp.isfinite(ravel_pytree(corrected)[0]))
        free = found.end, None
        if s.period is not None:
            found = found._replace(status=jnp.where(turned == int(Status.SOLVED), found.status, turned))
            newton &= jnp.abs(step[crank]) < 0.5 * s.period
            free = s.x, s.period  # a turn from there follows
        each = (s.x, s.period), corrected, free
        x, period = jax.tree.map(lambda a, b, c: jnp.where(closed, a, jnp.where(newton, b, c)), *each)
        bad = found.status != int(Status.SOLVED)
        corrections, cycles = s.corrections + newton, s.cycles + 1
        slow = ~newton | (jnp.isfinite(s.best) & (found.size > _QUICK * s.best))
        derive = closed | ((cycles >= _WAIT) & slow & (corrections < _CORRECTIONS))
        best = jnp.where(closed, s.best, jnp.where(newton, found.size, jnp.inf))
        waited = jnp.where(closed, s.waited, ~newton & ~first)
        done = (closed & s.derive) | bad | (~closed & (cycles >= _CYCLES))
        return _OrbitSearch(
            x, period, found, monodromy, inverse, derive, best, corrections, cycles, waited, closed, done
        )

    none, no, eye = jnp.zeros((), int), jnp.asarray(False), jnp.eye(m)
    period = None if crank is None else jnp.ones(())
    start = _OrbitSearch(
        guess, period, _before(guess, times), eye, 0 * eye, no, jnp.asarray(jnp.inf), none, none, no, no, no
    )
    s = jax.lax.while_loop(lambda s: ~s.done, advance, start)
    status = jnp.where(s.waited, int(Status.SETTLED), int(Status.SOLVED))
    status = jnp.where(s.closed, status, int(Status.NO_PERIOD))
    status = jnp.where(s.found.status == int(Status.SOLVED), status, s.found.status)
    stats = {"cycles": s.cycles, "corrections": s.corrections}
    return Solution(Orbit(s.found.states, s.monodromy, s.period), status, stats, s.found.size)


def _scaled(times: Float[Array, "n"], settings: Settings, period: Array | None) -> tuple[Float[Array, "n"], Settings]:
    """Times, and settings with the longest step, of an unknown period; the same of one that is known."""
    if period is None:
        return times, settings
    longest = settings.longest * jax.lax.stop_gradient(period)
    return times * period, eqx.tree_at(lambda s: s.longest, settings, longest)


def _return_map(change: Float[Array, "m m"], crank: int) -> Float[Array, "m m"]:
    """Derivative of the return to the same angle of the crank, from DPhi - 1 with the flow as the crank's column."""
    flow = change[:, crank]
    return change + jnp.eye(change.shape[0]) - jnp.outer(flow / flow[crank], change[crank])


@_orbit.def_jvp
def _orbit_derivatives(primals: tuple, tangents: tuple) -> tuple[Solution, Solution]:
    robot, symmetry, _, times, settings = primals
    found = _orbit(*primals)
    x = jax.tree.map(lambda x: x[0], found.value.states)
    unknown = symmetry.crank is not None
    d_period = jnp.zeros(()) if tangents[3] is None or unknown else tangents[3][-1]
    here = robot, symmetry, x, *_scaled(times, settings, found.value.period)
    derivatives = along(lambda here, *changes: cycle_sensitivities(*here, *changes), here, tangents[0], d_period)
    solved = (found.status == int(Status.SOLVED)) | (found.status == int(Status.SETTLED))
    change = jax.tree.map(lambda x: jnp.where(solved, x, jnp.nan), derivatives)
    unchanged = jax.tree.map(lambda _: None, found)
    where = lambda s: (s.value.states, *([s.value.period] if unknown else []))  # noqa: E731
    return found, eqx.tree_at(where, unchanged, change, is_leaf=lambda x: x is None)


def cycle_sensitivities(
    robot: Model,
    symmetry: Symmetry,
    x: State,
    times: Float[Array, "n"],
    settings: Settings,
    d_robot: Any,
    d_period: Float[Array, "k"],
) -> tuple[State] | tuple[State, Float[Array, "k"]]:
    """Derivatives of the states of the orbit through x, leaves [k, n, ...], at fixed fractions of the period.

    With a crank, those of the period [k] follow. It is the unknown then in place of the crank's angle.

    `d_robot`: k derivatives of the robot's numbers, leaves [k, ...] or None. The integration has one sensitivity for
    each displacement of the start, and one for each of these changes.
    """
    m, k = ravel_pytree((x.v, x.v, x.z))[0].shape[0], d_period.shape[0]
    starts = jax.vmap(lambda y: jax.jvp(lambda y: near(robot, x, y), (jnp.zeros(m),), (y,))[1])(jnp.eye(m + k, m))
    changes, stretch = jax.tree.map(lambda d: jnp.pad(d, [(m, 0), *[(0, 0)] * (d.ndim - 1)]), (d_robot, d_period))
    if symmetry.crank is not None:
        starts = jax.tree.map(lambda d: d.at[symmetry.crank].set(0.0), starts)
        stretch = stretch.at[symmetry.crank].set(1.0)
    start = begin(jnp.zeros(()), SensitivityState(x, starts), settings, jnp.asarray(_FIRST_STEP))
    _, later = integrate(SensitivitySystem(robot, changes, stretch / times[-1]), start, times[1:], settings)
    end = jax.tree.map(lambda x: x[-1], later)

    def gap_derivative(change: Any, start: State, end_change: State) -> Array:
        here = robot, x, end.x
        return eqx.filter_jvp(lambda r, a, b: between(r, symmetry, a, b), here, (change, start, end_change))[1]

    gaps = jax.vmap(gap_derivative)(changes, starts, end.derivatives)
    weights = jnp.concatenate([-gaps[m:] @ _solved(gaps[:m].T).T, jnp.eye(k)], axis=1)
    every = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), starts, later.derivatives)
    states = jax.tree.map(lambda s: jnp.einsum("kp,np...->kn...", weights, s), every)
    return (states,) if symmetry.crank is None else (states, weights[:, symmetry.crank])
