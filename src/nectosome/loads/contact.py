r"""Contact of a body with walls, and of two parts, each a chain of round cones.

Such are rods, cylinders with round ends and spheres. A chain consists of spheres with a linearly varying radius between
nodes. On a cone with the radius $r + k s$ at the distance s along its axis, a point at the distance x along the axis
and y from the axis is nearest to the sphere at

$$ s = x + y \frac{k}{\sqrt{1 - k^2}} $$

or to that at the nearer end. There the distance $|x - c(s)| - r(s)$ has derivative 0 by s, so its gradient by the point
is the direction from c to the point, also for tapered bodies.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import Load, PairLoad, Strips, Water
from nectosome.core.described import numbers, same_named
from nectosome.core.one_sided import Gaps, one_sided_energy, one_sided_force
from nectosome.core.se3 import cross, safe_norm
from nectosome.description import Rigid
from nectosome.description.loads import WallContactLoad
from nectosome.description.pairs import ContactPair
from nectosome.mechanism import SoftRod
from nectosome.mechanism.shapes import shape_of

from .places import AttachedPlaces, Carrier, Points

_STEEPEST = 1 - 1e-9  # for a sphere that contains the next one, the outer end is nearest
_NONE = 1e-30  # [m2] least squared distance of nodes


class Friction(eqx.Module):
    r"""Dry friction with a smooth transition from stick to slip (Brown and McPhee 2016).

    With the sliding velocity v over the `creep` velocity $v_t$, $x = |v|/v_t$, the friction against v is

    $$ F = N \left(\mu_d \tanh 4x + (\mu_s - \mu_d) \frac{x}{(x^2/4 + 3/4)^2}\right) $$

    with the maximum $\mu_s N$ at x = 1. A sticking contact creeps slower than $v_t$.
    """

    static_friction: Float[Array, ""]  # mu_s [-]
    dynamic_friction: Float[Array, ""]  # mu_d [-]
    creep: Float[Array, ""]  # v_t [m/s]

    def force(self, normal: Float[Array, "m"], v: Float[Array, "m 3"]) -> Float[Array, "m 3"]:
        """Force [N] against v for a normal force N."""
        x = safe_norm(v) / self.creep
        still = x == 0
        slips = jnp.where(still, 4.0, jnp.tanh(4.0 * x) / jnp.where(still, 1.0, x))
        more = (self.static_friction - self.dynamic_friction) / (0.25 * x**2 + 0.75) ** 2
        return -((self.dynamic_friction * slips + more) * normal / self.creep)[:, None] * v


class Beads(eqx.Module):
    """Spheres fixed to a part."""

    at: AttachedPlaces
    radius: Float[Array, "m"]  # [m]

    @classmethod
    def sampled(cls, part: Carrier) -> "tuple[Beads, Float[Array, 'm']]":
        """Beads of the part that feels the other, and the share of its length that each stands for."""
        if isinstance(part.body, SoftRod):
            return cls._of_rod(part), part.stations.weight / part.body.length
        assert isinstance(part.limb, Rigid)
        s, w = np.polynomial.legendre.leggauss(1 if shape_of(part.limb).chain()[0] == 1 else part.limb.strips)
        return cls._of_rigid(part, part.limb, 0.5 * (s + 1)), jnp.asarray(0.5 * w)

    @classmethod
    def chain(cls, part: Carrier) -> "Beads":
        """Nodes of the part that is felt; a sphere has the same one twice, a straight cylinder its ends."""
        if isinstance(part.body, SoftRod):
            return cls._of_rod(part)
        assert isinstance(part.limb, Rigid)
        nodes = max(shape_of(part.limb).chain()[0], 2)
        return cls._of_rigid(part, part.limb, np.linspace(0.0, 1.0, nodes))

    @classmethod
    def _of_rod(cls, part: Carrier) -> "Beads":
        n = part.stations.x.shape[0]
        return cls(AttachedPlaces(tuple(range(n)), jnp.zeros((n, 3))), part.stations.radius)

    @classmethod
    def _of_rigid(cls, part: Carrier, limb: Rigid, fractions: Float[np.ndarray, "m"]) -> "Beads":
        p, radius = shape_of(limb).spheres(fractions)
        return cls(AttachedPlaces((0,) * fractions.size, part.from_centre(p)), radius)


class Nearest(NamedTuple):
    """For each point the nearest sphere of the chain, at the fraction `share` from node `segment` to the next."""

    segment: Int[Array, "m"]
    share: Float[Array, "m"]
    normal: Float[Array, "m 3"]  # unit vector from the sphere's centre to the point; 0 at the centre
    distance: Float[Array, "m"]  # from the sphere's surface to the point [m], negative inside


def nearest(points: Float[Array, "m 3"], nodes: Float[Array, "n 3"], radius: Float[Array, "n"]) -> Nearest:
    """Nearest spheres of a chain with at least two nodes; of equally near ones, the one nearer to the root."""
    along, wider = nodes[1:] - nodes[:-1], radius[1:] - radius[:-1]
    square = jnp.maximum(jnp.sum(along * along, axis=-1), _NONE)
    length = jnp.sqrt(square)
    slope = jnp.clip(wider / length, -_STEEPEST, _STEEPEST)
    to = points[:, None] - nodes[:-1]
    x = jnp.sum(to * along, axis=-1) / square
    y = safe_norm(to - x[..., None] * along)
    share = jnp.clip(x + y * slope / (length * jnp.sqrt(1 - slope**2)), 0.0, 1.0)
    share = jnp.where(jnp.abs(wider) >= length, (wider > 0) + 0.0, share)  # the larger end holds all others
    from_axis = to - share[..., None] * along
    far = safe_norm(from_axis)
    distance = far - radius[:-1] - share * wider
    segment = jnp.argmin(distance, axis=1)
    picked = jnp.arange(points.shape[0]), segment
    far = far[picked][:, None]
    normal = from_axis[picked] / jnp.where(far > 0, far, 1.0)
    return Nearest(segment, share[picked], normal, distance[picked])


class PartContact(PairLoad):
    r"""Contact forces between two parts, for each bead of the first part.

    Each bead of the first part, a sphere of radius r_i, is in contact with the nearest sphere of the second part's
    chain, with the centre c between two of its nodes. At penetration $\delta$ the normal force is

    $$ N = w_i \max\left(0,\ k \delta_0 [\xi^3 - \tfrac12 \xi^4 + \max(\delta/\delta_0 - 1, 0)]
       + c\, \xi^2 (3 - 2 \xi)\, \dot\delta\right), \quad \xi = clip(\delta/\delta_0, 0, 1) $$

    with `Friction` along the surfaces, halfway between them. The opposite force acts on the second part, distributed to
    the two nodes by linear interpolation, with the same moment; velocities of the second part are interpolated in the
    same way, so that forces, moments and powers are those of one force at one point. The weights w_i sum to 1: k is the
    stiffness of the first part under uniform pressure over its length; for partial contact, the forces converge with
    the number of beads to those of a stiffness per length.

    Approximations: sections are round; ends are half spheres. A bead contacts only the nearest sphere: between two
    segments of a bent chain the force direction jumps by their angle. A body thinner than the bead distance can pass
    between beads; therefore the first part is the one with more strips. Intersecting axes give no force direction.
    """

    beads: Beads
    share: Float[Array, "m"]  # w
    chain: Beads  # of the second part, at least two
    stiffness: Float[Array, ""]  # k [N/m]
    damping: Float[Array, ""]  # c [N s/m]
    softness: Float[Array, ""]  # delta_0 [m]
    friction: Friction
    described_by = ContactPair

    @classmethod
    def from_description(cls, described: ContactPair, first: Carrier, second: Carrier) -> "PartContact":
        """Of the shapes of two parts."""
        beads, share = Beads.sampled(first)
        return cls(
            beads=beads,
            share=share,
            chain=Beads.chain(second),
            **numbers(described, "stiffness", "damping", "softness"),
            friction=same_named(Friction, described),
        )

    def _meet(self, first: Strips, second: Strips) -> tuple[Points, Points, Nearest]:
        """Beads, nodes, and the nearest sphere of the chain to each bead."""
        a, b = self.beads.at.points(first), self.chain.at.points(second)
        return a, b, nearest(a.position, b.position, self.chain.radius)

    def force(self, first: Strips, second: Strips) -> tuple[Float[Array, "n 6"], Float[Array, "m 6"]]:
        """Wrenches of normal forces and friction."""
        a, b, met = self._meet(first, second)
        near, far = (met.segment, 1.0 - met.share), (met.segment + 1, met.share)
        depth, r = self.beads.radius - met.distance, self.chain.radius
        r = r[met.segment] + met.share * (r[met.segment + 1] - r[met.segment])
        # from the beads' centres, and from c, to the middle of the two surfaces
        arm = (0.5 * depth - self.beads.radius)[:, None] * met.normal
        other = (r - 0.5 * depth)[:, None] * met.normal
        v = a.velocity + cross(a.angular_velocity, arm)
        for node, part in (near, far):
            v = v - part[:, None] * (b.velocity[node] + cross(b.angular_velocity[node], other))
        apart = jnp.sum(v * met.normal, axis=-1)
        normal = self.share * one_sided_force(depth, -apart, self.stiffness, self.damping, self.softness)
        force = normal[:, None] * met.normal + self.friction.force(normal, v - apart[:, None] * met.normal)
        forces, moments = (jnp.zeros_like(b.position) for _ in range(2))
        for node, part in (near, far):
            forces = forces.at[node].add(-part[:, None] * force)
            moments = moments.at[node].add(-part[:, None] * cross(other, force))
        return (
            self.beads.at.wrenches(first, force, cross(arm, force)),
            self.chain.at.wrenches(second, forces, moments),
        )

    def gaps(self, first: Strips, second: Strips) -> Gaps:
        """Distances from the beads to the chain."""
        apart = self._meet(first, second)[2].distance - self.beads.radius
        return Gaps.of(apart / self.softness, self.stiffness, self.damping)

    def overlap(self, first: Strips, second: Strips) -> Float[Array, ""]:
        """Of the deepest bead; 1 where the thinner part's axis is at the surface of the other."""
        met, r = self._meet(first, second)[2], self.chain.radius
        r = r[met.segment] + met.share * (r[met.segment + 1] - r[met.segment])
        thinner = jnp.minimum(self.beads.radius, r)
        return jnp.max(jnp.where(thinner > 0, (self.beads.radius - met.distance) / jnp.maximum(thinner, _NONE), 0.0))

    def energy(self, first: Strips, second: Strips) -> Float[Array, ""]:
        """Energy of the contact springs [J]."""
        *_, met = self._meet(first, second)
        return jnp.sum(self.share * one_sided_energy(self.beads.radius - met.distance, self.stiffness, self.softness))


