"""Search for the state that a cycle returns to: by Newton's method without derivatives, and by free motion.

First corrections go by cycles at loose tolerances. The derivative of the gap is that of differences: states close to
the start are taken along in the steps of a cycle, by the Jacobians of its stages (internal differentiation, Bock 1983).
All of them together cost some four cycles. The inverse is kept, and updated by each correction (Broyden 1965), while
corrections shrink quickly. If one does not, a cycle of free motion follows instead, as in the first cycles. A
correction by a new derivative is not compared with those by the one before.

Where hard contacts and stops amplify the errors of steps, corrections no longer shrink although the motion repeats
itself. A cycle counts as the orbit there up to `residual_limit`, if nothing of its gap is beyond any correction, as a
drift is.
"""

from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from nectosome.core import State, Status

from .cycle_attempt import CycleAttempt, along_velocities, before_any, cycle, pseudo_inverse
from .integrate import Settings
from .runge_kutta import rms
from .symmetry import Model, Symmetry, near

WAIT = 2  # cycles before Newton's method
_CYCLES = 60  # in total
_BUDGET, _FIRST = 26.0, 16.0  # [cycles at the last tolerance] that all of them may cost, and those of the first level
_CORRECTIONS, _DERIVATIVES = 12, 12
_QUICK = 0.3  # ratio of successive corrections up to which the derivative is kept
_USUAL = 5.0  # [cycles] most that a derivative costs but with many unknowns
_NOISE = 0.25  # [tolerance of a step] for each step of a cycle, accepted gap where corrections do not shrink
_MOST = 100.0  # [tolerance of a step] the same of any cycle
_DIFFERENCES = 0.1  # [distance of states beside] error of differences over the largest number in the same direction
_ROUNDING = 1e-9  # of a scaled derivative by differences
_EPSILON = 2e-16  # [rad, m, rad/s, m/s] rounding of motions, also where they are small beside other numbers
_SHARE = 0.1  # error of a derivative over what changed since the level before, at most
_APART = 9.0  # factor between the tolerances of levels that are compared, at least


class _Level(NamedTuple):
    """How exactly a cycle is integrated: factor of the tolerances, up to `loosest`, and of its longest steps."""

    factor: float
    loosest: float
    longer: float
    cost: float  # [cycles at the last tolerance]
    close: float  # distance of states beside one, over the largest numbers of a cycle


_LEVELS = (
    _Level(1e3, 1e-3, 4.0, 0.25, 1e-5),
    _Level(1e2, 1e-4, 2.0, 0.4, 1e-5),
    _Level(1.0, 1.0, 1.0, 1.0, 1e-6),
)
_LOOSER = 10.0  # factor of the tolerances of all levels but the last, at least
LOOSE, _MIDDLE, _TIGHT = range(3)
_ENOUGH = 0.1, 3.0, 1.0  # [tolerance of a step at each level] gap and correction up to which there is the next one
_SAME = 1e-5  # of the largest numbers of a cycle: correction after which the derivative is that of before


class SearchState(NamedTuple):
    """Where a search stands."""

    x: State
    period: Array | None  # [s], where it is unknown
    found: CycleAttempt  # from there, or from before
    scale: Array  # largest numbers of the cycle
    derivative: Array  # DPhi - 1 of scaled displacements
    inverse: Array
    within: Array  # projection on the gaps that corrections change
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
    derived: Array  # level of the derivative; -1: none
    coarse: Array  # derivative at the level before the last
    moved: Array  # since the derivative, scaled


class _Correction(NamedTuple):
    """A cycle from a state, and the correction that would close it."""

    found: CycleAttempt
    gap: Array  # scaled
    derivative: Array
    inverse: Array
    within: Array  # projection on the gaps that corrections change
    step: Array  # scaled
    left: Array  # the larger of gap and correction over the tolerance
    beyond: Array  # what no correction changes of the gap, over the tolerance


class _Verdict(NamedTuple):
    """What a cycle is good for."""

    stalled: Array  # the correction is no smaller than the last one allows
    derived: Array  # level of the derivative
    closed: Array  # the cycle counts as the orbit
    up: Array  # the next cycle is one of the next level
    back: Array  # the orbit is the cycle before, which this one should have corrected


class _Next(NamedTuple):
    """Where the next cycle starts."""

    x: State
    period: Array | None
    newton: Array  # by a correction


