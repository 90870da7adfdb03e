"""Joint limits: one-sided, compliant stops."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import JointLoad


def push(depth: Array, rate: Array, stiffness: Array, damping: Array, softness: Array) -> Array:
    r"""Contact force at penetration `depth` and its `rate`, as for a `JointLimit`."""
    x = depth / softness
    inside = jnp.clip(x, 0.0, 1.0)
    spring = stiffness * softness * (inside**3 - 0.5 * inside**4 + jnp.maximum(x - 1.0, 0.0))
    return jnp.maximum(spring + damping * inside**2 * (3.0 - 2.0 * inside) * rate, 0.0)


def pushed(depth: Array, stiffness: Array, softness: Array) -> Array:
    r"""Energy of the contact spring: $k d_0^2 [\xi^4/4 - \xi^5/10 + y/2 + y^2/2]$ with $y = max(x - 1, 0)$."""
    x = depth / softness
    inside, beyond = jnp.clip(x, 0.0, 1.0), jnp.maximum(x - 1.0, 0.0)
    return stiffness * softness**2 * (0.25 * inside**4 - 0.1 * inside**5 + 0.5 * beyond + 0.5 * beyond**2)


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
        return -self.side * push(depth, rate, self.stiffness, self.damping, self.softness)


class LowerLimit(JointLimit):
    """A limit that keeps the joint above `at`."""

    side = -1.0


class UpperLimit(JointLimit):
    """A limit that keeps the joint below `at`."""

    side = 1.0
