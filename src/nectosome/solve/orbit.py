r"""Periodic orbits by shooting, modulo the symmetry of the equations.

The unknown is a state x at the start of a cycle that returns to itself after a period T, modulo the symmetry: position
and heading of a swimmer may drift. With the flow $\Phi_T$ and displacements y of the state,

$$ F(y) = \Phi_T(x \oplus y) \ominus (x \oplus y) = 0, \quad y = -(D\Phi_T - 1)^{-1} F $$

by Newton's method. First corrections go by cycles at loose tolerances. $D\Phi_T$ is that of differences: states close
to x are taken along in the steps of a cycle, by the Jacobians of its stages (internal differentiation, Bock 1983), so
that nothing is derived. All of them together cost some four cycles. The inverse is kept, and updated by each correction
(Broyden 1965), while corrections shrink quickly. If one does not, a cycle of free motion follows instead, as in the
first cycles.

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
from jaxtyping import Array, Float, Int

from nectosome.core import Solution, State, Status
from nectosome.core.linear_algebra import generalised_inverse
from nectosome.core.programs.remember import runs_long
from nectosome.core.rows import on_device
from nectosome.core.shared_derivatives import along

from .cycle_attempt import FIRST_STEP, CycleAttempt, along_velocities, before_any, between, cycle, pseudo_inverse
from .integrate import Method, Settings, begin, integrate
from .runge_kutta import rms
from .sensitivity import SensitivityState, SensitivitySystem
from .symmetry import Model, Symmetry, near
from .turns import turn

_WAIT, _CYCLES = 2, 60  # cycles before Newton's method, and in total
_BUDGET = 20.0  # [cycles at the last tolerance] that all of them may cost
_CORRECTIONS, _DERIVATIVES = 12, 6
_QUICK = 0.3  # ratio of successive corrections up to which the derivative is kept
_NOISE = 20.0  # [tolerance of a step] accepted gap where corrections do not reduce it, an error of hundreds of steps
_SETTLE, _POLISH = 8, 4  # most cycles of free motion, and of Newton's method after them, side by side
_CLOSE = 1e-6  # distance of states beside one, over the largest numbers of a cycle
_NOTHING = 1e-9  # elements of the gap's exact derivative below this are rounding errors


class _Level(NamedTuple):
    """How exactly a cycle is integrated: factor of the tolerances, at most `loosest`, and of its longest steps."""

    factor: float
    loosest: float
    longer: float
    cost: float  # [cycles at the last tolerance]


_LEVELS = _Level(1e3, 1e-3, 4.0, 0.25), _Level(1e2, 1e-4, 2.0, 0.4), _Level(1.0, 1.0, 1.0, 1.0)
_LOOSE, _MIDDLE, _TIGHT = range(3)
_ENOUGH = 0.1, 3.0, 1.0  # [tolerance of a step at each level] gap and correction up to which there is the next one
_SAME = 1e-4  # of the largest numbers of a cycle: correction after which multipliers are those of before
_FEW = 8  # displacements, up to which multipliers are those of a cycle at the last tolerance


class Orbit(NamedTuple):
    """A periodic motion."""

    states: State  # at the given times, leaves [n, ...]; the first is the start of the cycle
    monodromy: Float[Array, "m m"]  # derivative of the state after a cycle by the state before, in displacements
    period: Float[Array, ""] | None = None  # [s], where it was unknown; the crank has no derivatives in monodromy then


class _OrbitSearch(NamedTuple):
    x: State
    period: Array | None  # [s], where it is unknown
    found: CycleAttempt  # from there, or from before
    scale: Array  # largest numbers of the cycle
    derivative: Array  # DPhi - 1 of scaled displacements
    inverse: Array
    step: Array  # to x, scaled
    gap: Array  # before that
    newton: Array  # that was a correction at this level
    best: Array  # size of a correction, which the next must halve; inf after a cycle of free motion
    level: Array  # among the levels
    derive: Array  # in the next cycle
    corrections: Array
    derivatives: Array
    cycles: Array
    cost: Array  # [cycles at the last tolerance]
    waited: Array  # the last step was a cycle of free motion
    closed: Array
    done: Array
    left: Array  # the larger of gap and correction over the tolerance
    sharp: Array  # the derivative is one of the middle level, or of the last
    moved: Array  # since the derivative, scaled


class _Correction(NamedTuple):
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

    def judged(x: State, found: CycleAttempt, rounds: Array) -> _Correction:
        step = -inverse @ found.gap
        return _Correction(x, step, found, jnp.maximum(found.size, rms(step / found.allowed)), rounds)

    def correct(s: _Correction) -> _Correction:
        x = near(robot, s.x, s.step)
        return judged(x, cycle(robot, symmetry, x, times, settings), s.rounds + 1)

    def correcting(s: _Correction) -> Array:
        return ~(s.left <= 1.0) & jnp.isfinite(rms(s.step)) & (s.found.status == solved) & (s.rounds < _POLISH)

    solved, none, far = int(Status.SOLVED), jnp.zeros((), int), jnp.asarray(jnp.inf)
    waited, _, count = jax.lax.while_loop(going, more, (before_any(guess, times), far, none))
    x = jax.tree.map(lambda x: x[0], waited.states)
    loose = _at(settings, jnp.zeros((), int))
    J = jax.jacfwd(gap)(jnp.zeros(waited.gap.size))
    inverse, monodromy = _solved(J), along_velocities(robot, symmetry, x) @ J + jnp.eye(len(J))
    s = jax.lax.while_loop(correcting, correct, judged(x, waited, none))
    status = jnp.where(s.left <= 1.0, solved, int(Status.NO_PERIOD))
    status = jnp.where(s.found.status == solved, status, s.found.status)
    stats = {"cycles": count + s.rounds, "corrections": s.rounds}
    return Solution(Orbit(s.found.states, monodromy), status, stats, s.left)


def cycle_settings(method: Method, period: Array | float, rtol: Array | float, atol: Array | float) -> Settings:
    """Settings of a cycle: at least a hundred steps, so that small disturbances are resolved also near rest."""
    return Settings(method, jnp.asarray(rtol), jnp.asarray(atol), on_device(100_000), longest=period / 100)


def _at(settings: Settings, level: Array) -> Settings:
    """Settings at a level."""
    factor, loosest, longer, _ = jnp.array(_LEVELS)[level]
    more = jnp.clip(loosest / settings.rtol, 1.0, factor)
    looser = settings.rtol * more, settings.atol * more, settings.longest * longer
    return eqx.tree_at(lambda s: (s.rtol, s.atol, s.longest), settings, looser)


def _solved(J: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Generalised inverse of DPhi - 1, with rounding errors set to 0."""
    return generalised_inverse(jnp.where(jnp.abs(J) > _NOTHING, J, 0.0))


