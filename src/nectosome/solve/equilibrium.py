r"""Relative equilibria: shapes and rates with constant velocities.

From a guess, Newton's method solves $R(y) = \lambda R(y_0)$ with $\lambda = 0$, or if that fails with adaptive steps of
$\lambda$ from 1 to 0. Without a guess, or if this fails, stiffness continuation follows: elastic and joint forces are
multiplied by $e^\sigma$, and $\sigma$ falls to 0 in adaptive steps with a secant predictor. In water, with forces
proportional to the square of the speed, this is equivalent to accelerating the drives from rest. The stiff robot, and a
stalled continuation, are solved by pseudo-transient steps $(P/\tau + J)\,\Delta y = -R$ with a growing $\tau$ and the
inertia P (Kelley and Keyes 1998).
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from nectosome.core import Solution, State, Status
from nectosome.core.linear_algebra import generalised_inverse
from nectosome.mechanism import Robot

from .symmetry import Symmetry, near

_STIFF = 9.0  # sigma of the stiff robot: 8000 times as stiff
_STEP, _SMALLEST_STEP = 2.0, 0.02  # of sigma
_SMALLEST_SHARE = 0.05  # smallest step of lambda
_SLOW = 0.15  # contraction of Newton's correction above which the Jacobian is recomputed
_FAR = 0.7  # [rad, m, m/s] largest correction for which the Jacobian is valid
_TURN = 0.5  # [rad, m, m/s] largest correction of a pseudo-transient step
_EXACT, _ROUGH = 1e-12, 1e-3  # tolerance of Newton's method on the unknowns: at the last step, at earlier ones
_BALANCED = 1e-10  # largest scaled residual of a solution
_SMALL = 1e-3  # [largest forces] least forces on an unknown that a residual is scaled by: smaller ones may be rounding
_CORRECTIONS, _TRANSIENTS = 16, 200
_NO_CONDITION = 1e-9  # [derivative by velocities] least derivatives of a load state's rate by what is unknown
_TAU = 0.05  # [s] first pseudo-transient step
_NEAR, _STIFFEN, _SOFTEN, _TRANSIENT, _DONE = range(5)


class Point(NamedTuple):
    """Unknowns: coordinates, rates along the symmetry (0 elsewhere), load states."""

    q: Float[Array, "nq"]
    rates: Float[Array, "nv"]
    z: Any


class Equations(eqx.Module):
    """Residual R(y) of a steady motion near a point; elastic and joint forces are scaled by exp(sigma)."""

    robot: Robot
    symmetry: Symmetry

    def state(self, p: Point) -> State:
        """State of the steady motion."""
        return State(p.q, self.symmetry.velocities(self.robot, p.q, p.rates), p.z)

    def near(self, p: Point, y: Float[Array, "m"]) -> Point:
        """Point displaced by y."""
        n = p.rates.shape[0]
        z, unravel = ravel_pytree(p.z)
        rates = p.rates + jnp.where(self.symmetry.rates(n), y[:n], 0.0)
        return Point(self.symmetry.displace(self.robot, p.q, y[:n]), rates, unravel(z + y[n:]))

    def residual(
        self, p: Point, sigma: Float[Array, ""], more: Float[Array, "n"] | None = None
    ) -> tuple[Float[Array, "m"], Float[Array, "np"]]:
        """Unbalanced forces of the unknowns with the rates of load states, and the reactions of prescribed joints.

        With `more` velocities than the steady motion has.
        """
        t, x, tree = jnp.zeros(()), self.state(p), self.robot.tree
        x = x if more is None else State(x.q, x.v + more, x.z)
        acting = self.robot.forces(t, x, jnp.zeros_like(x.v))
        r = acting.residual + jnp.expm1(sigma) * (acting.elastic - acting.joint - acting.paired)
        unbalanced = jnp.concatenate([r[tree.free_v], ravel_pytree(self.robot.state_rates(t, x))[0]])
        return unbalanced, acting.residual[tree.prescribed_v]

    def jacobian(
        self, p: Point, sigma: Float[Array, ""]
    ) -> tuple[Float[Array, "m m"], Float[Array, "np m"], Bool[Array, "m"]]:
        """Derivatives of both parts of the residual by the unknowns, and which are no conditions: see `solvable`."""
        n, states = p.rates.shape[0], ravel_pytree(p.z)[0].shape[0]
        m = n + states
        still = ~self.symmetry.rates(n)

        def at(y: Array) -> tuple[Array, Array]:
            return self.residual(self.near(p, y[:m]), sigma, jnp.where(still, y[m:], 0.0) if states else None)

        J, of_reaction = jax.jacfwd(at)(jnp.zeros(m + (n if states else 0)))
        K, _, free = solvable(J, jnp.zeros(m), n)
        return K, of_reaction[:, :m], free

    def mass(self, p: Point) -> Float[Array, "n n"]:
        """Mass matrix of the unknown velocities, added mass included."""
        tree = self.robot.tree
        q, v, _ = tree.complete(jnp.zeros(()), p.q, jnp.zeros_like(p.rates))
        shape, t = tree.shape(q), jnp.zeros(())
        still = jnp.zeros((shape.position.shape[0], 6))
        return self.robot.mass(shape, self.robot.carried(t, shape, still, q, v, p.z))

    def imbalance(self, p: Point) -> tuple[Float[Array, ""], Float[Array, "np"]]:
        """Largest residual relative to the sum of magnitudes of all forces on its unknown, and the reactions."""
        t, x = jnp.zeros(()), self.state(p)
        acting = self.robot.forces(t, x, jnp.zeros_like(x.v))
        free = self.robot.tree.free_v
        wrench = jnp.abs(acting.fluid) + jnp.abs(acting.inertia)
        wrench += self.robot.on_stations([jnp.abs(w) for w in acting.wrenches])
        total = jnp.sum(jnp.abs(self.robot.columns(acting.shape)) * wrench, axis=(1, 2))
        inner = acting.elastic, acting.viscous, acting.joint, acting.crank, acting.active, acting.paired, acting.drive
        total += sum(jnp.abs(f)[free] for f in inner)
        total = jnp.maximum(total, _SMALL * jnp.max(total, initial=0.0))
        share = jnp.abs(acting.residual[free]) / jnp.where(total > 0, total, 1.0)
        moving, _ = ravel_pytree(self.robot.state_rates(t, x))
        largest = jnp.max(jnp.concatenate([share, jnp.abs(moving)]))
        return largest, acting.residual[self.robot.tree.prescribed_v]


def solvable(
    J: Float[Array, "m k"], r: Float[Array, "m"], n: int
) -> tuple[Float[Array, "m m"], Float[Array, "m"], Bool[Array, "m"]]:
    """Equations of Newton's method for n displacements and load states, and which of them are no conditions at rest.

    J is by displacements, load states and velocities. A load state whose rate neither displacements nor states change,
    the integral of a servo or the stretch of a foot that sticks, goes along with the displacements: by its rate per
    velocity.
    """
    m = r.size - n
    if m == 0:
        return J, r, jnp.zeros(n, bool)
    by, along = J[n:, : n + m], J[n:, n + m :]
    free = jnp.max(jnp.abs(by), axis=1) <= _NO_CONDITION * jnp.max(jnp.abs(along), axis=1)
    rows = jnp.where(free[:, None], jnp.concatenate([along, -jnp.eye(m)], axis=1), by)
    free = jnp.concatenate([jnp.zeros(n, bool), free])
    K = jnp.concatenate([J[:n, : n + m], rows])
    return K, jnp.where(free, 0.0, r), free


def no_change(x: State) -> Float[Array, "k"]:
    """No change of displacements, load states, and, where there are any, velocities."""
    m = ravel_pytree(x.z)[0].size
    return jnp.zeros(x.v.size + m + (x.v.size if m else 0))


def changed(robot: Robot, x: State, y: Float[Array, "k"]) -> State:
    """State after a change of displacements, load states and velocities."""
    n, m = x.v.size, ravel_pytree(x.z)[0].size
    return near(robot, x, jnp.concatenate([y[:n], y[n + m :] if m else jnp.zeros(n), y[n : n + m]]))


def unbalanced(robot: Robot, x: State) -> Float[Array, "m"]:
    """Unbalanced forces and rates of load states."""
    t = jnp.zeros(())
    forces = robot.residual(t, x, jnp.zeros_like(x.v))
    return jnp.concatenate([forces, ravel_pytree(robot.state_rates(t, x))[0]])


class Equilibrium(NamedTuple):
    """A steady motion, and the reactions of prescribed joints."""

    state: State
    reaction: Float[Array, "np"]  # [N m, N]


class _Newton(NamedTuple):
    """Newton's iteration at one sigma."""

    p: Point
    first: Array  # residual at the start
    weighed: Array  # weighted norm of the last residual
    inverted: Array
    size: Array  # of the last correction
    rate: Array  # ratio of the last correction to the one before
    tau: Array
    polished: Array  # the error before the last correction was within tolerance
    k: Array
    jacobians: Array

    @property
    def error(self) -> Array:
        """Estimate of the remaining error."""
        return self.size * jnp.minimum(self.rate / jnp.maximum(1 - self.rate, 1e-3), 1.0)