class OrbitSearch:
    """A search for a periodic orbit of a robot; `times` and `settings` are those of `orbit`."""

    def __init__(
        self, robot: Model, symmetry: Symmetry, x: State, times: Array, settings: Settings, multipliers: Any
    ) -> None:
        m = ravel_pytree((x.v, x.v, x.z))[0].size
        self._robot, self._symmetry, self._times, self._settings = robot, symmetry, times, settings
        self._crank, self._m, self._multipliers = symmetry.crank, m, jnp.asarray(multipliers)
        self._motions = 2 * x.v.size  # displacements and velocities; load states follow
        drift = np.isin(np.arange(m), [*symmetry.drift, *([] if self._crank is None else [self._crank])])
        self._free = np.flatnonzero(~drift)  # displacements that a cycle depends on; with a spin, all three rotations
        # [cycles of its level], by those of a fish, a manta and a turtle; 3.4 of a krill, as load states cost little
        self._derivative_costs = 3.5 + (x.v.size + np.sum(self._free < self._motions)) / 35

    def start(self, x: State, period: Array | None, possible: Array) -> SearchState:
        """A search from a state, and a period where it is unknown; it ends there if it is not `possible`."""
        m, none, no, far = self._m, jnp.zeros((), int), jnp.asarray(False), jnp.asarray(jnp.inf)
        return SearchState(
            x=x,
            period=period,
            found=before_any(x, self._times, self._free.size),
            scale=jnp.ones(m),
            **dict.fromkeys(("derivative", "coarse", "inverse", "within"), jnp.zeros((m, m))),
            **dict.fromkeys(("step", "gap"), jnp.zeros(m)),
            **dict.fromkeys(("best", "left", "moved"), far),
            **dict.fromkeys(("level", "corrections", "derivatives", "cycles"), none),
            **dict.fromkeys(("newton", "derive", "waited", "closed"), no),
            derived=none - 1,
            cost=jnp.zeros(()),
            done=~possible,
        )

    def advance(self, s: SearchState) -> SearchState:
        """One cycle; after the one that is the orbit, one for its derivative only."""
        c = self._correction(s)
        v = self._verdict(s, c)
        new = self._followed(s, c, v, self._next(s, c, v))
        final = s._replace(derivative=c.derivative, coarse=new.coarse, derived=s.level, moved=jnp.zeros(()))
        final = final._replace(found=s.found._replace(status=c.found.status), done=jnp.asarray(True))
        return jax.tree.map(lambda a, b: jnp.where(s.closed, a, b), final, new)

    def monodromy(self, s: SearchState) -> Float[Array, "m m"]:
        """Derivative of the state after a cycle by the state before, in displacements."""
        return s.derivative * s.scale[:, None] / s.scale + jnp.eye(self._m)

    def errors(self, s: SearchState) -> Float[Array, "m m"]:
        """Error of each number of the monodromy, from its derivative and one at the level before; else not finite.

        From the one to the other tolerances become ten times smaller at least, the longest step, of a method of order
        4, half as long. So what is left is at most a tenth of what changed. With the state a derivative changes by no
        more than its share: so it does by the moves of the state since, and by the correction that is left.
        """
        known = np.isin(np.arange(self._m), self._free)
        columns = jnp.max(jnp.abs(s.derivative + jnp.eye(self._m)), axis=0, initial=0.0)
        share = _DIFFERENCES * _of(s.derived).close + jnp.max(jnp.abs(s.step), initial=0.0) + self._m**0.5 * s.moved
        small = _EPSILON / (_of(s.derived).close * s.scale)
        rounding = jnp.where(np.arange(self._m) < self._motions, jnp.maximum(_ROUNDING, small), _ROUNDING)
        errors = _SHARE * jnp.abs(s.derivative - s.coarse)
        errors += jnp.where(known, share * columns + rounding[:, None], 0.0)
        looser, here = (settings_at(self._settings, level).rtol for level in (LOOSE, _MIDDLE))
        compared = (s.derived == _TIGHT) | ((s.derived == _MIDDLE) & (looser > _APART * here))
        return jnp.where(compared, errors * s.scale[:, None] / s.scale, jnp.inf)

    def _correction(self, s: SearchState) -> _Correction:
        """A cycle from here, the derivative or an update of its inverse, and the correction."""
        close = _of(s.level).close
        beside = jax.vmap(lambda y: near(self._robot, s.x, y))(close * s.scale * np.eye(self._m)[self._free])
        here = settings_at(self._settings, s.level)
        found = cycle(self._robot, self._symmetry, s.x, *scaled(self._times, here, s.period), beside, s.derive)
        gaps = found.gaps
        assert gaps is not None
        into, back = along_velocities(self._robot, self._symmetry, s.x), partial(self._returned, found.flow)
        gap = back(into @ found.gap)
        J = jax.lax.cond(
            s.derive,
            lambda: self._derivative(s.scale, (jax.vmap(back)(gaps @ into.T) - gap) / close),
            lambda: s.derivative,
        )
        gap = gap / s.scale

        def anew() -> tuple[Array, Array]:
            inverse = pseudo_inverse(J)
            return inverse, J @ inverse

        def kept() -> tuple[Array, Array]:
            return _updated(s.inverse, jnp.where(s.newton, s.step, 0.0), gap - s.gap), s.within

        inverse, within = jax.lax.cond(s.derive, anew, kept)
        step = -inverse @ gap
        moves = step * s.scale
        moves = moves if self._crank is None else moves.at[self._crank].multiply(found.flow[self._crank])
        left = jnp.where(s.cycles < WAIT, jnp.inf, jnp.maximum(found.size, rms(moves / found.allowed)))
        beyond = rms((gap - within @ gap) * s.scale / found.allowed)
        return _Correction(found, gap, J, inverse, within, step, left, beyond)

    def _returned(self, flow: Array, gap: Array) -> Array:
        """Gap of the return to the same angle of the crank, and by how much the period differs."""
        if self._crank is None:
            return gap
        late = gap[self._crank] / flow[self._crank]
        closing = jnp.zeros_like(flow).at[self._free].set(flow[self._free])  # where it drifts there is no gap to close
        return (gap - late * closing).at[self._crank].set(-late)

    def _derivative(self, scale: Array, changes: Array) -> Array:
        """Of the gap, both scaled, by its changes with the scaled displacements."""
        m, crank = self._m, self._crank
        J = jnp.zeros((m, m)).at[:, self._free].set(changes.T / scale[:, None])
        return J if crank is None else J.at[crank, crank].set(-1.0)

    def _verdict(self, s: SearchState, c: _Correction) -> _Verdict:
        """Whether a cycle is near enough to the orbit for its level, or as near as noise lets it come."""
        stalled = (jnp.isfinite(s.best) & ~(c.left < 0.5 * s.best)) | (s.corrections >= _CORRECTIONS)
        derived = jnp.where(s.derive, s.level, s.derived)
        least = jnp.minimum(c.left, s.best) if s.period is None else c.left
        noise = stalled & (least <= residual_limit(c.found.steps)) & (c.beyond <= 1.0)
        near_enough = (c.left <= jnp.array(_ENOUGH)[s.level]) | noise
        near_enough &= (
            (derived > LOOSE) | (s.level != _MIDDLE) | ~self._affords(s.derivatives, s.level, s.cost, _BUDGET)
        )
        tight = s.level == _TIGHT
        closed = near_enough & tight
        return _Verdict(stalled, derived, closed, near_enough & ~tight, closed & noise & (least < c.left))

    def _affords(self, derivatives: Array, level: Array, cost: Array, most: Array | float) -> Array:
        """Whether one more derivative at a level is within what a search may cost."""
        return (derivatives < _DERIVATIVES) & (cost + _of(level).cost * self._derivative_costs <= most)

    def _next(self, s: SearchState, c: _Correction, v: _Verdict) -> _Next:
        """The corrected state; in the first cycles, or where an old derivative corrects none, the end of this one."""
        step = c.step * s.scale
        corrected = self._displaced(s.x, s.period, step)
        newton = (v.up | ~v.stalled | s.derive) & (s.cycles >= WAIT) & ~v.closed
        newton &= jnp.all(jnp.isfinite(ravel_pytree(corrected)[0]))
        if s.period is None:
            ends = c.found.end, None
        else:
            newton &= jnp.abs(step[self._crank]) < 0.5 * s.period
            ends = self._displaced(s.x, s.period, c.gap * s.scale)
        before = jax.tree.map(lambda x, x0: jnp.where(v.back, x[0], x0), s.found.states, s.x)
        x, period = jax.tree.map(
            lambda a, b, c: jnp.where(v.closed, a, jnp.where(newton, b, c)), (before, s.period), corrected, ends
        )
        return _Next(x, period, newton)

    def _displaced(self, x: State, period: Array | None, y: Array) -> tuple[State, Array | None]:
        if period is None:
            return near(self._robot, x, y), None
        return near(self._robot, x, y.at[self._crank].set(0.0)), period + y[self._crank]

    def _followed(self, s: SearchState, c: _Correction, v: _Verdict, start: _Next) -> SearchState:
        """The search after a cycle: what the next one is for, or the end."""
        here, newton, judges = settings_at(self._settings, s.level), start.newton, self._multipliers > 0
        level = s.level + v.up
        cost = s.cost + _of(s.level).cost * jnp.where(s.derive, self._derivative_costs, 1.0)
        most = jnp.where(level == LOOSE, _FIRST, _BUDGET)
        spent = (s.cycles + 1 >= _CYCLES) | (cost >= most)
        # a derivative that costs as much as several corrections must spare as many
        dear = max(self._derivative_costs / _USUAL, 1.0)
        quick = newton & (v.up | s.derive | ~jnp.isfinite(s.best) | (c.left <= _QUICK ** (1 / dear) * s.best))
        blunt = (s.level == _MIDDLE) & (v.derived <= LOOSE)
        derive = (s.cycles + 1 >= WAIT) & (~quick | blunt) & self._affords(s.derivatives, level, cost, most)
        moved = jnp.where(s.derive, 0.0, s.moved)
        known = (v.derived == _TIGHT) & (moved <= _SAME)
        # the next cycle is likely the orbit
        lands = newton & (s.level == _TIGHT) & (v.derived < _TIGHT) & (dear == 1.0)
        derive = jnp.where(v.closed, judges & ~known, derive | (judges & lands))
        return SearchState(
            x=start.x,
            period=start.period,
            found=jax.tree.map(lambda a, b: jnp.where(v.back, a, b), s.found, c.found),
            scale=jnp.where((s.derivatives > 0) | s.derive, s.scale, c.found.allowed / here.rtol),
            derivative=c.derivative,
            coarse=jnp.where(s.derive & (s.derived < s.level), s.derivative, s.coarse),
            inverse=c.inverse,
            within=c.within,
            step=c.step,
            gap=c.gap,
            newton=newton & ~v.up,
            best=jnp.where(newton & ~v.up, c.left, jnp.inf),
            level=level,
            derive=derive,
            corrections=jnp.where(v.up, 0, s.corrections + newton),
            derivatives=s.derivatives + s.derive,
            cycles=s.cycles + 1,
            cost=cost,
            waited=jnp.where(v.closed, s.waited, ~newton & (s.cycles >= WAIT)),
            closed=v.closed,
            done=(c.found.status != int(Status.SOLVED)) | jnp.where(v.closed, ~derive, spent),
            left=jnp.where(v.back, s.best, c.left),
            derived=v.derived,
            moved=moved + jnp.where(newton, rms(c.step), jnp.where(v.closed, 0.0, jnp.inf)),
        )


