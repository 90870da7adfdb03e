"""Static equilibrium by load stepping: Newton's method at loads that grow from zero to full."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from nectosome.core import Solution, State, Status
from nectosome.mechanism import Robot

_MOST_ITERATIONS = 25
_SMALLEST_STEP = 1e-4
_STILL = 1e-12  # [rad, m] correction that counts as converged, also if all forces vanish


class _Path(NamedTuple):
    """State of the load stepping."""

    q: Array
    load: Array  # fraction of the loads in equilibrium at q
    before: Array  # q of the step before, for the secant
    load_before: Array
    step: Array
    iterations: Array


def load_stepping(
    robot: Robot, *, initial: State | None = None, first_step: float = 0.1, tolerance: float = 1e-10
) -> Solution:
    """Static state in which elastic and spring forces balance all loads; drives and prescribed joints as at t = 0.

    Forces between two parts count as elastic. Loads are scaled from zero to one, with a secant predictor and steps that
    halve if Newton's method fails and grow if it succeeds. `tolerance`: largest residual relative to the largest force
    in it. Returns a Solution with the State (the last one in equilibrium) and status SOLVED or NO_EQUILIBRIUM; `stats`
    holds the fraction of the loads reached, the Newton iterations, and the smallest eigenvalue of the tangent
    stiffness' symmetric part (negative under conservative loads: the equilibrium is unstable). Works under jit and
    vmap.
    """
    x = robot.initial() if initial is None else initial
    return _static(robot, x, jnp.asarray(first_step), jnp.asarray(tolerance))


@eqx.filter_jit
def _static(robot: Robot, x: State, first_step: Float[Array, ""], tolerance: Float[Array, ""]) -> Solution:
    zero = jnp.zeros_like(x.v)

    def balance(q: Array, load: Array) -> tuple[Array, Array]:
        """Residual at a fraction of the loads, and the largest force in it."""
        acting = robot.forces(jnp.zeros(()), State(q, zero, x.z), zero)
        inner = (acting.elastic - acting.joint - acting.paired)[robot.tree.free_v]
        outer = acting.residual[robot.tree.free_v] - inner
        return inner + load * outer, jnp.maximum(jnp.max(jnp.abs(inner)), load * jnp.max(jnp.abs(outer)))

    def stiffness(q: Array, load: Array) -> Array:
        return jax.jacfwd(lambda w: balance(robot.advance(q, w, jnp.ones(())), load)[0])(zero)

    def newton(q: Array, load: Array) -> tuple[Array, Array, Int[Array, ""]]:
        """Solution at a load, whether it converged, and the number of iterations."""

        def relative_residual(q: Array) -> Array:
            r, scale = balance(q, load)
            return jnp.max(jnp.abs(r)) / jnp.maximum(scale, 1e-30)

        def going(it):
            _, rest, size, k = it
            return (rest > tolerance) & (size > _STILL) & (k < _MOST_ITERATIONS)

        def correct(it):
            q, _, _, k = it
            dq = -jnp.linalg.solve(stiffness(q, load), balance(q, load)[0])
            # at most 0.5 rad (or strain, or m) per correction
            dq = dq * jnp.minimum(1.0, 0.5 / jnp.max(jnp.abs(dq)))
            q = robot.advance(q, dq, jnp.ones(()))
            return q, relative_residual(q), jnp.max(jnp.abs(dq)), k + 1

        start = (q, relative_residual(q), jnp.asarray(jnp.inf), jnp.zeros((), int))
        q, rest, size, k = jax.lax.while_loop(going, correct, start)
        return q, (rest <= tolerance) | (size <= _STILL), k

    def going(path: _Path) -> Array:
        return (path.load < 1.0) & (path.step > _SMALLEST_STEP)

    def follow(path: _Path) -> _Path:
        load = jnp.minimum(path.load + path.step, 1.0)
        span = path.load - path.load_before
        ahead = jnp.where(span > 0, (load - path.load) / jnp.where(span > 0, span, 1.0), 0.0)
        guess = path.q + ahead * (path.q - path.before)
        q, converged, k = newton(guess, load)
        step = path.step * jnp.where(converged, jnp.where(k < 6, 2.0, 1.0), 0.5)
        reached = _Path(q, load, path.q, path.load, step, path.iterations + k)
        return jax.tree.map(lambda a, b: jnp.where(converged, a, b), reached, path._replace(step=step))

    start = _Path(x.q, jnp.zeros(()), x.q, jnp.zeros(()), first_step, jnp.zeros((), int))
    path = jax.lax.while_loop(going, follow, start)
    r, scale = balance(path.q, path.load)
    K = stiffness(path.q, path.load)
    solved = path.load >= 1.0
    return Solution(
        value=State(path.q, zero, x.z),
        status=jnp.where(solved, int(Status.SOLVED), int(Status.NO_EQUILIBRIUM)),
        stats={
            "load": path.load,
            "iterations": path.iterations,
            "stability": jnp.min(jnp.linalg.eigvalsh(0.5 * (K + K.T))),
        },
        residual=jnp.max(jnp.abs(r)) / jnp.maximum(scale, 1e-30),
    )
