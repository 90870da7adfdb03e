"""Springs, dampers, dry friction and limits of joints; limits are one-sided and compliant."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import JointLoad
from nectosome.core.dry_friction import DryFriction
from nectosome.core.one_sided import Gaps, one_sided_force


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


class JointFriction(JointLoad):
    """Dry friction of a hinge or a slide (`nectosome.core.dry_friction`): it holds what is less than its limit."""

    limit: Float[Array, ""]  # F_c [N m or N]
    slip: Float[Array, ""]  # s [rad or m]
    dissipative = True  # but for what is `stored`

    def initial(self) -> Float[Array, "1"]:
        """It bears nothing yet."""
        return jnp.zeros(1)

    def force(self, displacement: Float[Array, "nv"], v: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """While its share w is 0."""
        return self.at_state(displacement, v, self.initial())[0]

    def at_state(
        self, displacement: Float[Array, "nv"], v: Float[Array, "nv"], z: Any
    ) -> tuple[Float[Array, "nv"], Any]:
        """Force at the share w, and the rate of w."""
        friction = DryFriction(self.limit, self.slip)
        return -friction.force(z, v), friction.rate(z, v)

    def stored(self, z: Float[Array, "1"]) -> Float[Array, ""]:
        """Energy stored at the share w [J]."""
        return jnp.sum(DryFriction(self.limit, self.slip).energy(z))


class JointLimit(JointLoad):
    r"""A one-sided limit: zero before contact, then a smooth transition to a stiff spring with a damper.

    With the penetration in units of the softness, $x = \pm(\theta - \theta_0)/d_0$, and $\xi = clip(x, 0, 1)$, the
    restoring force is

    $$ \max\left(0,\ k d_0 [\xi^3 - \tfrac12 \xi^4 + \max(x - 1, 0)] + c\, \xi^2 (3 - 2 \xi)\, d_0 \dot x\right) $$

    It never pulls. The force and its first derivative are continuous; beyond $d_0$ the stiffness is k.
    """

    at: Float[Array, ""]  # theta_0 [rad or m]
    stiffness: Float[Array, ""]  # k [N m/rad or N/m]
    damping: Float[Array, ""]  # c [N m s/rad or N s/m]
    softness: Float[Array, ""]  # d_0 [rad or m]
    side: ClassVar[float]  # +1: above `at`, -1: below

    def force(self, displacement: Float[Array, "nv"], v: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """Force away from the limit."""
        depth, rate = self.side * (displacement - self.at), self.side * v
        return -self.side * one_sided_force(depth, rate, self.stiffness, self.damping, self.softness)

    def gaps(self, displacement: Float[Array, "nv"]) -> Gaps:
        """Distances to the limit."""
        return Gaps.of(self.side * (self.at - displacement) / self.softness, self.stiffness, self.damping)


class LowerLimit(JointLimit):
    """A limit that keeps the joint above `at`."""

    side = -1.0


class UpperLimit(JointLimit):
    """A limit that keeps the joint below `at`."""

    side = 1.0