def _of(level: Array | int) -> _Level:
    return _Level(*jnp.array(_LEVELS)[level])


def residual_limit(steps: Array) -> Array:
    """Largest gap and correction of an orbit whose cycle has as many steps, over the tolerance of one."""
    return jnp.clip(_NOISE * steps, 1.0, _MOST)


def settings_at(settings: Settings, level: Array | int) -> Settings:
    """Settings of cycles at a level."""
    here = _of(level)
    more = jnp.clip(here.loosest / settings.rtol, jnp.minimum(here.factor, _LOOSER), here.factor)
    looser = settings.rtol * more, settings.atol * more, settings.longest * here.longer
    return eqx.tree_at(lambda s: (s.rtol, s.atol, s.longest), settings, looser)


def scaled(times: Float[Array, "n"], settings: Settings, period: Array | None) -> tuple[Float[Array, "n"], Settings]:
    """Times, and settings with the longest step, of an unknown period; the same of one that is known."""
    if period is None:
        return times, settings
    longest = settings.longest * jax.lax.stop_gradient(period)
    return times * period, eqx.tree_at(lambda s: s.longest, settings, longest)


def _updated(inverse: Float[Array, "m m"], step: Float[Array, "m"], change: Float[Array, "m"]) -> Float[Array, "m m"]:
    """Inverse of a derivative with a change of the function after a step (Broyden 1965); the same without a step."""
    moved = inverse @ change
    share = step @ moved
    solid = jnp.abs(share) > 1e-12 * (step @ step)
    return inverse + jnp.where(solid, jnp.outer(step - moved, step @ inverse) / jnp.where(solid, share, 1.0), 0.0)
