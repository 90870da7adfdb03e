"""A crank-driven leg (three-bar mechanism) on compliant ground and in water (Giorgio-Serchi et al. 2017).

Components are separate scalars, so that batches of them fill vector registers.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import CrankRate, CrankState, Gaps, Load, Strips, Water
from nectosome.core.described import number, numbers, vector
from nectosome.core.linear_algebra import computed_once
from nectosome.description.cranks import LegLoad

from .places import Carrier

Pair = tuple[Array, Array]
Triple = tuple[Array, Array, Array]
_FALL = 0.05  # decay constant of the Stribeck curve over the normal force


class GroundContact(eqx.Module):
    r"""Ground under a massless foot at depth $\delta$ with velocity v, on an isotropic spring k and damper c.

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
        size = jnp.sqrt(jnp.where(still, 1.0, square))
        beyond = size / jnp.where(push > 0, push, 1.0) - self.static_friction
        friction = self.dynamic_friction + (self.static_friction - self.dynamic_friction) * jnp.exp(
            -jnp.maximum(beyond, 0.0) / _FALL
        )
        share = jnp.where(still, 1.0, jnp.minimum(friction * push / size, 1.0))
        fx, fy = share * fx, share * fy
        rate = (fx - self.stiffness * stretch[0]) / damping, (fy - self.stiffness * stretch[1]) / damping
        return (fx, fy, up if self.pulls else push), rate


class Stride(NamedTuple):
    """State of a leg."""

    crank: Float[Array, ""]  # angle of the crank [rad], from forward (x) to up (z)
    stretch: Float[Array, "2"]  # of the leg along the ground, world axes [m]


