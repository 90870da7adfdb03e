r"""Contact of a point with the ground: compliant, damped, with stick-slip friction (Giorgio-Serchi et al. 2017).

The contact point is a massless foot on a spring and damper, isotropic. Components are separate scalars, so that batches
of them fill vector registers.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

Pair = tuple[Array, Array]
Triple = tuple[Array, Array, Array]
_FALL = 0.05  # decay constant of the Stribeck curve over the normal force


class GroundContact(eqx.Module):
    r"""Ground under a point at depth $\delta$ with velocity v, with a spring k and a damper c.

    $$ N = k \delta - \xi c\, v_z, \quad \xi = \min(\delta/\delta_0, 1), \quad
       f = k e - c\, v_h, \quad |F_h| \le \mu N $$

    The damping grows over the softness $\delta_0$, so that the force is continuous. e is the stretch of the spring
    along the ground: $\dot e = (F_h - k e)/c$ always, which is $-v_h$ during sticking and relaxation in the air. Beyond
    static friction $\mu$ decays to dynamic friction as $\mu_d + (\mu_s - \mu_d) \exp(-(|f|/N - \mu_s)/0.05)$, a
    Stribeck curve. N is never negative, unless the foot `pulls` through the damper below ground; a pulling foot has no
    friction.
    """

    stiffness: Float[Array, ""]  # k [N/m]
    static_friction: Float[Array, ""]  # mu_s [-]
    dynamic_friction: Float[Array, ""]  # mu_d [-]
    softness: Float[Array, ""]  # delta_0 [m]
    pulls: bool = eqx.field(static=True)

    def grip(self, depth: Float[Array, ""]) -> Float[Array, ""]:
        """Fraction xi of the damping at a depth [m], negative above ground."""
        return jnp.clip(depth / self.softness, 0.0, 1.0)

    def force(
        self, depth: Float[Array, ""], v: Triple, stretch: Pair, damping: Float[Array, ""]
    ) -> tuple[Triple, Pair]:
        """Force of the ground on the point [N] and rate of the stretch e [m/s], world axes; damping is c [N s/m]."""
        up = self.stiffness * jnp.maximum(depth, 0.0) - self.grip(depth) * damping * v[2]
        push = jnp.maximum(up, 0.0)
        fx, fy = (self.stiffness * e - damping * w for e, w in zip(stretch, v[:2], strict=True))
        square = fx * fx + fy * fy
        still = square == 0
        asked = jnp.sqrt(jnp.where(still, 1.0, square))
        beyond = asked / jnp.where(push > 0, push, 1.0) - self.static_friction
        friction = self.dynamic_friction + (self.static_friction - self.dynamic_friction) * jnp.exp(
            -jnp.maximum(beyond, 0.0) / _FALL
        )
        share = jnp.where(still, 1.0, jnp.minimum(friction * push / asked, 1.0))
        fx, fy = share * fx, share * fy
        rate = (fx - self.stiffness * stretch[0]) / damping, (fy - self.stiffness * stretch[1]) / damping
        return (fx, fy, up if self.pulls else push), rate
