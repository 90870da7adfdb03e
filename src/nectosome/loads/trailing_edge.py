"""What a slender swimmer sheds at its tail: the momentum of its added mass, at once or with the lag of a wake."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Assumed, Flow, Load, Strips, Water, wetted
from nectosome.core.described import number
from nectosome.core.se3 import cross, dot, dot_t, matmul3
from nectosome.description import Rigid
from nectosome.description.loads import TrailingEdgeLoad

from .foil_theory import lag_numbers, lift_share
from .places import Carrier

_STALL = np.radians(30.0)  # angle of a tail to its path beyond which the flow leaves it: short fins hold it so far
_SLENDER = 0.5  # aspect ratio below which the lag, then less than a tenth of the force, is that of this one


class TrailingEdge(Load):
    r"""Force at the tip of a rod or rigid part that points to the tail: the end of a slender swimmer's reactive force.

    Strips of added mass have the momentum p = (0, m_y V_y, m_z V_z) per length. At the tail it is shed into the wake
    (Lighthill 1971, eqs. 3-5; Candelier, Boyer and Leroyer 2011): for a tail that moves through the water at
    $u = -V_x$, momentum leaves at the rate $u p$, and the pressure on the plane of the trailing edge adds $m w^2/2$:

    $$ F = -(u\,p + \tfrac12 (p \cdot V)\,e_x), \quad F \cdot V = -\tfrac12 u\, p \cdot V $$

    exactly the rate of kinetic energy in the wake. Strips and this force together give Lighthill's theory: the mean
    thrust of a towed body is $\overline{m (h_t^2 - U^2 h_x^2)}/2$ at its tail.

    $m = C \rho\pi r^2$ with the half width r across the motion, as of `StripAddedMass` there; the frame is that of the
    tip, also where a rigid part is bent. The force has the factor
    $1 - \exp(-(u/u_0)^2)$ for u > 0, and is zero for a tip that leads. No force out of the water.
    """

    normal: Float[Array, ""]  # C [-]
    softness: Float[Array, ""]  # u_0 [m/s]
    arm: Float[Array, "3"] | None  # of a rigid part from its centre to its tip, in the centre's frame [m]
    turned: Float[Array, "3 3"] | None  # tip frame in the centre's frame
    dissipative = True
    described_by = TrailingEdgeLoad

    @classmethod
    def from_description(cls, described: TrailingEdgeLoad, part: Carrier) -> "TrailingEdge":
        """Of a part, whose last station is the tip of a rod, and whose first is the centre of a rigid part."""
        arm, turned = None, None
        if isinstance(part.limb, Rigid):
            arm = part.from_centre(part.link.tip_position)
            turned = matmul3(part.link.rotation[0].T, part.link.tip_rotation)
        own = number(described.normal), number(described.softness), arm, turned
        chord = part.limb.length if described.fin and described.chord is None else described.chord
        return cls(*own) if chord is None else LaggedTrailingEdge(*own, number(chord))

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on the last station of a rod, on the first of a rigid part."""
        arm, turned = self.arm, self.turned
        V, (ry, rz) = self._tip(strips)
        u = jnp.maximum(-V[0], 0.0)
        share = -jnp.expm1(-((u / self.softness) ** 2))
        if water.surface is not None:
            share = share * wetted(t, strips, water)[-1]
        p, pressure, rate = self._shed(V, jnp.stack([rz, ry]), z)
        scale = self.normal * water.density * jnp.pi * share
        F = -scale * jnp.concatenate([0.5 * pressure[None], u * p])
        none = jnp.zeros((strips.weight.shape[0], 6))
        if arm is None or turned is None:
            return none.at[-1, 3:].set(F), rate
        F = dot(turned, F)
        return none.at[0].set(jnp.concatenate([cross(arm, F), F])), rate

    def flow(self, strips: Strips) -> Flow:
        """Of the height of the tip, which stands for a chord: the wave in the wake is long against it."""
        V, half = self._tip(strips)
        across, high = V[1:], half[::-1] >= jnp.max(half)
        stalled = jnp.any(high & (jnp.abs(across) > jnp.tan(_STALL) * jnp.maximum(-V[0], 0.0)))
        chord = 2 * jnp.max(half, keepdims=True)
        return Flow(across=across[None], ahead=-V[:1], chord=chord, stalled=jnp.where(stalled, 1.0, 0.0)[None])

    def assumed(self, described: TrailingEdgeLoad, water: Water) -> tuple[Assumed, ...]:
        """Its coefficient, the speed where it fades away, and the wake."""
        known = {
            "normal": Assumed("added mass factor", self.normal, "Lighthill 1971"),
            "softness": Assumed("fades below", self.softness, "chosen", "m/s"),
            "chord": Assumed("wake", "as of a foil" if described.fin else "at once", "no chord"),
        }
        return tuple(one for name, one in known.items() if name not in described.model_fields_set)

    def _tip(self, strips: Strips) -> tuple[Float[Array, "3"], Float[Array, "2"]]:
        """Velocity of the tip in its own frame, and half widths there."""
        if self.arm is None or self.turned is None:
            return strips.velocity[-1], strips.half_width[-1]
        V = strips.velocity[0] + cross(strips.angular_velocity[0], self.arm)
        return dot_t(self.turned, V), strips.half_width[0]

    def _shed(self, V: Float[Array, "3"], r: Float[Array, "2"], z: Any) -> tuple[Array, Array, Any]:
        r"""Momentum along y and z, and twice the pressure's force, both over $C \rho\pi$; and the rate of z."""
        p = r**2 * V[1:]
        return p, p @ V[1:], z


class LaggedTrailingEdge(TrailingEdge):
    r"""The same at the edge of a tail fin of a given depth, by the wake of a foil with its aspect ratio $A = 2r/c$.

    Instead of V across the flow there is the lagged $w_e = V - \sum_i a_i (V - y_i)$ with $\dot y_i = b_i (V - y_i)
    2 |V|/c$ (`lag_numbers`). What is shed has the factor f, the lift slope over that of a slender wing, $4 \kappa / A$
    (`lift_share`), and the pressure $f (2 - f)$, so that the drag due to lift is an elliptic wing's (`suction_gain`).
    At a slender fin both are 1, the lag is gone, and what remains is Lighthill's.
    """

    chord: Float[Array, ""]  # c [m]
    dissipative = False  # the wake gives back some of its energy

    def initial(self) -> Float[Array, "2 2"]:
        """No wake: y_1 and y_2 along y and along z [m/s]."""
        return jnp.zeros((2, 2))

    def flow(self, strips: Strips) -> Flow:
        """Of the fin's depth."""
        return super().flow(strips)._replace(chord=self.chord[None])

    def _shed(self, V: Float[Array, "3"], r: Float[Array, "2"], z: Any) -> tuple[Array, Array, Any]:
        r"""Momentum along y and z, and twice the pressure's force, both over $C \rho\pi$; and the rate of z."""
        ratio = 2 * r / self.chord
        share, rate = jax.vmap(lag_numbers)(jnp.maximum(ratio, _SLENDER))
        lag = V[1:, None] - z
        w = V[1:] - jnp.sum(share * lag, axis=1)
        f = 4 * lift_share(ratio) / jnp.maximum(ratio, 1e-12)
        p = f * r**2 * w
        speed = jnp.sqrt(V @ V + self.softness**2)
        return p, (2 - f) * p @ w, rate * lag * (2 * speed / self.chord)
