"""Stops that a joint runs into, and how hard they push."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import JointLoad


def push(depth: Array, rate: Array, stiffness: Array, damping: Array, softness: Array) -> Array:
    r"""Force of what is `depth` deep and goes deeper at `rate`, as of a `JointLimit` with $\xi = clip(x, 0, 1)$."""
    x = depth / softness
    inside = jnp.clip(x, 0.0, 1.0)
    spring = stiffness * softness * (inside**3 - 0.5 * inside**4 + jnp.maximum(x - 1.0, 0.0))
    return jnp.maximum(spring + damping * inside**2 * (3.0 - 2.0 * inside) * rate, 0.0)


def pushed(depth: Array, stiffness: Array, softness: Array) -> Array:
    r"""Energy that its spring stores: $k d_0^2 [\xi^4/4 - \xi^5/10 + y/2 + y^2/2]$ with $y = max(x - 1, 0)$."""
    x = depth / softness
    inside, beyond = jnp.clip(x, 0.0, 1.0), jnp.maximum(x - 1.0, 0.0)
    return stiffness * softness**2 * (0.25 * inside**4 - 0.1 * inside**5 + 0.5 * beyond + 0.5 * beyond**2)


class JointLimit(JointLoad):
    r"""A one-sided stop: nothing until the joint reaches it, then a smooth rise to a stiff spring with a damper.

    With the way gone into the stop in units of its softness, $x = \pm(\theta - \theta_0)/d_0$, and
    $\xi = clip(x, 0, 1)$, it pushes back with

    $$ \max\left(0,\ k d_0 [\xi^3 - \tfrac12 \xi^4 + \max(x - 1, 0)] + c\, \xi^2 (3 - 2 \xi)\, d_0 \dot x\right) $$

    It never pulls. The force is continuous with its first derivative; beyond $d_0$ the stiffness is k.
    """

    at: Float[Array, ""]  # theta_0 [rad or m]
    stiffness: Float[Array, ""]  # k [N m/rad or N/m]
    damping: Float[Array, ""]  # c [N m s/rad or N s/m]
    softness: Float[Array, ""]  # d_0 [rad or m]
    side: ClassVar[float]  # +1: above `at`, -1: below

    def force(self, displacement: Float[Array, "nv"], v: Float[Array, "nv"]) -> Float[Array, "nv"]:
        """Force away from the stop."""
        depth, rate = self.side * (displacement - self.at), self.side * v
        return -self.side * push(depth, rate, self.stiffness, self.damping, self.softness)


class LowerLimit(JointLimit):
    """A stop that keeps the joint above `at`."""

    side = -1.0


class UpperLimit(JointLimit):
    """A stop that keeps the joint below `at`."""

    side = 1.0
