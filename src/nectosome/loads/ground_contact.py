r"""A point on the ground: a compliant, damped contact with friction that sticks and slips (Giorgio-Serchi et al. 2017).

What touches is a massless foot on a spring and damper, the same in all directions. Numbers are scalars, each of its
own: batches of them fill vector registers.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

Pair = tuple[Array, Array]
Triple = tuple[Array, Array, Array]
_FALL = 0.05  # of the normal force: by how much more than static friction is asked for where it has fallen to dynamic


class GroundContact(eqx.Module):
    r"""Ground that a point at depth $\delta$ and velocity v pushes on through a spring k and a damper c.

    $$ N = k \delta - \xi c\, v_z, \quad \xi = \min(\delta/\delta_0, 1), \quad
       f = k e - c\, v_h, \quad |F_h| \le \mu N $$

    The damper grows over the softness $\delta_0$, so that the force is continuous. e is how far the spring is
    stretched along the ground: while the foot sticks $\dot e = -v_h$, and in any case $\dot e = (F_h - k e)/c$, in the
    air too, where the spring relaxes. Beyond static friction $\mu$ falls to dynamic friction as
    $\mu_d + (\mu_s - \mu_d) \exp(-(|f|/N - \mu_s)/0.05)$, a Stribeck curve. N only pushes, unless the foot `pulls` as
    long as it is below ground, through the damper; what pulls has no friction.
    """

    stiffness: Float[Array, ""]  # k [N/m]
    static_friction: Float[Array, ""]  # mu_s [-]
    dynamic_friction: Float[Array, ""]  # mu_d [-]
    softness: Float[Array, ""]  # delta_0 [m]
    pulls: bool = eqx.field(static=True)

    def grip(self, depth: Float[Array, ""]) -> Float[Array, ""]:
        """Share xi of the damper that works at a depth [m], negative above ground."""
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
