r"""Periodic orbits by shooting, modulo the symmetry of the equations; those that free motion leads to.

The unknown is a state x at the start of a cycle that returns to itself after a period T, modulo the symmetry: position
and heading of a swimmer may drift. With the flow $\Phi_T$ and displacements y of the state,

$$ F(y) = \Phi_T(x \oplus y) \ominus (x \oplus y) = 0, \quad y = -(D\Phi_T - 1)^{-1} F $$

by Newton's method without derivatives (see `orbit_search`).

The orbit's derivatives follow from the implicit function theorem, $dy = -(D\Phi_T - 1)^{-1} dF$, with one integration
of the cycle and its sensitivities to y and to the changed parameters, under error control of both.

Of a robot without a clock the period is unknown (see `turns`). It takes the place of the crank's angle k among y. With
the flow f at the end, the gap of the return to the same angle, and by how much the period differs, are

$$ F_i - \frac{f_i}{f_k} F_k, \quad -\frac{F_k}{f_k} $$
"""

from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from nectosome.core import Solution, State, Status
from nectosome.core.programs.remember import runs_long
from nectosome.core.rows import on_device
from nectosome.core.shared_derivatives import along

from .cycle_attempt import FIRST_STEP, CycleAttempt, along_velocities, before_any, between, cycle, gap_inverse
from .integrate import Method, Settings, begin, integrate
from .orbit_search import LOOSE, WAIT, OrbitSearch, residual_limit, scaled, settings_at
from .runge_kutta import rms
from .sensitivity import SensitivityState, SensitivitySystem
from .symmetry import Model, Symmetry, near
from .turns import turn

_SETTLE, _POLISH = 8, 4  # most cycles of free motion, and of Newton's method after them


class Orbit(NamedTuple):
    """A periodic motion."""

    states: State  # at the given times, leaves [n, ...]; the first is the start of the cycle
    monodromy: Float[Array, "m m"]  # derivative of the state after a cycle by the state before, in displacements
    errors: Float[Array, "m m"]  # of the monodromy
    period: Float[Array, ""] | None = None  # [s], where it was unknown; the crank has no derivatives in monodromy then


def cycle_settings(method: Method, period: Array | float, rtol: Array | float, atol: Array | float) -> Settings:
    """Settings of a cycle: at least a hundred steps, so that small disturbances are resolved also near rest."""
    return Settings(method, jnp.asarray(rtol), jnp.asarray(atol), on_device(100_000), longest=period / 100)


@runs_long
def orbit(
    robot: Model,
    symmetry: Symmetry,
    guess: State,
    times: Float[Array, "n"],
    settings: Settings,
    multipliers: Bool[Array, ""] | bool = False,
) -> Solution:
    """Periodic orbit from a guess, with status SOLVED, SETTLED (by free motion, not by Newton's method) or NO_PERIOD.

    `times` increase from 0 to the period. The residual is the root mean square over the tolerance of the gap between
    the ends of the cycle, or of the correction that would close it, whichever is larger: at most 1, or `residual_limit`
    among the stats where the steps let them come no closer. The monodromy and its errors are those of a cycle at this
    tolerance for `multipliers`, else as good as the search needed it. Works under jit and vmap.

    With a crank in `symmetry` the period is unknown, and `times` are fractions of it, as is the longest step of the
    settings. The status is NO_TURN where the crank does not turn. The period has derivatives too.

    The states have derivatives (forward mode only) with respect to the robot and to the period, at fixed fractions of
    the period. Along the symmetry the start is fixed. They are NaN if no orbit was found. They do not include the shift
    of a jump of a drive's acceleration to another fraction of the period.
    """
    return _orbit(robot, symmetry, guess, times, settings, multipliers)


@eqx.filter_custom_jvp
def _orbit(
    robot: Model, symmetry: Symmetry, guess: State, times: Float[Array, "n"], settings: Settings, multipliers: Any
) -> Solution:
    solved, period, x = int(Status.SOLVED), None, guess
    status = jnp.asarray(solved)
    if symmetry.crank is not None:
        x, period, status = _turned(robot, symmetry, guess, settings)
    search = OrbitSearch(robot, symmetry, guess, times, settings, multipliers)
    s = jax.lax.while_loop(lambda s: ~s.done, search.advance, search.start(x, period, status == solved))
    status = jnp.where(status == solved, s.found.status, status)
    reached = jnp.where(s.closed, jnp.where(s.waited, int(Status.SETTLED), solved), int(Status.NO_PERIOD))
    limit = residual_limit(s.found.steps)
    stats = {"cycles": s.cycles, "corrections": s.corrections, "residual_limit": limit}
    found = Orbit(s.found.states, search.monodromy(s), search.errors(s), s.period)
    return Solution(found, jnp.where(status == solved, reached, status), stats, s.left)


