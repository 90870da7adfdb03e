r"""Relative equilibria: shapes and rates at which all velocities stay as they are.

From a guess, Newton's method solves $R(y) = \lambda R(y_0)$ with $\lambda = 0$, or where that fails with adaptive steps
from 1 to 0. Where there is no guess, or it does not lead there, the robot is first made stiff, then softened: elastic
and joint forces are taken times $e^\sigma$ while $\sigma$ falls to 0 in adaptive steps with a secant predictor. In
water, where forces grow with the square of the speed, this is the same as speeding the drives up from nothing. The
stiff robot, and what is left where softening stalls, is solved by pseudo-transient steps
$(P/\tau + J)\,\Delta y = -R$ with a growing $\tau$ and P the inertia (Kelley and Keyes 1998).
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from nectosome.core import Solution, State, Status
from nectosome.core.linear import generalised_inverse
from nectosome.mechanism import Robot

from .equations import Equations, Point
from .symmetry import Symmetry

_STIFF = 9.0  # sigma of the stiff robot: 8000 times as stiff
_STEP, _SMALLEST_STEP = 2.0, 0.02  # of sigma
_SMALLEST_SHARE = 0.05  # of the guess's residual, as a step
_SLOW = 0.15  # contraction of Newton's correction above which the Jacobian is computed afresh
_FAR = 0.7  # rad, m, m/s: a correction as large leaves what the Jacobian knows
_TURN = 0.5  # the largest correction that pseudo-transient steps take
_EXACT, _ROUGH = 1e-12, 1e-3  # error of the unknowns that ends Newton's method: at the end, on the way
_BALANCED = 1e-10  # largest scaled residual of a solution
_CORRECTIONS, _TRANSIENTS = 16, 200
_TAU = 0.05  # s, of the first pseudo-transient step
_NEAR, _STIFFEN, _SOFTEN, _TRANSIENT, _DONE = range(5)


class Equilibrium(NamedTuple):
    """A steady motion, and what the drives of prescribed joints give for it."""

    state: State
    reaction: Float[Array, "np"]  # [N m, N]


class _Newton(NamedTuple):
    """Newton's iteration at one sigma."""

    p: Point
    first: Array  # residual it started from
    weighed: Array  # norm of the last residual
    inverted: Array
    size: Array  # of the last correction
    rate: Array  # of it to the one before
    tau: Array
    polished: Array  # the last correction started from an error small enough
    k: Array
    jacobians: Array

    @property
    def left(self) -> Array:
        """Estimate of the error that is left."""
        return self.size * jnp.minimum(self.rate / jnp.maximum(1 - self.rate, 1e-3), 1.0)


class _Search(NamedTuple):
    """The search as a whole: on its way from a guess or a stiff robot, `left` of the way is still to go."""

    p: Point
    before: Point  # with left_before, for the secant
    left: Array  # share of the guess's residual, or sigma
    left_before: Array
    step: Array
    phase: Array
    found: Array
    origin: Array  # residual of the guess
    inverted: Array
    jacobians: Array
    residuals: Array


@eqx.filter_custom_jvp
def equilibrium(robot: Robot, symmetry: Symmetry, guess: State, warm: Bool[Array, ""]) -> Solution:
    """Relative equilibrium from a guess (`warm`) or from rest, with status SOLVED or NO_EQUILIBRIUM.

    `stats` counts Jacobians and residuals; `residual` is the largest one relative to all that acts on its unknown.
    Works under jit and vmap; derivatives of the value with respect to the robot follow from the implicit function
    theorem, $dy = -J^{-1} \\partial R$, forward and reverse. What the equations leave open (how far a round body has
    rolled) stays as it is.
    """
    equations = Equations(robot, symmetry)
    rest = robot.initial()
    cold = Point(rest.q, jnp.zeros_like(guess.v), rest.z)

    def advance(s: _Search) -> _Search:
        near, stiffen, soften = s.phase == _NEAR, s.phase == _STIFFEN, s.phase == _SOFTEN
        follows = near | soften
        target = jnp.where(stiffen, _STIFF, jnp.where(follows, jnp.maximum(s.left - s.step, 0.0), 0.0))
        span = s.left_before - s.left
        ahead = jnp.where(follows & (span > 0), (s.left - target) / jnp.where(span > 0, span, 1.0), 0.0)
        guess = jax.tree.map(lambda a, b, c: jnp.where(stiffen, c, a + ahead * (a - b)), s.p, s.before, cold)
        share, sigma = jnp.where(near, target, 0.0), jnp.where(near, 0.0, target)
        it = _newton(
            equations, guess, s.inverted, sigma, share * s.origin, target == 0, stiffen | (s.phase == _TRANSIENT)
        )
        fits = jnp.isfinite(it.size) & (it.size < _FAR) & (it.left <= _tolerance(target == 0))
        step = s.step * jnp.where(fits, jnp.where(it.k <= 4, 2.0, 1.0), 0.5)
        phase = jnp.select(
            [follows & fits, near, soften, stiffen],
            [
                jnp.where(target == 0, _DONE, s.phase),
                jnp.where(step < _SMALLEST_SHARE, _STIFFEN, _NEAR),
                jnp.where(step < _SMALLEST_STEP, _TRANSIENT, _SOFTEN),
                jnp.where(fits, _SOFTEN, _TRANSIENT),
            ],
            _DONE,
        )
        # the stiff robot is the first of its path and has none before it
        moved = (it.p, jax.tree.map(lambda a, b: jnp.where(stiffen, b, a), s.p, it.p))
        moved = (*moved, target, jnp.where(stiffen, target, s.left))
        stayed = (s.p, s.before, s.left, s.left_before)
        p, before, left, left_before = jax.tree.map(lambda a, b: jnp.where(fits, a, b), moved, stayed)
        return _Search(
            p=p,
            before=before,
            left=left,
            left_before=left_before,
            step=jnp.where(follows, step, _STEP),
            phase=phase,
            found=fits & (target == 0),
            origin=jnp.where(near & (s.left == 1) & (s.step == 1), it.first, s.origin),
            inverted=it.inverted,
            jacobians=s.jacobians + it.jacobians,
            residuals=s.residuals + it.k,
        )

    given = Point(guess.q, symmetry.along(robot, guess), guess.z)
    one, none = jnp.ones(()), jnp.zeros((), int)
    m = guess.v.size + ravel_pytree(guess.z)[0].size
    start = _Search(
        p=given,
        before=given,
        left=one,
        left_before=one,
        step=one,
        phase=jnp.where(warm, _NEAR, _STIFFEN),
        found=jnp.asarray(False),
        origin=jnp.zeros(m),
        inverted=jnp.eye(m),
        jacobians=none,
        residuals=none,
    )
    s = jax.lax.while_loop(lambda s: s.phase != _DONE, advance, start)
    imbalance, reaction = equations.imbalance(s.p)
    status = jnp.where(s.found & (imbalance <= _BALANCED), int(Status.SOLVED), int(Status.NO_EQUILIBRIUM))
    value = Equilibrium(equations.state(s.p), reaction)
    return Solution(value, status, {"jacobians": s.jacobians, "residuals": s.residuals}, imbalance)


