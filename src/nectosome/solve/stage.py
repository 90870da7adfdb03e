"""The equations of one stage of an implicit step, and solutions of those of a stage close to it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from nectosome.core import Mechanical, State
from nectosome.core.linear_algebra import inverse

CHANGE = 1e-4  # of a velocity and its rate, for differences
LEAST_CHANGE = 1e-5  # [m/s, rad/s] of a velocity, above rounding errors where it is zero
_FINE = 1e-2  # of these, for solutions beside another one
_MANY = 4  # load states a velocity above which they spare more than the compiler takes for their own equations


class Neighbours(NamedTuple):
    """Solutions close to another one, which are taken along in its steps; leaves [p, ...]."""

    x: State
    rate: State
    numbers: Any = None  # floats of n + 1 times the system, then of those of p others; None where all have the same


class ImplicitStage(eqx.Module):
    """The equations of one stage: its base state, and c = gamma h."""

    system: Mechanical
    t: Array
    base: State
    c: Array

    def reach(self, w: Array) -> State:
        """State of the stage for accelerations (and rates of load states) w."""
        base, c = self.base, self.c
        _, unravel = ravel_pytree((base.v, base.z))
        a, dz = unravel(w)
        v = base.v + c * a
        return State(self.system.advance(base.q, v, c), v, jax.tree.map(lambda z, d: z + c * d, base.z, dz))

    def residual(self, w: Array) -> Array:
        """Residual of the equations."""
        n, x = self.base.v.shape[0], self.reach(w)
        r = self.system.residual(self.t, x, w[:n])
        if w.shape[0] > n:
            rates, _ = ravel_pytree(self.system.state_rates(self.t, x))
            r = jnp.concatenate([r, w[n:] - rates])
        return r


def solved_beside(stage: ImplicitStage, w: Array, bases: State, numbers: Any, increment: Array) -> Float[Array, "p n"]:
    """Solutions of a stage with the solution w, from p bases close to its own: one step of Newton's method.

    `numbers` as of `Neighbours`.

    The Jacobian's columns and what the bases leave unbalanced are differences of one residual, side by side.
    """
    n, increment = w.shape[0], _FINE * increment
    if n > (1 + _MANY) * stage.base.v.shape[0] and numbers is None:
        return w + _with_states(stage, w, bases, increment)
    increments = increment * jnp.eye(n)

    def unbalanced(base: State, dw: Array, numbers: Any) -> Array:
        return moved_to(stage, base, numbers).residual(w + dw)

    own = jax.tree.map(lambda x: jnp.broadcast_to(x, (n + 1, *x.shape)), stage.base)
    every = jax.tree.map(lambda x, near: jnp.concatenate([x, near]), own, bases)
    changes = jnp.concatenate([jnp.zeros((1, n)), increments])
    p = jax.tree.leaves(bases)[0].shape[0]
    r = jax.vmap(unbalanced)(every, jnp.pad(changes, [(0, p), (0, 0)]), numbers)
    columns = (r[1 : n + 1] - r[0]) / increment[:, None]
    return w - (r[n + 1 :] - r[0]) @ inverse(columns.T).T


def _with_states(stage: ImplicitStage, w: Array, bases: State, increment: Array) -> Float[Array, "p n"]:
    r"""Newton's corrections of a solution w with many load states, from p bases close to the stage's own.

    What the bases leave unbalanced, $\rho$, follows from columns by coordinates and velocities of the base. Those by
    load states have one motion in common and cost little. Where the rate of each depends on no other one,
    as in wakes and vortices, D is diagonal, and they are eliminated:

    $$ (A - B D^{-1} C)\, \delta a = B D^{-1} \rho_z - \rho_a, \quad \delta \dot z = -D^{-1} (\rho_z + C\, \delta a) $$
    """
    base, c, (nq, n) = stage.base, stage.c, (stage.base.q.shape[0], stage.base.v.shape[0])
    z, states = ravel_pytree(base.z)
    parts = lambda y: jnp.split(y, [nq, nq + n])  # noqa: E731
    change = lambda x: _FINE * jnp.maximum(LEAST_CHANGE, CHANGE * jnp.abs(x))  # noqa: E731

    def columns(residual: Callable[[Array], Array], x: Array, by: Array) -> Array:
        """Derivative of a residual, a row for each number of x."""
        r = jax.vmap(residual)(x + jnp.concatenate([jnp.zeros((1, x.size)), jnp.diag(by)]))
        return (r[1:] - r[0]) / by[:, None]

    def of_motion(y: Array) -> Array:
        q, v, a = parts(y)
        return replace(stage, base=State(q, v, base.z)).residual(jnp.concatenate([a, w[n:]]))

    def of_states(z: Array) -> Array:
        return replace(stage, base=State(base.q, base.v, states(z))).residual(w)

    motion = jnp.concatenate([base.q, base.v, w[:n]])
    by_q, by_v, by_a = parts(columns(of_motion, motion, jnp.concatenate([change(motion[: nq + n]), increment[:n]])))
    by_z = columns(of_states, z, change(z))
    rho = (bases.q - base.q) @ by_q + (bases.v - base.v) @ by_v + (as_rows(bases.z) - z) @ by_z
    (A, C), (B, D) = jnp.split(by_a, [n], axis=1), jnp.split(c * by_z, [n], axis=1)
    D = D + jnp.eye(z.size)

    def eliminated() -> Array:
        Di = 1 / jnp.diagonal(D)
        BD = Di[:, None] * B
        a = (rho[:, n:] @ BD - rho[:, :n]) @ inverse(A - C @ BD)
        return jnp.concatenate([a, -(rho[:, n:] + a @ C) * Di], axis=1)

    alone = jnp.all((D == 0) | np.eye(z.size, dtype=bool))
    return jax.lax.cond(alone, eliminated, lambda: -rho @ inverse(jnp.block([[A, C], [B, D]])))


def moved_to(stage: ImplicitStage, base: State, numbers: Any) -> ImplicitStage:
    """A stage from another base, of a system with other numbers."""
    return replace(stage, base=base, system=stage.system if numbers is None else eqx.combine(numbers, stage.system))


def as_rows(x: Any) -> Float[Array, "p n"]:
    """Leaves [p, ...] as rows."""
    return jax.vmap(lambda x: ravel_pytree(x)[0])(x)