def _turned(robot: Model, symmetry: Symmetry, x: State, settings: Settings) -> tuple[State, Float[Array, ""], Array]:
    """State after two turns of the crank, at the angle of x, with the period of the second, and the status."""
    hinge, solved = np.arange(x.v.shape[0]) == symmetry.crank, jnp.asarray(int(Status.SOLVED))

    def once(_: Any, before: tuple[State, Array, Array]) -> tuple[State, Array, Array]:
        end, period, status = turn(robot, hinge, before[0], settings)
        back = jnp.where(hinge, robot.displacements(x.q) - robot.displacements(end.q), 0.0)
        q = robot.advance(end.q, back, jnp.ones(()))  # tolerances would grow with the angle
        done = State(q, end.v, end.z), period, status
        return jax.tree.map(partial(jnp.where, before[2] == int(Status.SOLVED)), done, before)

    return jax.lax.fori_loop(0, WAIT, once, (x, jnp.ones(()), solved))


@_orbit.def_jvp
def _orbit_derivatives(primals: tuple, tangents: tuple) -> tuple[Solution, Solution]:
    robot, symmetry, _, times, settings, _ = primals
    found = _orbit(*primals)
    x = jax.tree.map(lambda x: x[0], found.value.states)
    unknown = symmetry.crank is not None
    d_period = jnp.zeros(()) if tangents[3] is None or unknown else tangents[3][-1]
    here = robot, symmetry, x, *scaled(times, settings, found.value.period)
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
    start = begin(jnp.zeros(()), SensitivityState(x, starts), settings, jnp.asarray(FIRST_STEP))
    _, later = integrate(SensitivitySystem(robot, changes, stretch / times[-1]), start, times[1:], settings)
    end = jax.tree.map(lambda x: x[-1], later)

    def gap_derivative(change: Any, start: State, end_change: State) -> Array:
        here = robot, x, end.x
        return eqx.filter_jvp(lambda r, a, b: between(r, symmetry, a, b), here, (change, start, end_change))[1]

    gaps = jax.vmap(gap_derivative)(changes, starts, end.derivatives)
    weights = jnp.concatenate([-gaps[m:] @ gap_inverse(gaps[:m].T).T, jnp.eye(k)], axis=1)
    every = jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), starts, later.derivatives)
    states = jax.tree.map(lambda s: jnp.einsum("kp,np...->kn...", weights, s), every)
    return (states,) if symmetry.crank is None else (states, weights[:, symmetry.crank])


class _Polish(NamedTuple):
    """Newton's method after free motion."""

    x: State
    step: Array  # from x to what it corrects
    found: CycleAttempt  # from x
    left: Array  # the larger of gap and step over the tolerance
    rounds: Array


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

    def judged(x: State, found: CycleAttempt, rounds: Array) -> _Polish:
        step = -inverse @ found.gap
        return _Polish(x, step, found, jnp.maximum(found.size, rms(step / found.allowed)), rounds)

    def correct(s: _Polish) -> _Polish:
        x = near(robot, s.x, s.step)
        return judged(x, cycle(robot, symmetry, x, times, settings), s.rounds + 1)

    def correcting(s: _Polish) -> Array:
        return ~(s.left <= 1.0) & jnp.isfinite(rms(s.step)) & (s.found.status == solved) & (s.rounds < _POLISH)

    solved, none, far = int(Status.SOLVED), jnp.zeros((), int), jnp.asarray(jnp.inf)
    waited, _, count = jax.lax.while_loop(going, more, (before_any(guess, times), far, none))
    x = jax.tree.map(lambda x: x[0], waited.states)
    loose = settings_at(settings, LOOSE)
    J = jax.jacfwd(gap)(jnp.zeros(waited.gap.size))
    inverse, monodromy = gap_inverse(J), along_velocities(robot, symmetry, x) @ J + jnp.eye(len(J))
    s = jax.lax.while_loop(correcting, correct, judged(x, waited, none))
    status = jnp.where(s.left <= 1.0, solved, int(Status.NO_PERIOD))
    status = jnp.where(s.found.status == solved, status, s.found.status)
    stats = {"cycles": count + s.rounds, "corrections": s.rounds}
    return Solution(Orbit(s.found.states, monodromy, jnp.full_like(monodromy, jnp.nan)), status, stats, s.left)
