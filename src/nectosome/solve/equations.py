"""Equations of a steady motion: residual, Jacobian and scale, for displacements and rates together."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.mechanism import Robot

from .symmetry import Symmetry


class Point(NamedTuple):
    """Unknowns: coordinates, rates along the symmetry (0 elsewhere), load states."""

    q: Float[Array, "nq"]
    rates: Float[Array, "nv"]
    z: Any


class Equations(eqx.Module):
    """Residual R(y) near a point; elastic and joint forces are scaled by exp(sigma)."""

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

    def residual(self, p: Point, sigma: Float[Array, ""]) -> tuple[Float[Array, "m"], Float[Array, "np"]]:
        """Unbalanced forces of the unknowns with the rates of load states, and the reactions of prescribed joints."""
        t, x, tree = jnp.zeros(()), self.state(p), self.robot.tree
        acting = self.robot.forces(t, x, jnp.zeros_like(x.v))
        r = acting.residual + jnp.expm1(sigma) * (acting.elastic - acting.joint)
        unbalanced = jnp.concatenate([r[tree.free_v], ravel_pytree(self.robot.state_rates(t, x))[0]])
        return unbalanced, acting.residual[tree.prescribed_v]

    def jacobian(self, p: Point, sigma: Float[Array, ""]) -> tuple[Float[Array, "m m"], Float[Array, "np m"]]:
        """Derivatives of both parts of the residual by the unknowns."""
        m = p.rates.shape[0] + ravel_pytree(p.z)[0].shape[0]
        return jax.jacfwd(lambda y: self.residual(self.near(p, y), sigma))(jnp.zeros(m))

    def mass(self, p: Point) -> Float[Array, "n n"]:
        """Mass matrix of the unknown velocities, added mass included."""
        tree = self.robot.tree
        q, *_ = tree.complete(jnp.zeros(()), p.q, jnp.zeros_like(p.rates))
        shape, t = tree.shape(q), jnp.zeros(())
        still = jnp.zeros((shape.position.shape[0], 6))
        return self.robot.mass(shape, self.robot.carried(t, shape, still, p.z)[0])

    def imbalance(self, p: Point) -> tuple[Float[Array, ""], Float[Array, "np"]]:
        """Largest residual relative to the sum of magnitudes of all forces on its unknown, and the reactions."""
        t, x = jnp.zeros(()), self.state(p)
        acting = self.robot.forces(t, x, jnp.zeros_like(x.v))
        free, layout = self.robot.tree.free_v, self.robot.tree.layout
        wrench = jnp.abs(acting.fluid) + jnp.abs(acting.inertia)
        for attached, w in zip(self.robot.loads, acting.wrenches, strict=True):
            if w is not None:
                wrench = wrench.at[layout[attached.part].stations].add(jnp.abs(w))
        total = jnp.sum(jnp.abs(self.robot.columns(acting.shape)) * wrench, axis=(1, 2))
        inner = acting.elastic, acting.viscous, acting.joint, acting.active, acting.paired, acting.drive
        total += sum(jnp.abs(f)[free] for f in inner)
        share = jnp.abs(acting.residual[free]) / jnp.where(total > 0, total, 1.0)
        moving, _ = ravel_pytree(self.robot.state_rates(t, x))
        largest = jnp.max(jnp.concatenate([share, jnp.abs(moving)]))
        return largest, acting.residual[self.robot.tree.prescribed_v]
