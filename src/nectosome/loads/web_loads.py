"""What acts on sheets: the water that webs and soft plates carry along, and the tension of webs across."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Assumed, Load, Strips, Water, safe_norm
from nectosome.core.described import number
from nectosome.core.one_sided import one_sided_force
from nectosome.core.se3 import dot_t
from nectosome.description.loads import SheetAddedMassLoad
from nectosome.mechanism.webs import APART, waves_reach

from .added_mass import AddedMass
from .places import SheetCarrier

_SOFT = 1e-3  # strain over which the tension begins


class SheetAddedMass(AddedMass):
    r"""Added mass of a sheet that moves across itself and turns: $\rho C$ times the water of each station.

    Of a web that is $2 c$ per area of each strip. The half chord c of `sheet_reach` is by the place on the whole sheet,
    so that a rectangle which moves as one has the added mass of potential flow. Of a soft plate it is that of its
    sections. Motions that change sign along the sheet carry less water than this, waves along a web by their length
    (`waves_reach`). The areas are those of the start.
    """

    normal: Float[Array, ""]  # C [-]
    carried: Float[Array, "n"]  # [m3]
    turned: Float[Array, "n"]  # about x [m5]
    described_by = SheetAddedMassLoad

    @classmethod
    def from_description(cls, described: SheetAddedMassLoad, part: SheetCarrier) -> "SheetAddedMass":
        """Of the water of the sheet's stations."""
        carried = part.carried
        if described.wavelength is not None and part.gaps is not None:
            carried = carried * waves_reach(part.gaps.reach, number(described.wavelength)) / part.gaps.reach
        return cls(number(described.normal), carried, part.turned)

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """Added mass of each station along its normal [kg], and about its x axis [kg m2]."""
        each = jnp.zeros((self.carried.shape[0], 6)).at[:, 0].set(self.turned).at[:, 5].set(self.carried)
        return (water.density * self.normal * each)[..., None] * jnp.eye(6)

    def assumed(self, described: SheetAddedMassLoad, water: Water) -> tuple[Assumed, ...]:
        """Its coefficient."""
        open_ = "normal" not in described.model_fields_set
        return (Assumed("added mass factor", self.normal, "potential flow of a flat sheet"),) * open_


class Membrane(Load):
    r"""Tension of a web across its gaps, by the way from strip to strip: $T = E t\, (d - d_0)/d_0$ per length, d > d_0.

    Each gap has two strips across. Their distance is the same share of the width d of the gap at all times, so that the
    tension pulls both towards each other with T over this share: its power is T times the rate of d. A sheet that is
    narrower than unstressed folds and pulls nothing; the tension begins smoothly over a strain of 1e-3.
    """

    tension: Float[Array, "g"]  # E t times the length of a strip, of each pair of strips [N]
    unstressed: Float[Array, "g"]  # d_0 [m]

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each strip [N m, N]; strips of a pair are one behind the other."""
        n = self.unstressed.shape[0]
        place, R = strips.position.reshape(n, 2, 3), strips.rotation.reshape(n, 2, 3, 3)
        way = place[:, 1] - place[:, 0]
        far = safe_norm(way)
        strain = far / (APART * self.unstressed) - 1
        none = jnp.zeros(())
        pull = one_sided_force(strain, none, self.tension, none, jnp.asarray(_SOFT)) / (APART * far)
        force = dot_t(R, jnp.stack([1.0, -1.0])[:, None] * (pull[:, None] * way)[:, None])
        return jnp.concatenate([jnp.zeros((2 * n, 3)), force.reshape(2 * n, 3)], axis=1), z