class _Continuation(NamedTuple):
    """State of the continuation, from a guess (lambda) or from a stiff robot (sigma)."""

    p: Point
    before: Point  # at parameter_before, for the secant
    parameter: Array  # lambda or sigma
    parameter_before: Array
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

    `stats` counts Jacobians and residuals; `residual` is the largest one relative to the forces on its unknown.
    Works under jit and vmap; derivatives of the value with respect to the robot follow from the implicit function
    theorem, $dy = -J^{-1} \\partial R$, forward and reverse. Undetermined coordinates (the roll of a round body) do not
    change.
    """
    equations = Equations(robot, symmetry)
    rest = robot.initial()
    cold = Point(rest.q, jnp.zeros_like(guess.v), rest.z)

    def advance(s: _Continuation) -> _Continuation:
        near, stiffen, soften = s.phase == _NEAR, s.phase == _STIFFEN, s.phase == _SOFTEN
        follows = near | soften
        target = jnp.where(stiffen, _STIFF, jnp.where(follows, jnp.maximum(s.parameter - s.step, 0.0), 0.0))
        span = s.parameter_before - s.parameter
        ahead = jnp.where(follows & (span > 0), (s.parameter - target) / jnp.where(span > 0, span, 1.0), 0.0)
        guess = jax.tree.map(lambda a, b, c: jnp.where(stiffen, c, a + ahead * (a - b)), s.p, s.before, cold)
        share, sigma = jnp.where(near, target, 0.0), jnp.where(near, 0.0, target)
        it = _newton(
            equations, guess, s.inverted, sigma, share * s.origin, target == 0, stiffen | (s.phase == _TRANSIENT)
        )
        fits = jnp.isfinite(it.size) & (it.size < _FAR) & (it.error <= jnp.where(target == 0, _EXACT, _ROUGH))
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
        # the stiff robot is the first point of its path
        moved = (it.p, jax.tree.map(lambda a, b: jnp.where(stiffen, b, a), s.p, it.p))
        moved = (*moved, target, jnp.where(stiffen, target, s.parameter))
        stayed = (s.p, s.before, s.parameter, s.parameter_before)
        p, before, parameter, parameter_before = jax.tree.map(lambda a, b: jnp.where(fits, a, b), moved, stayed)
        step, found = jnp.where(follows, step, _STEP), fits & (target == 0)
        origin = jnp.where(near & (s.parameter == 1) & (s.step == 1), it.first, s.origin)
        counts = s.jacobians + it.jacobians, s.residuals + it.k
        return _Continuation(p, before, parameter, parameter_before, step, phase, found, origin, it.inverted, *counts)

    given = Point(guess.q, symmetry.along(robot, guess), guess.z)
    one, none = jnp.ones(()), jnp.zeros((), int)
    m = guess.v.size + ravel_pytree(guess.z)[0].size
    phase, no = jnp.where(warm, _NEAR, _STIFFEN), jnp.asarray(False)
    start = _Continuation(given, given, one, one, one, phase, no, jnp.zeros(m), jnp.eye(m), none, none)
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
    J, of_reaction, free = Equations(robot, symmetry).jacobian(p, zero)

    def residual(robot: Robot) -> tuple[Array, Array]:
        return Equations(robot, symmetry).residual(p, zero)

    def state(robot: Robot, y: Array) -> State:
        equations = Equations(robot, symmetry)
        return equations.state(equations.near(p, y))

    values, changes = eqx.filter_jvp(residual, (robot,), (tangents[0],))
    # None for results independent of the robot's numbers, such as the reactions of a robot without drives
    dr, reaction = (jnp.zeros_like(f) if df is None else df for f, df in zip(values, changes, strict=True))
    dy = -generalised_inverse(J) @ jnp.where(free, 0.0, dr)
    _, dx = eqx.filter_jvp(state, (robot, jnp.zeros_like(dy)), (tangents[0], dy))
    unchanged = jax.tree.map(lambda _: None, solution)
    change = Equilibrium(dx, reaction + of_reaction @ dy)
    return solution, eqx.tree_at(lambda s: s.value, unchanged, change, is_leaf=lambda x: x is None)


def _newton(
    equations: Equations, p: Point, inverted: Array, sigma: Array, goal: Array, last: Array, transient: Array
) -> _Newton:
    """Solve R(p) = goal at one sigma, exactly if it is the `last` step.

    Newton's method, with a Jacobian that is kept while it converges, or pseudo-transient steps.
    """
    m, n = inverted.shape[0], p.rates.shape[0]
    weight = jax.lax.cond(
        transient, lambda p: jnp.ones(m).at[:n].set(jnp.diagonal(equations.mass(p))), lambda _: jnp.ones(m), p
    )
    towards = jnp.where(jnp.arange(m) < n, 1.0, -1.0)  # forces are against a motion, rates of load states along it
    most = jnp.where(transient, _TRANSIENTS, _CORRECTIONS)

    def going(it: _Newton) -> Array:
        lost = (it.size > _FAR) | ((it.rate > 1.5) & (it.k > 1))
        unsolved = (it.error > jnp.where(last, _EXACT, _ROUGH)) | (last & ~it.polished)
        return (it.k == 0) | ((it.k < most) & unsolved & (transient | ~lost) & jnp.isfinite(it.size))

    def correct(it: _Newton) -> _Newton:
        refresh = transient | (it.k == 0) | (it.rate > _SLOW)
        r = equations.residual(it.p, sigma)[0] - goal
        weighed = jnp.sqrt(jnp.sum(r**2 / weight))
        # a faster decrease of the residual gives a longer next step
        fall = jnp.where(it.k == 0, 0.5, it.weighed / jnp.maximum(weighed, 1e-300))
        tau = it.tau * jnp.clip(2 * fall, 0.5, 8.0)

        def fresh(p: Point) -> Array:
            J, _, free = equations.jacobian(p, sigma)
            inverted = generalised_inverse(J + jnp.diag(jnp.where(transient & ~free, towards * weight / tau, 0.0)))
            return jnp.where(free, 0.0, inverted)

        inverted = jax.lax.cond(refresh, fresh, lambda _: it.inverted, it.p)
        dy = -inverted @ r
        size = jnp.max(jnp.abs(dy))
        p = equations.near(it.p, dy * jnp.minimum(1.0, _TURN / jnp.maximum(size, 1e-300)))
        # after a first correction, assume quadratic convergence
        rate = jnp.where(it.k == 0, jnp.minimum(0.5 * size, 1.0), size / jnp.maximum(it.size, 1e-300))
        polished = (it.k > 0) & (it.error <= _EXACT)
        first = jnp.where(it.k == 0, r, it.first)
        return _Newton(p, first, weighed, inverted, size, rate, tau, polished, it.k + 1, it.jacobians + refresh)

    zero, none, no = jnp.zeros(()), jnp.zeros((), int), jnp.asarray(False)
    return jax.lax.while_loop(going, correct, _Newton(p, goal, zero, inverted, zero, zero, zero + _TAU, no, none, none))
