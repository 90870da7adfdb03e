r"""Momentum shed at the tail of a slender swimmer: the end term of the reactive force of elongated-body theory.

Strips of added mass have the momentum p = (0, m_y V_y, m_z V_z) per length. At the tail it is shed into the wake
(Lighthill 1971, eqs. 3-5; Candelier, Boyer and Leroyer 2011): for a tail that moves through the water at $u = -V_x$,
momentum leaves at the rate $u p$, and the pressure on the plane of the trailing edge adds $m w^2/2$:

$$ F = -(u\,p + \tfrac12 (p \cdot V)\,e_x), \qquad F \cdot V = -\tfrac12 u\, p \cdot V $$

exactly the rate of kinetic energy in the wake. Strips and this force together give Lighthill's theory: the mean thrust
of a towed body is $\overline{m (h_t^2 - U^2 h_x^2)}/2$ at its tail.
"""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water
from nectosome.description.loads import TrailingEdgeLoad


class TrailingEdge(Load):
    r"""Force at the tip of a rod, with its root at the head.

    $m = C \rho\pi r^2$ with the half width r across the motion, as of `StripAddedMass` there. The force has the factor
    $1 - \exp(-(u/u_0)^2)$ for u > 0, and is zero for a tip that leads.
    """

    normal: Float[Array, ""]  # C [-]
    softness: Float[Array, ""]  # u_0 [m/s]
    dissipative = True
    described_by = TrailingEdgeLoad

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on the last station."""
        V = strips.velocity[-1]
        ry, rz = strips.half_width[-1]
        p = self.normal * water.density * jnp.pi * jnp.stack([jnp.zeros(()), rz**2 * V[1], ry**2 * V[2]])
        u = jnp.maximum(-V[0], 0.0)
        share = -jnp.expm1(-((u / self.softness) ** 2))
        F = -share * (u * p).at[0].add(0.5 * p @ V)
        return jnp.zeros((strips.weight.shape[0], 6)).at[-1, 3:].set(F), z
