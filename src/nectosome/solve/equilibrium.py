r"""Relative equilibria: shapes and rates at which all velocities stay as they are.

Newton's method starts from a guess if there is one. Else, or where that fails, the robot is first made stiff, then
softened: elastic and joint forces are taken times $e^\sigma$ while $\sigma$ falls to 0 in adaptive steps with a secant
predictor. In water, where forces grow with the square of the speed, this is the same as speeding the drives up from
nothing. The stiff robot, and what is left where softening stalls, is solved by pseudo-transient steps
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
_SLOW = 0.15  # contraction of Newton's correction above which the Jacobian is computed afresh
_FAR = 0.7  # rad, m, m/s: a correction as large leaves what the Jacobian knows
_TURN = 0.5  # the largest correction that pseudo-transient steps take
_EXACT, _ROUGH = 1e-12, 1e-3  # error of the unknowns that ends Newton's method: at the end, on the way
_BALANCED = 1e-10  # largest scaled residual of a solution
_CORRECTIONS, _TRANSIENTS = 16, 200
_TAU = 0.05  # s, of the first pseudo-transient step
_WARM, _STIFFEN, _SOFTEN, _TRANSIENT, _DONE = range(5)


class Equilibrium(NamedTuple):
    """A steady motion, and what the drives of prescribed joints give for it."""

    state: State
    reaction: Float[Array, "np"]  # [N m, N]


class _Newton(NamedTuple):
    """Newton's iteration at one sigma."""

    p: Point
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
    """The search as a whole."""

    p: Point
    before: Point  # at sigma_before, for the secant
    sigma: Array
    sigma_before: Array
    step: Array
    phase: Array
    found: Array
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
        soften, stiffen = s.phase == _SOFTEN, s.phase == _STIFFEN
        target = jnp.where(stiffen, _STIFF, jnp.where(soften, jnp.maximum(s.sigma - s.step, 0.0), 0.0))
        span = s.sigma_before - s.sigma
        ahead = jnp.where(soften & (span > 0), (s.sigma - target) / jnp.where(span > 0, span, 1.0), 0.0)
        guess = jax.tree.map(lambda a, b, c: jnp.where(stiffen, c, a + ahead * (a - b)), s.p, s.before, cold)
        it = _newton(equations, guess, s.inverted, target, stiffen | (s.phase == _TRANSIENT))
        fits = jnp.isfinite(it.size) & (it.size < _FAR) & (it.left <= _tolerance(target))
        step = jnp.where(soften, s.step * jnp.where(fits, jnp.where(it.k <= 4, 2.0, 1.0), 0.5), s.step)
        phase = jnp.select(
            [s.phase == _WARM, stiffen, soften & fits, soften],
            [
                jnp.where(fits, _DONE, _STIFFEN),
                jnp.where(fits, _SOFTEN, _TRANSIENT),
                jnp.where(target == 0, _DONE, _SOFTEN),
                jnp.where(step < _SMALLEST_STEP, _TRANSIENT, _SOFTEN),
            ],
            _DONE,
        )
        # the stiff robot is the first of the path and has none before it
        moved = (it.p, jax.tree.map(lambda a, b: jnp.where(stiffen, b, a), s.p, it.p))
        moved = (*moved, target, jnp.where(stiffen, target, s.sigma))
        stayed = (s.p, s.before, s.sigma, s.sigma_before)
        p, before, sigma, sigma_before = jax.tree.map(lambda a, b: jnp.where(fits, a, b), moved, stayed)
        found = fits & (target == 0)
        jacobians, residuals = s.jacobians + it.jacobians, s.residuals + it.k
        return _Search(p, before, sigma, sigma_before, step, phase, found, it.inverted, jacobians, residuals)

    given = Point(guess.q, symmetry.along(robot, guess), guess.z)
    sigma, none = jnp.asarray(_STIFF), jnp.zeros((), int)
    blank = jnp.eye(guess.v.size + ravel_pytree(guess.z)[0].size)
    phase, no = jnp.where(warm, _WARM, _STIFFEN), jnp.asarray(False)
    start = _Search(given, given, sigma, sigma, jnp.asarray(_STEP), phase, no, blank, none, none)
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

    _, (dr, reaction) = eqx.filter_jvp(residual, (robot,), (tangents[0],))
    dy = -generalised_inverse(J) @ dr
    _, dx = eqx.filter_jvp(state, (robot, jnp.zeros_like(dy)), (tangents[0], dy))
    still = jax.tree.map(lambda _: None, solution)
    change = Equilibrium(dx, reaction + of_reaction @ dy)
    return solution, eqx.tree_at(lambda s: s.value, still, change, is_leaf=lambda x: x is None)


def _tolerance(sigma: Array) -> Array:
    return jnp.where(sigma == 0, _EXACT, _ROUGH)


def _newton(equations: Equations, p: Point, inverted: Array, sigma: Array, transient: Array) -> _Newton:
    """Newton's method with a Jacobian kept while it serves, or pseudo-transient steps, at one sigma."""
    m, n = inverted.shape[0], p.rates.shape[0]
    weight = jax.lax.cond(
        transient, lambda p: jnp.ones(m).at[:n].set(jnp.diagonal(equations.mass(p))), lambda _: jnp.ones(m), p
    )
    most = jnp.where(transient, _TRANSIENTS, _CORRECTIONS)

    def going(it: _Newton) -> Array:
        lost = (it.size > _FAR) | ((it.rate > 1.5) & (it.k > 1))
        left = (it.left > _tolerance(sigma)) | ((sigma == 0) & ~it.polished)
        return (it.k == 0) | ((it.k < most) & left & (transient | ~lost) & jnp.isfinite(it.size))

    def correct(it: _Newton) -> _Newton:
        refresh = transient | (it.k == 0) | (it.rate > _SLOW)
        r, _ = equations.residual(it.p, sigma)
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
        return _Newton(p, weighed, inverted, size, rate, tau, polished, it.k + 1, it.jacobians + refresh)

    zero, none, no = jnp.zeros(()), jnp.zeros((), int), jnp.asarray(False)
    return jax.lax.while_loop(going, correct, _Newton(p, zero, inverted, zero, zero, zero + _TAU, no, none, none))