class Leg(Load):
    r"""A massless leg of length L from the pin of a crank through a bearing (Giorgio-Serchi et al. 2017, Figs. 3, 4).

    In the x-z plane of the body: the pin of the crank is at $P = O + r (\cos\phi, \sin\phi)$, the leg slides through
    the bearing B, and its foot is at $q = P + L (B - P)/|B - P|$. The foot has a `GroundContact` with the damping $c =
    2 d_r \sqrt{k m}$, m the mass of the body, and in the water the drag

    $$ F = -\lambda_t |v_t| v_t - \lambda_n |v_n| v_n $$

    along and across the leg. Without a floor there is only this drag. One leg represents `count` legs side by side. The
    speed of the crank is prescribed, or a joint turns it; the force F of ground and water on the foot q, a function of
    the crank's angle, then gives the torque $F \cdot \partial q/\partial\phi$ on that joint (virtual work).
    """

    hip: Float[Array, "3"]  # O, from the station, body frame [m]
    crank: Float[Array, ""]  # r [m]
    bearing: Float[Array, "2"]  # B - O along x and z of the body [m]
    length: Float[Array, ""]  # L [m]
    speed: Float[Array, ""] | None  # d phi/dt [rad/s]; None: that of a joint
    start: Float[Array, ""]  # phi at the start, or at the angle 0 of the joint [rad]
    contact: GroundContact
    damping_ratio: Float[Array, ""]  # d_r [-]
    tangential: Float[Array, ""]  # lambda_t [kg/m]
    normal: Float[Array, ""]  # lambda_n [kg/m]
    count: Float[Array, ""]
    on_first = True
    described_by = LegLoad
    deep = "has a foot in the floor by {} times the length of the leg below its bearing"

    @classmethod
    def from_description(cls, described: LegLoad, part: Carrier) -> "Leg":
        """Of a description, whose hip is in the frame of the part."""
        ground = numbers(described, "stiffness", "static_friction", "dynamic_friction", "softness")
        own = ("bearing", "crank", "length", "start", "damping_ratio", "tangential", "normal", "count")
        return cls(
            hip=part.from_centre(vector(described.hip)),
            speed=None if described.speed is None else number(described.speed),
            contact=GroundContact(**ground, pulls=described.pulls),
            **numbers(described, *own),
        )

    def initial(self) -> Any:
        """Start angle of the crank, relaxed leg; without the angle where a joint turns the crank."""
        return jnp.zeros(2) if self.speed is None else Stride(self.start, jnp.zeros(2))

    def crank_speed(self) -> Float[Array, ""] | None:
        """That of its crank, if no joint turns it."""
        return self.speed

    def turning(self, z: Any) -> tuple[Array, Array, Array]:
        """Angle [rad] and speed [rad/s] of the crank, and the stretch [m]."""
        if isinstance(z, CrankState):
            return self.start + z.angle, z.speed, z.own
        assert self.speed is not None
        return z.crank, self.speed, z.stretch

    def foot(self, crank: Float[Array, ""]) -> tuple[Pair, Pair, Pair]:
        """Foot from O [m], its derivative by the crank's angle [m], and the leg's direction; along x, z of the body."""
        c, s = computed_once(jnp.stack([jnp.cos(crank), jnp.sin(crank)]))
        px, pz = self.crank * c, self.crank * s
        ux, uz = self.bearing[0] - px, self.bearing[1] - pz
        far = jnp.sqrt(ux * ux + uz * uz)
        ux, uz = ux / far, uz / far
        dpx, dpz = -pz, px
        # the leg's rotation by the transverse motion of the pin
        turn = self.length / far * (uz * dpx - ux * dpz)
        q = px + self.length * ux, pz + self.length * uz
        return q, (dpx - turn * uz, dpz + turn * ux), (ux, uz)

    def gaps(self, strips: Strips, z: Any, water: Water) -> Gaps | None:
        """Height of the foot over the floor."""
        if water.floor is None:
            return None
        damping = 0.0 if self.contact.pulls else self._damping(strips)
        height = -self._depth(strips, self.foot(self.turning(z)[0])[0], water.floor)
        return Gaps.of(height[None] / self.contact.softness, self.contact.stiffness, damping, ramp=True)

    def overlap(self, strips: Strips, z: Any, water: Water) -> Float[Array, ""]:
        """Of the foot; 1 where the bearing of an upright leg is at the floor."""
        if water.floor is None:
            return jnp.zeros(())
        (x, h), _, (ux, uz) = self.foot(self.turning(z)[0])
        below = ux * (x - self.bearing[0]) + uz * (h - self.bearing[1])
        depth = self._depth(strips, (x, h), water.floor)
        return depth / jnp.where(below > 0, below, self.length)  # a foot above its bearing has the whole leg

    def _depth(self, strips: Strips, foot: Pair, floor: Array) -> Float[Array, ""]:
        """That of a foot below the floor [m], negative above it."""
        x, h = foot
        place = self.hip + jnp.stack([x, jnp.zeros(()), h])
        return floor - strips.position[0, 2] - jnp.sum(strips.rotation[0, 2] * place)

    def _damping(self, strips: Strips) -> Float[Array, ""]:
        """That of the ground, c [N s/m]."""
        return 2 * self.damping_ratio * jnp.sqrt(self.contact.stiffness * strips.inertia[0, 3, 3])

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on the first station, and the rates of the crank and the stretch, or the torque on the crank."""
        angle, speed, stretch = self.turning(z)
        (x, h), (gx, gh), (ux, uz) = self.foot(angle)
        dx, dh = speed * gx, speed * gh
        x, y, h = x + self.hip[0], self.hip[1], h + self.hip[2]
        w, v = strips.angular_velocity[0], strips.velocity[0]
        vx, vy, vz = v[0] + w[1] * h - w[2] * y + dx, v[1] + w[2] * x - w[0] * h, v[2] + w[0] * y - w[1] * x + dh
        along = ux * vx + uz * vz
        ax, az = vx - along * ux, vz - along * uz
        scull_t, scull_n = self.tangential * jnp.abs(along) * along, self.normal * _length(ax, vy, az)
        fx, fy, fz = -scull_t * ux - scull_n * ax, -scull_n * vy, -scull_t * uz - scull_n * az
        rate = -stretch
        if water.floor is not None:
            R, p = strips.rotation[0], strips.position[0]
            depth = water.floor - p[2] - R[2, 0] * x - R[2, 1] * y - R[2, 2] * h
            drift = jnp.zeros(3) if water.current is None else water.flow(t, strips.position)[0][0]
            sx, sy, sz = (R[i, 0] * vx + R[i, 1] * vy + R[i, 2] * vz + drift[i] for i in range(3))
            damping = self._damping(strips)
            (nx, ny, nz), rate = self.contact.force(depth, (sx, sy, sz), (stretch[0], stretch[1]), damping)
            rate = jnp.stack(rate)
            free = 1 - self.contact.grip(depth)
            fx, fy, fz = (free * f + R[0, i] * nx + R[1, i] * ny + R[2, i] * nz for i, f in enumerate((fx, fy, fz)))
        fx, fy, fz = self.count * fx, self.count * fy, self.count * fz
        wrench = jnp.stack([y * fz - h * fy, h * fx - x * fz, x * fy - y * fx, fx, fy, fz])
        on_first = strips.at_first(wrench)
        return on_first, CrankRate(fx * gx + fz * gh, rate) if isinstance(z, CrankState) else Stride(speed + 0.0, rate)


def _length(x: Array, y: Array, z: Array) -> Array:
    """Length of a vector, with derivative 0 at 0."""
    square = x * x + y * y + z * z
    none = square == 0
    return jnp.where(none, 0.0, jnp.sqrt(jnp.where(none, 1.0, square)))
