r"""The jet of a bell: a ring of limbs with a web, which drives water out of its opening as it closes.

The places of the web's strips are joined to a surface, which flat fans close at the roots and at the tips: a volume V
that is smooth in these places p. With the area vector S of the opening, which points out of the bell, c of it the area
of the jet, and the velocities $\dot p$ of the strips relative to the water,

$$ W = \sqrt{V^2 + V_0^2} - V_0, \quad Q = -\sum \frac{\partial W}{\partial p} \cdot \dot p, \quad
u = \frac{Q}{c |S|}, \quad F_p = \tfrac12 \rho\, u |u|\, \frac{\partial W}{\partial p} $$

The water within has the mass $\rho W$ and moves with the roots. Leaving water has their velocity v and the jet's, so
that the bell has the thrust $\rho Q u$ along -S, through the middle of the opening, and $-\rho Q v$. Water that enters
comes from all around, at rest; `refill` r is the share of $-\rho |Q| |u|$ that it pulls the bell back with. The power
of the pressure forces F is $-\tfrac12 \rho u^2 |Q|$: that of the jet (slug model; Daniel 1983).

A bell that opens beyond a flat disc holds its water on the other side. $V_0$, a thousandth of the cube of the limbs'
length, makes this smooth; the thrust has the factor $V/\sqrt{V^2 + V_0^2}$.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Assumed, Flow, ReshapingLoad, Strips, Water, safe_norm, wetted
from nectosome.core.described import numbers
from nectosome.core.se3 import cross, dot, dot_t
from nectosome.description.loads import BellJetLoad
from nectosome.mechanism.webs import ACROSS, APART

from .places import SheetCarrier

_FLAT = 1e-3  # V_0 over the cube of the length


class BellWater(NamedTuple):
    """The water in a bell at one time."""

    volume: Float[Array, ""]  # W [m3]
    outflow: Float[Array, ""]  # Q [m3/s], negative as it fills
    jet_speed: Float[Array, ""]  # u [m/s], relative to the bell
    area: Float[Array, ""]  # of the opening, |S| [m2]
    out: Float[Array, "3"]  # S/|S| V/sqrt(V^2 + V_0^2), world axes
    top: Float[Array, "3"]  # middle of the strips next to the roots, world frame [m]
    middle: Float[Array, "3"]  # of the opening
    slope: Float[Array, "n 3"]  # of W by the places of the strips [m2]


class BellJet(ReshapingLoad):
    """Pressure, thrust and water of a bell (see above); strips of a web lie gap by gap, from roots to tips, by twos.

    Of a ring with one limb for all there are the strips of one gap, and what turns them in the world to all gaps.
    """

    ends: Float[Array, "2 n"]  # weights of the places along a gap that give the place of the root and that of the tip
    flat: Float[Array, ""]  # V_0 [m3]
    contraction: Float[Array, ""]  # c [-]
    refill: Float[Array, ""]  # r [-]
    to_all: Float[Array, "gaps 3 4"] | None = None  # rotation and shift [m]; None where all gaps are there
    driven = True
    described_by = BellJetLoad

    @classmethod
    def from_description(cls, described: BellJetLoad, part: SheetCarrier) -> "BellJet":
        """Of a web that is a ring, whose edges at roots and tips go on straight from the strips next to them."""
        assert part.gaps is not None
        ring = part.gaps
        x, n = ring.along, len(ring.along)
        ends = jnp.zeros((2, n))
        for row, (at, one, two) in enumerate(((0.0, 0, 1), (1.0, n - 1, n - 2))):
            share = (at - x[one]) / (x[two] - x[one])
            ends = ends.at[row, one].set(1 - share).at[row, two].set(share)
        return cls(ends, _FLAT * ring.length**3, **numbers(described, "contraction", "refill"), to_all=ring.to_all)

    def carried(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "n 6 6"], Float[Array, "n 6 6"]]:
        """Mass of the water within, evenly on the strips next to the roots, and its rate."""
        now = self.water(strips)
        one = self._roots(strips)[:, None, None] * jnp.diag(jnp.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]))
        return water.density * now.volume * one, -water.density * now.outflow * one

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Pressure on all strips; thrust, and the momentum of water that leaves, on those next to the roots."""
        now, roots = self.water(strips), self._roots(strips)
        density = water.density * (1.0 if water.surface is None else jnp.mean(wetted(t, strips, water)))
        leaves = jnp.maximum(now.outflow, 0.0)
        pressure = 0.5 * density * now.jet_speed * jnp.abs(now.jet_speed)
        flux = density * now.outflow * jnp.abs(now.jet_speed) * jnp.where(now.outflow > 0, 1.0, self.refill)
        thrust = -flux * now.out
        moment = cross(now.middle - now.top, thrust)
        f = pressure * now.slope + roots[:, None] * thrust
        own = dot_t(strips.rotation, f) - density * leaves * roots[:, None] * strips.velocity
        return jnp.concatenate([dot_t(strips.rotation, roots[:, None] * moment), own], axis=1), z

    def water(self, strips: Strips) -> BellWater:
        """The water within, by places and velocities of the strips."""
        (volume, (rings, signed)), slope = jax.value_and_grad(self._volume, has_aux=True)(strips.position)
        outflow = -jnp.sum(slope * dot(strips.rotation, strips.velocity))
        middle, top = self._centre(rings[-1, :-1]), self._centre(self._strips(strips.position)[:, 0].reshape(-1, 3))
        opening = self._sum(0.5 * jnp.sum(_to_next(rings[-1] - middle), axis=0))
        area = safe_norm(opening)
        out = signed / jnp.sqrt(signed**2 + self.flat**2) * opening / area
        jet_speed = outflow / (self.contraction * area)
        return BellWater(volume, outflow, jet_speed, area, out, top, middle, slope / self._alike)

    def flow(self, strips: Strips) -> Flow:
        """Of the jet, with the diameter of a circle of its area."""
        now = self.water(strips)
        diameter = jnp.sqrt(4 / jnp.pi * self.contraction * now.area)[None]
        return Flow(jnp.abs(now.jet_speed)[None], diameter, jet=now.jet_speed / diameter)

    def assumed(self, described: BellJetLoad, water: Water) -> tuple[Assumed, ...]:
        """Its coefficients."""
        known = {
            "contraction": Assumed("jet's share of the opening", self.contraction, "slug model"),
            "refill": Assumed("momentum of what enters", self.refill, "from all around"),
        }
        return tuple(one for name, one in known.items() if name not in described.model_fields_set)

    def _volume(self, place: Float[Array, "n 3"]) -> tuple[Float[Array, ""], tuple[Array, Float[Array, ""]]]:
        """W [m3], with its rings and V."""
        rings = self._rings(place)
        signed = self._enclosed(rings)
        return jnp.sqrt(signed**2 + self.flat**2) - self.flat, (rings, signed)

    @property
    def _alike(self) -> int:
        """Number of gaps for which each one stands."""
        return 1 if self.to_all is None else self.to_all.shape[0]

    def _centre(self, points: Float[Array, "k 3"]) -> Float[Array, "3"]:
        """Mean of points of all gaps, in the world."""
        mean = jnp.mean(points, axis=0)
        if self.to_all is None:
            return mean
        turn = jnp.mean(self.to_all, axis=0)
        return dot(turn[:, :3], mean) + turn[:, 3]

    def _sum(self, vector: Float[Array, "3"]) -> Float[Array, "3"]:
        """Sum over all gaps of what one adds, or all."""
        return vector if self.to_all is None else dot(jnp.sum(self.to_all[..., :3], axis=0), vector)

    def _strips(self, place: Float[Array, "m 3"]) -> Float[Array, "gaps n 2 3"]:
        return place.reshape(-1, self.ends.shape[1], 2, 3)

    def _rings(self, place: Float[Array, "m 3"]) -> Float[Array, "rings corners 3"]:
        """The edges of gaps, around at the roots, at each place along the limbs, and at the tips, and the one after."""
        strip = self._strips(place)
        way = (strip[:, :, 1] - strip[:, :, 0]) / APART
        first = strip[:, :, 0] - float(ACROSS[0]) * way
        edges = jnp.stack([first, first + way], axis=1).reshape(-1, self.ends.shape[1], 3)
        after = edges[:1]
        if self.to_all is not None:
            after = dot(self.to_all[1, :, :3], after) + self.to_all[1, :, 3]
        edges = jnp.concatenate([edges, after])
        root, tip = jnp.sum(self.ends[:, None, :, None] * edges, axis=2)
        return jnp.concatenate([root[None], jnp.swapaxes(edges, 0, 1), tip[None]])

    def _enclosed(self, rings: Float[Array, "rings corners 3"]) -> Float[Array, ""]:
        """Volume within rings and flat fans over the first and the last [m3], positive where the last turns outward.

        Sides are ruled surfaces, whose volume is the mean of that with both diagonals.
        """
        origin = self._centre(rings[:, :-1].reshape(-1, 3))  # so that digits do not go with the place in the world
        first, last = (self._centre(ring[:-1]) - origin for ring in (rings[0], rings[-1]))
        rings = rings - origin
        a, b, c, d = rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]
        sides = 0.5 * jnp.sum(cross(a, b) * (c + d) + cross(c, d) * (a + b))
        ends = jnp.sum(_to_next(rings[-1]) * last) - jnp.sum(_to_next(rings[0]) * first)
        return self._alike * (sides + ends) / 6

    def _roots(self, strips: Strips) -> Float[Array, "n"]:
        """Equal shares of the strips next to the roots, 0 of the others."""
        n = self.ends.shape[1]
        gaps = strips.weight.shape[0] // (2 * n)
        return jnp.zeros((gaps, n, 2)).at[:, 0].set(0.5 / (gaps * self._alike)).ravel()


def _to_next(ring: Float[Array, "corners 3"]) -> Float[Array, "sides 3"]:
    """Vector product of each corner and the next."""
    return cross(ring[:-1], ring[1:])
