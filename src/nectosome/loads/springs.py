"""Springs and dampers on joints."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import JointLoad


class FlexureSpring(eqx.Module):
    """Strain and stress at the face of a hinge's flexible layer per bending angle."""

    strain: Float[Array, ""]  # [1/rad]
    stress: Float[Array, ""]  # [Pa/rad]


class Spring(JointLoad):
    """tau = -k (x - rest) on every axis of the joint; x an angle [rad], a length [m] or a rotation vector [rad]."""

    stiffness: Float[Array, ""]  # [N m/rad or N/m]
    rest: Float[Array, ""]  # [rad or m]
    flexure: FlexureSpring | None = None  # for a spring that models a hinge's flexible layer

    def force(self, displacement: Float[Array, "nv"], v: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """Restoring force."""
        return -self.stiffness * (displacement - self.rest)

    def bending(self, displacement: Float[Array, "nv"]) -> Float[Array, "2"] | None:
        """Strain and stress of the flexible layer; None without one."""
        if self.flexure is None:
            return None
        return (displacement[0] - self.rest) * jnp.stack([self.flexure.strain, self.flexure.stress])

    def energy(self, displacement: Float[Array, "nv"]) -> Float[Array, ""]:
        """Energy stored [J]."""
        return 0.5 * self.stiffness * jnp.sum((displacement - self.rest) ** 2)


class Damper(JointLoad):
    """tau = -c v on every axis of the joint."""

    damping: Float[Array, ""]  # [N m s/rad or N s/m]
    dissipative = True

    def force(self, displacement: Float[Array, "nv"], v: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """Damping force."""
        return -self.damping * v
