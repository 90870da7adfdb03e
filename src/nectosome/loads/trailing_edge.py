r"""What leaves a slender swimmer at its tail: the end of the reactive force of elongated-body theory.

Strips of added mass carry their water along for ever; their water's momentum p = (0, m_y V_y, m_z V_z) per length would
pull at the tail's end. In truth it is shed there into the wake (Lighthill 1971, eqs. 3-5; Candelier, Boyer and Leroyer
2011): while the tail goes through the water at $u = -V_x$, its momentum leaves at the rate $u p$, and the pressure on
the plane of the trailing edge gives $m w^2/2$:

$$ F = -(u\,p + \tfrac12 (p \cdot V)\,e_x), \qquad F \cdot V = -\tfrac12 u\, p \cdot V $$

that is, exactly the kinetic energy that is left in the wake. Strips and this force together are Lighthill's: the mean
thrust of a towed body is $\overline{m (h_t^2 - U^2 h_x^2)}/2$ at its tail.
"""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water
from nectosome.description.loads import TrailingEdgeLoad


class TrailingEdge(Load):
    r"""Force at the tip of a rod that runs from head to tail.

    $m = C \rho\pi r^2$ with the half width r across the motion, as of `StripAddedMass` there. All of it comes with
    the factor $1 - \exp(-(u/u_0)^2)$ where u > 0, and none where the tip goes ahead.
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
