"""Viscous drag of slender parts at low Reynolds numbers: resistive force theory."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Flow, Load, Strips, Water, safe_norm, wetted
from nectosome.core.described import number
from nectosome.description.stokes_drag import StokesDragLoad

from .places import Carrier

_LIGHTHILL = 0.09  # q over the length of a wave along the helix


class StokesDrag(Load):
    r"""Viscous drag per length of a slender round part, in the section's frame with x along the part:

    $$ f = -(\zeta_t v_x,\ \zeta_n v_y,\ \zeta_n v_z), \quad m_x = -4\pi\mu r^2 w_x, \quad
    \zeta_t = \frac{2\pi\mu}{\ln(2l/r) - c}, \quad \zeta_n = \frac{4\pi\mu}{\ln(2l/r) + 1/2} $$

    with the velocity v relative to the water, its viscosity $\mu$ and the radius r, the mean half axis of the section.
    Gray and Hancock (1955): c = 1/2, and l is the wavelength. Lighthill (1976), for a helix that swims without a load:
    c = 0, and l = q = 0.09 of the length of a wave along the helix. Each strip is dragged as if the others were not
    there; the moment is that of a long cylinder in still water. No force out of the water.

    By Lamb (1911) an endless cylinder across a slow stream has the drag $4\pi\mu |v|/(1/2 - \gamma - \ln(Re/8))$ with
    the Reynolds number $Re = \rho |v| 2r/\mu$: that of $\zeta_n$ with l = 2.2 r/Re, where the water's inertia ends the
    flow. From Re = 0.1 on that is nearer than a wave of 22 radii.
    """

    wavelength: Float[Array, ""]  # [m]
    lighthill: bool = eqx.field(static=True)  # his coefficients, else those of Gray and Hancock
    dissipative = by_station = True  # not mild: what is light for the water's viscosity comes to rest at once
    described_by = StokesDragLoad

    @classmethod
    def from_description(cls, described: StokesDragLoad, part: Carrier) -> "StokesDrag":
        """Of a part."""
        return cls(number(described.wavelength), described.coefficients == "lighthill")

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each station [N m, N]."""
        r = strips.radius
        reach = jnp.log(2 * (_LIGHTHILL if self.lighthill else 1.0) * self.wavelength / r)
        along = 2 / (reach - (0.0 if self.lighthill else 0.5))
        across = 4 / (reach + 0.5)
        about = 4 * r**2 * strips.angular_velocity[:, 0]
        vx, vy, vz = strips.velocity.T
        none = jnp.zeros_like(vx)
        wrench = jnp.stack([about, none, none, along * vx, across * vy, across * vz], axis=-1)
        return -(jnp.pi * water.viscosity * wetted(strips, water) * strips.weight)[:, None] * wrench, z

    def flow(self, strips: Strips) -> Flow:
        """Of the section's diameter."""
        return Flow(safe_norm(strips.velocity), 2 * strips.radius)