@runs_long
def orbit(
    robot: Model,
    symmetry: Symmetry,
    guess: State,
    times: Float[Array, "n"],
    settings: Settings,
    multipliers: Int[Array, ""] | int = 0,
) -> Solution:
    """Periodic orbit from a guess, with status SOLVED, SETTLED (by free motion, not by Newton's method) or NO_PERIOD.

    `times` increase from 0 to the period. The residual is the root mean square over the tolerance of the gap between
    the ends of the cycle, or of the correction that would close it, whichever is larger. For `multipliers` the
    monodromy is that of a cycle at a hundred times the tolerance (1), or at the last one (2). Works under jit and vmap.

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
    m, crank, solved = ravel_pytree((guess.v, guess.v, guess.z))[0].shape[0], symmetry.crank, int(Status.SOLVED)
    drift = np.isin(np.arange(m), [*symmetry.drift, *([] if crank is None else [crank])])
    free = np.flatnonzero(~drift)  # displacements that a cycle depends on; with a spin, all three rotations
    last = jnp.where((free.size <= _FEW) | (jnp.asarray(multipliers) > 1), _TIGHT, _MIDDLE)

    def displaced(x: State, period: Array | None, y: Array) -> tuple[State, Array | None]:
        if crank is None or period is None:
            return near(robot, x, y), None
        return near(robot, x, y.at[crank].set(0.0)), period + y[crank]

    def returned(flow: Array, gap: Array) -> Array:
        """Gap of the return to the same angle of the crank, and by how much the period differs."""
        if crank is None:
            return gap
        late = gap[crank] / flow[crank]
        return (gap - late * flow).at[crank].set(-late)

    def derivative(scale: Array, gap: Array, gaps: Array) -> Array:
        """Of the gap, both scaled, by differences."""
        J = jnp.zeros((m, m)).at[:, free].set((gaps - gap).T / scale[:, None] / _CLOSE)
        return J if crank is None else J.at[crank, crank].set(-1.0)

    def advance(s: _OrbitSearch) -> _OrbitSearch:
        here, first, tight = _at(settings, s.level), s.cycles < _WAIT, s.level == _TIGHT
        beside = jax.vmap(lambda y: near(robot, s.x, y))(_CLOSE * s.scale * np.eye(m)[free])
        found = cycle(robot, symmetry, s.x, *_scaled(times, here, s.period), beside, s.derive)
        gaps = found.gaps
        assert gaps is not None
        into, back = along_velocities(robot, symmetry, s.x), partial(returned, found.flow)
        gap = back(into @ found.gap)
        J = jax.lax.cond(
            s.derive, lambda: derivative(s.scale, gap, jax.vmap(back)(gaps @ into.T)), lambda: s.derivative
        )
        gap = gap / s.scale
        inverse = jax.lax.cond(
            s.derive,
            lambda: pseudo_inverse(J),
            lambda: _updated(s.inverse, jnp.where(s.newton, s.step, 0.0), gap - s.gap),
        )
        step = -inverse @ gap
        moves = step * s.scale if crank is None else (step * s.scale).at[crank].multiply(found.flow[crank])
        left = jnp.maximum(found.size, rms(moves / found.allowed))
        left = jnp.where(first, jnp.inf, left)
        stalled = (jnp.isfinite(s.best) & ~(left < 0.5 * s.best)) | (s.corrections >= _CORRECTIONS)
        sharp = jnp.where(s.derive, s.level > _LOOSE, s.sharp)
        near_enough = (left <= jnp.array(_ENOUGH)[s.level]) | (stalled & (left <= _NOISE))
        near_enough &= sharp | (s.level != _MIDDLE)
        closed, up = near_enough & tight, near_enough & ~tight
        corrected = displaced(s.x, s.period, step * s.scale)
        newton = (up | ~stalled) & ~first & ~closed & jnp.all(jnp.isfinite(ravel_pytree(corrected)[0]))
        if s.period is not None:
            newton &= jnp.abs(step[crank] * s.scale[crank]) < 0.5 * s.period
        waits = (found.end, None) if crank is None else displaced(s.x, s.period, gap * s.scale)
        x, period = jax.tree.map(
            lambda a, b, c: jnp.where(closed, a, jnp.where(newton, b, c)), (s.x, s.period), corrected, waits
        )
        cost = s.cost + jnp.array(_LEVELS)[s.level, -1] * jnp.where(s.derive, 5.0, 1.0)
        quick = newton & (up | ~jnp.isfinite(s.best) | (left <= _QUICK * s.best))
        blunt = (s.level == _MIDDLE) & ~sharp
        derive = (s.cycles + 1 >= _WAIT) & (~quick | blunt) & (s.derivatives < _DERIVATIVES)
        moved = jnp.where(s.derive, 0.0, s.moved)
        known = sharp & (moved <= _SAME) & (last != _TIGHT)
        derive = jnp.where(closed, (jnp.asarray(multipliers) > 0) & ~known, derive)
        bad = found.status != solved
        new = _OrbitSearch(
            x=x,
            period=period,
            found=found,
            scale=jnp.where((s.derivatives > 0) | s.derive, s.scale, found.allowed / here.rtol),
            derivative=J,
            inverse=inverse,
            step=step,
            gap=gap,
            newton=newton & ~up,
            best=jnp.where(newton & ~up, left, jnp.inf),
            level=jnp.where(closed, last, s.level + up),
            derive=derive,
            corrections=jnp.where(up, 0, s.corrections + newton),
            derivatives=s.derivatives + s.derive,
            cycles=s.cycles + 1,
            cost=cost,
            waited=jnp.where(closed, s.waited, ~newton & ~first),
            closed=closed,
            done=bad | (closed & ~derive) | (~closed & ((s.cycles + 1 >= _CYCLES) | (cost >= _BUDGET))),
            left=left,
            sharp=sharp,
            moved=moved + jnp.where(newton, rms(step), jnp.where(closed, 0.0, jnp.inf)),
        )
        final = s._replace(derivative=J, done=jnp.asarray(True))
        final = final._replace(found=s.found._replace(status=found.status))
        return jax.tree.map(lambda a, b: jnp.where(s.closed, a, b), final, new)

    period, status = None, jnp.asarray(solved)
    x = guess
    if crank is not None:
        x, period, status = _turned(robot, symmetry, guess, settings)
    none, no, far, zero = jnp.zeros((), int), jnp.asarray(False), jnp.asarray(jnp.inf), jnp.zeros(m)
    start = _OrbitSearch(
        x=x,
        period=period,
        found=before_any(x, times, free.size),
        scale=jnp.ones(m),
        **dict.fromkeys(("derivative", "inverse"), jnp.zeros((m, m))),
        **dict.fromkeys(("step", "gap"), zero),
        **dict.fromkeys(("best", "left", "moved"), far),
        **dict.fromkeys(("level", "corrections", "derivatives", "cycles"), none),
        **dict.fromkeys(("newton", "derive", "waited", "closed", "sharp"), no),
        cost=jnp.zeros(()),
        done=status != solved,
    )
    s = jax.lax.while_loop(lambda s: ~s.done, advance, start)
    status = jnp.where(status == solved, s.found.status, status)
    reached = jnp.where(s.closed, jnp.where(s.waited, int(Status.SETTLED), solved), int(Status.NO_PERIOD))
    monodromy = s.derivative * s.scale[:, None] / s.scale + jnp.eye(m)
    stats = {"cycles": s.cycles, "corrections": s.corrections}
    found = Orbit(s.found.states, monodromy, s.period)
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

    return jax.lax.fori_loop(0, _WAIT, once, (x, jnp.ones(()), solved))


def _updated(inverse: Float[Array, "m m"], step: Float[Array, "m"], change: Float[Array, "m"]) -> Float[Array, "m m"]:
    """Inverse of a derivative with a change of the function after a step (Broyden 1965); the same without a step."""
    moved = inverse @ change
    share = step @ moved
    solid = jnp.abs(share) > 1e-12 * (step @ step)
    return inverse + jnp.where(solid, jnp.outer(step - moved, step @ inverse) / jnp.where(solid, share, 1.0), 0.0)


def _scaled(times: Float[Array, "n"], settings: Settings, period: Array | None) -> tuple[Float[Array, "n"], Settings]:
    """Times, and settings with the longest step, of an unknown period; the same of one that is known."""
    if period is None:
        return times, settings
    longest = settings.longest * jax.lax.stop_gradient(period)
    return times * period, eqx.tree_at(lambda s: s.longest, settings, longest)


@_orbit.def_jvp
def _orbit_derivatives(primals: tuple, tangents: tuple) -> tuple[Solution, Solution]:
    robot, symmetry, _, times, settings, _ = primals
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
    start = begin(jnp.zeros(()), SensitivityState(x, starts), settings, jnp.asarray(FIRST_STEP))
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
