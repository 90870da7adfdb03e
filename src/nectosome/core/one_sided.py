r"""The one-sided law of stops, contacts and tendons: a spring and a damper that act on one side only, smoothly.

With the depth in units of the softness, $x = d/d_0$, and $\xi = clip(x, 0, 1)$, the force is

$$ F = \max\left(0,\ k d_0 [\xi^3 - \tfrac12 \xi^4 + \max(x - 1, 0)] + c\, \xi^2 (3 - 2 \xi)\, \dot d\right) $$

It is never negative, whatever the rate. It and its first derivatives by the depth are continuous while the sum is
positive; beyond $d_0$ the stiffness is k.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

_ITERATIONS = 8  # of Newton's method, which comes to rounding within 6
_NO_FORCE = 1e-12  # [k d_0], below which the depth has no derivative by the force


class Gaps(NamedTuple):
    """Where loads that act on one side only begin, and where their dampers let go of what leaves."""

    gap: Float[Array, "*k"]  # over the softness, negative inside
    lag: Float[Array, "*k"]  # c/k [s]; 0 where the damper never lets go
    ramp: Bool[Array, "*k"]  # the force is k d + c xi d' instead of the law above

    @classmethod
    def of(cls, gap: Array, stiffness: Array, damping: Array | float, ramp: bool = False) -> "Gaps":
        """Of loads with a spring and a damper."""
        return cls(gap, jnp.broadcast_to(damping / stiffness, gap.shape), jnp.full(gap.shape, ramp))


def damper_slack(gap: Array, rate: Array, lag: Array, ramp: Array) -> Array:
    r"""What passes 0 where the force does inside a contact, positive without force, of a gap and its rate [1/s].

    $c \dot g (3 - 2\xi) / k - f(x) / \xi^2$ with the spring's force $k d_0 f$; of a ramp $c \dot g / k - x / \xi$.
    """
    x = -gap
    inside = jnp.minimum(x, 1.0)
    soft, hard = inside - 0.5 * inside**2, jnp.maximum(x - 1.0, 0.0)
    return jnp.where(ramp, lag * rate - 1.0 - hard, lag * rate * (3.0 - 2.0 * inside) - soft - hard)


def one_sided_force(depth: Array, rate: Array, stiffness: Array, damping: Array, softness: Array) -> Array:
    """Force [N, N m] at a depth [m, rad] and its rate."""
    x = depth / softness
    inside = jnp.clip(x, 0.0, 1.0)
    spring = stiffness * softness * (inside**3 - 0.5 * inside**4 + jnp.maximum(x - 1.0, 0.0))
    return jnp.maximum(spring + damping * inside**2 * (3.0 - 2.0 * inside) * rate, 0.0)


def one_sided_energy(depth: Array, stiffness: Array, softness: Array) -> Array:
    r"""Energy of the spring [J]: $k d_0^2 [\xi^4/4 - \xi^5/10 + y/2 + y^2/2]$ with $y = max(x - 1, 0)$."""
    x = depth / softness
    inside, beyond = jnp.clip(x, 0.0, 1.0), jnp.maximum(x - 1.0, 0.0)
    return stiffness * softness**2 * (0.25 * inside**4 - 0.1 * inside**5 + 0.5 * beyond + 0.5 * beyond**2)


def depth_of_force(force: Array, stiffness: Array, softness: Array) -> Array:
    """Depth at which the spring has a force that is not negative."""
    share = jnp.maximum(force / (stiffness * softness), _NO_FORCE)
    soft = jnp.minimum(share, 0.5)  # reached at x = 1

    def corrected(_: Array, x: Array) -> Array:
        return x - (x**3 - 0.5 * x**4 - soft) / (3.0 * x**2 - 2.0 * x**3)

    # x^3 (1 - x/2) = soft: the start lies above the root, and the curve is convex
    x = jax.lax.fori_loop(0, _ITERATIONS, corrected, jnp.minimum(jnp.cbrt(2.0 * soft), 1.0))
    return softness * (x + share - soft)