@equilibrium.def_jvp
def _implicit(primals: tuple, tangents: tuple) -> tuple[Solution, Solution]:
    robot, symmetry, _, _ = primals
    solution = equilibrium(*primals)
    x = solution.value.state
    p, zero = Point(x.q, symmetry.along(robot, x), x.z), jnp.zeros(())
    J, of_reaction = Equations(robot, symmetry).jacobian(p, zero)

    def residual(robot: Robot) -> tuple[Array, Array]:
        return Equations(robot, symmetry).residual(p, zero)

    def state(robot: Robot, y: Array) -> State:
        equations = Equations(robot, symmetry)
        return equations.state(equations.near(p, y))

    values, changes = eqx.filter_jvp(residual, (robot,), (tangents[0],))
    # None where nothing depends on the robot's numbers, such as the reactions of a robot without drives
    dr, reaction = (jnp.zeros_like(f) if df is None else df for f, df in zip(values, changes, strict=True))
    dy = -generalised_inverse(J) @ dr
    _, dx = eqx.filter_jvp(state, (robot, jnp.zeros_like(dy)), (tangents[0], dy))
    still = jax.tree.map(lambda _: None, solution)
    change = Equilibrium(dx, reaction + of_reaction @ dy)
    return solution, eqx.tree_at(lambda s: s.value, still, change, is_leaf=lambda x: x is None)


def _tolerance(last: Array) -> Array:
    return jnp.where(last, _EXACT, _ROUGH)


def _newton(
    equations: Equations, p: Point, inverted: Array, sigma: Array, goal: Array, last: Array, transient: Array
) -> _Newton:
    """Solve R(p) = goal at one sigma, exactly if it is the last on the way.

    Newton's method with a Jacobian that is kept while it serves, or pseudo-transient steps.
    """
    m, n = inverted.shape[0], p.rates.shape[0]
    weight = jax.lax.cond(
        transient, lambda p: jnp.ones(m).at[:n].set(jnp.diagonal(equations.mass(p))), lambda _: jnp.ones(m), p
    )
    most = jnp.where(transient, _TRANSIENTS, _CORRECTIONS)

    def going(it: _Newton) -> Array:
        lost = (it.size > _FAR) | ((it.rate > 1.5) & (it.k > 1))
        left = (it.left > _tolerance(last)) | (last & ~it.polished)
        return (it.k == 0) | ((it.k < most) & left & (transient | ~lost) & jnp.isfinite(it.size))

    def correct(it: _Newton) -> _Newton:
        refresh = transient | (it.k == 0) | (it.rate > _SLOW)
        r = equations.residual(it.p, sigma)[0] - goal
        weighed = jnp.sqrt(jnp.sum(r**2 / weight))
        # the faster the residual falls, the longer the next step
        fall = jnp.where(it.k == 0, 0.5, it.weighed / jnp.maximum(weighed, 1e-300))
        tau = it.tau * jnp.clip(2 * fall, 0.5, 8.0)

        def fresh(p: Point) -> Array:
            J, _ = equations.jacobian(p, sigma)
            return generalised_inverse(J + jnp.diag(jnp.where(transient, weight / tau, 0.0)))

        inverted = jax.lax.cond(refresh, fresh, lambda _: it.inverted, it.p)
        dy = -inverted @ r
        size = jnp.max(jnp.abs(dy))
        p = equations.near(it.p, dy * jnp.minimum(1.0, _TURN / jnp.maximum(size, 1e-300)))
        # of a first correction nothing is known but that Newton's method is quadratic
        rate = jnp.where(it.k == 0, jnp.minimum(0.5 * size, 1.0), size / jnp.maximum(it.size, 1e-300))
        polished = (it.k > 0) & (it.left <= _EXACT)
        first = jnp.where(it.k == 0, r, it.first)
        return _Newton(p, first, weighed, inverted, size, rate, tau, polished, it.k + 1, it.jacobians + refresh)

    zero, none, no = jnp.zeros(()), jnp.zeros((), int), jnp.asarray(False)
    return jax.lax.while_loop(going, correct, _Newton(p, goal, zero, inverted, zero, zero, zero + _TAU, no, none, none))
