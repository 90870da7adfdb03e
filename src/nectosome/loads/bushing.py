"""A stiff bushing between points of two parts: closes kinematic loops."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import PairLoad, Strips
from nectosome.core.described import numbers, vector
from nectosome.core.se3 import compose, cross, dot, matmul3, rotation_from_rpy
from nectosome.description.pairs import BushingPair
from nectosome.mechanism import SoftRod

from .places import AttachedPlaces, Carrier


class BushingEnd(eqx.Module):
    """Where a bushing is fixed to a part."""

    at: AttachedPlaces  # a single one
    rotation: Float[Array, "3 3"]  # the bushing's axes in the frame of that station

    @classmethod
    def on(cls, part: Carrier, at: str | float, offset: Float[Array, "3"]) -> "BushingEnd":
        """At a node of a rod, or at a place of a rigid part against its centre."""
        if isinstance(part.body, SoftRod):
            return cls(AttachedPlaces((part.station(at),), offset[None]), jnp.eye(3))
        base = (part.body.tip_rotation, part.body.tip_position) if at == "tip" else (jnp.eye(3), jnp.zeros(3))
        R, p = compose(base, (jnp.eye(3), offset))
        return cls(AttachedPlaces((0,), part.from_centre(p[None])), matmul3(part.body.rotation[0].T, R))


class Bushing(PairLoad):
    r"""A linear spring and damper against the distance, and against the relative rotation, of two frames.

    With d from the first point to the second, and the velocity w of the second part relative to the first at the middle
    m between them, the force on the first part is

    $$ F = k\, d + c\, w $$

    at m, and -F on the second, so that forces and moments cancel for any d. With the rotation R of the second frame
    relative to the first, $[e]_\times = (R - R^\top)/2$, which is $\sin\theta$ along the axis of the rotation $\theta$,
    the moment on the first part is

    $$ M = k_t\, e + c_t\, (\omega_2 - \omega_1) $$

    The energy is $k |d|^2/2 + k_t (1 - \cos\theta)$. Without k_t and c_t it is a ball joint, with them a weld.
    """

    first: BushingEnd
    second: BushingEnd
    stiffness: Float[Array, ""]  # k [N/m]
    damping: Float[Array, ""]  # c [N s/m]
    turning_stiffness: Float[Array, ""]  # k_t [N m/rad]
    turning_damping: Float[Array, ""]  # c_t [N m s/rad]
    described_by = BushingPair

    @classmethod
    def from_description(cls, described: BushingPair, first: Carrier, second: Carrier) -> "Bushing":
        """Between places of two parts, the second turned against the first."""
        places = zip((first, second), described.at, described.offset, strict=True)
        one, other = (BushingEnd.on(part, at, vector(offset)) for part, at, offset in places)
        turned = matmul3(one.rotation, rotation_from_rpy(vector(described.rotation)))
        stiff = numbers(described, "stiffness", "damping", "turning_stiffness", "turning_damping")
        return cls(BushingEnd(one.at, turned), other, **stiff)

    def _turn(self, first: Strips, second: Strips) -> tuple[Array, Array]:
        """Axes of the first end, and the rotation of the second end relative to them; [3, 3] each."""
        ends = (self.first, first), (self.second, second)
        A, B = (matmul3(strips.rotation[end.at.station[0]], end.rotation) for end, strips in ends)
        return A, matmul3(A.T, B)

    def force(self, first: Strips, second: Strips) -> tuple[Float[Array, "n 6"], Float[Array, "m 6"]]:
        """Wrenches that reduce distance and relative rotation."""
        a, b = self.first.at.points(first), self.second.at.points(second)
        d = b.position - a.position
        spin = b.angular_velocity - a.angular_velocity
        apart = b.velocity - a.velocity - 0.5 * cross(a.angular_velocity + b.angular_velocity, d)
        pull = self.stiffness * d + self.damping * apart
        A, R = self._turn(first, second)
        e = 0.5 * jnp.stack([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        turn = self.turning_stiffness * dot(A, e) + self.turning_damping * spin
        arm = 0.5 * cross(d, pull)
        return self.first.at.wrenches(first, pull, arm + turn), self.second.at.wrenches(second, -pull, arm - turn)

    def energy(self, first: Strips, second: Strips) -> Float[Array, ""]:
        """Energy of both springs [J]."""
        d = self.second.at.points(second).position - self.first.at.points(first).position
        _, R = self._turn(first, second)
        turned = 0.5 * (3.0 - jnp.trace(R))
        return 0.5 * self.stiffness * jnp.sum(d * d) + self.turning_stiffness * turned
