"""Friction of the water along slender bodies, also those that undulate."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Assumed, Flow, Load, Strips, Water, wetted
from nectosome.core.described import number
from nectosome.description.loads import SkinFrictionLoad

from .places import Carrier

_THINNED = 2.7  # Taylor (1952), whose force per length is 1/2 rho d U^2 5.4 Re^-1/2 cos(a) sin(a)^1/2


def friction_coefficient(reynolds: Float[Array, "*n"]) -> Float[Array, "*n"]:
    r"""Friction coefficient of one side of a plate by its Reynolds number along the flow.

    The larger one of laminar flow, $1.328/\sqrt{Re}$ (Blasius 1908), and of a boundary layer that turns turbulent at
    5e5, $0.455/(\log_{10} Re)^{2.58} - 1700/Re$ (Prandtl and Schlichting; Schlichting 1979, eq. 21.16).
    """
    reynolds = jnp.maximum(reynolds, 1.0)
    above = jnp.maximum(reynolds, 1e4)
    return jnp.maximum(1.328 / jnp.sqrt(reynolds), 0.455 / jnp.log10(above) ** 2.58 - 1700 / above)


FRICTION_LAW = Assumed("friction", "laminar, turbulent", "Schlichting 1979")


class SkinFriction(Load):
    r"""Friction along a body per length, against its velocity u along its axis through the water.

    Of a body that goes straight ahead it is that of a plate of its length L, $f_1 = \tfrac12 \rho C_f(Re_L) p\,u^2$
    with the perimeter p of the section (see `friction_coefficient`). One that moves across at w as well has a thinner
    boundary layer (Bone; Lighthill 1971), of a yawed cylinder (Taylor 1952)

    $$ f_2 = 2.7\, \rho\, u \sqrt{\nu\, d\, w} $$

    with d, here of the circle with the same perimeter. Both limits are kept: $f = \sqrt{f_1^2 + f_2^2}$.
    """

    length: Float[Array, ""]  # L, of the whole body along the flow [m]
    dissipative = by_station = mild = True
    described_by = SkinFrictionLoad

    @classmethod
    def from_description(cls, described: SkinFrictionLoad, part: Carrier) -> "SkinFriction":
        """Of a part; without a length that of the part."""
        return cls(number(part.length if described.length is None else described.length))

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each station [N m, N]."""
        u, (ry, rz) = strips.velocity[:, 0], strips.half_width.T
        perimeter = jnp.where(strips.round_axes < 1, 4 * (ry + rz), _ellipse_perimeter(ry, rz))
        kinematic = water.viscosity / water.density
        ahead = 0.5 * friction_coefficient(jnp.abs(u) * self.length / kinematic) * perimeter * jnp.abs(u)
        across = jnp.sum(strips.velocity[:, 1:] ** 2, axis=-1)
        w = jnp.sqrt(jnp.where(across > 0, across, 1.0)) * (across > 0)
        squared = ahead**2 + _THINNED**2 * kinematic * perimeter / jnp.pi * w
        rate = jnp.sqrt(jnp.where(squared > 0, squared, 1.0)) * (squared > 0)
        f = -water.density * wetted(strips, water) * strips.weight * rate * u
        return jnp.zeros((f.shape[0], 6)).at[:, 3].set(f), z

    def flow(self, strips: Strips) -> Flow:
        """Of the length of the whole body."""
        speed = jnp.abs(strips.velocity[:, 0])
        return Flow(speed, jnp.broadcast_to(self.length, speed.shape))

    def assumed(self, described: SkinFrictionLoad, water: Water) -> tuple[Assumed, ...]:
        """Its law; without a length that of the part."""
        length = (Assumed("length", self.length, "of the part", "m"),) * (described.length is None)
        return *length, FRICTION_LAW, Assumed("moving across", "thinner layer", "Taylor 1952")


def _ellipse_perimeter(a: Float[Array, "n"], b: Float[Array, "n"]) -> Float[Array, "n"]:
    """Of half axes a and b (Ramanujan 1914)."""
    return jnp.pi * (3 * (a + b) - jnp.sqrt((3 * a + b) * (a + 3 * b)))