class WallContact(Load):
    r"""Compliant contact with the walls of the tank, which are normal to the world's x axis.

    The ends of the body are `reach` ahead of and behind the centre. At penetration $\delta$ with the velocity v into
    the wall, the force is

    $$ F = \max(k \delta + \xi c v,\ 0), \quad \xi = \min(\delta/\delta_0, 1) $$

    away from it, through the centre, without friction. Zero without walls.
    """

    reach: Float[Array, ""]  # [m]
    stiffness: Float[Array, ""]  # k [N/m]
    damping: Float[Array, ""]  # c [N s/m]
    softness: Float[Array, ""]  # delta_0 [m]
    on_first = True
    described_by = WallContactLoad
    deep = "is in a wall by {} times its reach"

    def depths(self, x: Float[Array, ""], water: Water) -> Float[Array, "2"]:
        """Penetration of a body with its centre at x into the first and the second wall [m]; negative: no contact."""
        assert water.walls is not None
        return jnp.stack([water.walls[0] - x + self.reach, x + self.reach - water.walls[1]])

    def gaps(self, strips: Strips, z: Any, water: Water) -> Gaps | None:
        """Distances to the walls."""
        if water.walls is None:
            return None
        gap = -self.depths(strips.position[0, 0], water) / self.softness
        return Gaps.of(gap, self.stiffness, self.damping, ramp=True)

    def overlap(self, strips: Strips, z: Any, water: Water) -> Float[Array, ""]:
        """Of the deeper end; 1 where the part's centre is at the wall."""
        if water.walls is None:
            return jnp.zeros(())
        return jnp.max(self.depths(strips.position[0, 0], water)) / self.reach

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Force of the walls on the centre."""
        if water.walls is None:
            return jnp.zeros((strips.weight.shape[0], 6)), z
        v, R = strips.velocity[0], strips.rotation[0]
        speed = sum(R[0, i] * v[i] for i in range(3))
        if water.current is not None:
            speed = speed + water.flow(t, strips.position[:1])[0][0, 0]
        depth = self.depths(strips.position[0, 0], water)
        into = jnp.stack([-speed, speed])
        grip = jnp.clip(depth / self.softness, 0.0, 1.0)
        push = jnp.maximum(self.stiffness * jnp.maximum(depth, 0.0) + grip * self.damping * into, 0.0)
        fx = push[0] - push[1]
        none = jnp.zeros(())
        return strips.at_first(jnp.stack([none, none, none, *(R[0, i] * fx for i in range(3))])), z
