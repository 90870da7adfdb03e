r"""What a rod is made of at places along it: stiffness, damping and mass per length of its sections.

A section of a solid rod is one layer, that of a hollow one its wall and its filling, bonded to each other, whose
stiffnesses $\mathrm{diag}(G J_x, E J_y, E J_z, E A, k G A, k G A)$ add. The torsion constant of a wall is taken as the
outer section's less the inner one's: exact for a circle and for similar ellipses.

Ribs of the share $\varphi$ of the length lie in series with the rod between them. With the stiffness $K$ between them
and $K_r$ at them, $1/\bar K = (1 - \varphi)/K + \varphi/K_r$. Strains are $\bar K/K$ and $\bar K/K_r$ times the mean
one, so that $\bar D = (1 - \varphi) D (\bar K/K)^2 + \varphi D_r (\bar K/K_r)^2$ loses the same power. Mass adds by
shares.
"""

from collections.abc import Iterable
from functools import reduce
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core.described import number, vector
from nectosome.description import Rod

from .sections import Sections, ellipse, rectangle


class Layer(NamedTuple):
    """One material of n sections; each of its numbers is one for all of them, or one for each."""

    sections: Sections
    young: Float[Array, "*n"]  # E [Pa]
    poisson: Float[Array, ""]
    density: Float[Array, "*n"]  # [kg/m3]
    viscosity: Float[Array, "*n"]  # eta [Pa s]
    shear_factor: Float[Array, "*n"]  # k

    @property
    def geometry(self) -> Float[Array, "n 6"]:
        """J_x, J_y, J_z of the sections, and their area three times."""
        own = self.sections
        rows = [own.torsion_constant, own.second_moment_y, own.second_moment_z, own.area, own.area, own.area]
        return jnp.stack(rows, axis=-1)

    @property
    def moduli(self) -> Float[Array, "*n 6"]:
        """G, E, E, E, k G, k G with G = E / (2 (1 + nu))."""
        young, k = self.young, self.shear_factor
        shear = young / (2 * (1 + self.poisson))
        return _rows(shear, young, young, young, k * shear, k * shear)

    @property
    def viscosities(self) -> Float[Array, "*n 6"]:
        """The viscosity eta for G and 3 eta for E (Armanini et al. 2022)."""
        eta, k = self.viscosity, self.shear_factor
        return _rows(eta, 3 * eta, 3 * eta, 3 * eta, k * eta, k * eta)

    def inertia(self, weight: Float[Array, "n 1"]) -> Float[Array, "n 6"]:
        """Moments of inertia about x, y and z, and the mass three times, of pieces of these lengths."""
        own = self.sections
        moments = jnp.stack([own.polar_moment, own.second_moment_y, own.second_moment_z], axis=-1)
        line = jnp.concatenate([moments, jnp.repeat(own.area[:, None], 3, axis=1)], axis=-1)
        density = self.density[:, None] if self.density.ndim else self.density
        return density * weight * line


class Rings(NamedTuple):
    """Ribs around a rod."""

    share: Float[Array, ""]  # of the length
    layer: Layer  # what they add to its sections


class Matter(NamedTuple):
    """All that a rod is made of at n places."""

    outline: Sections
    layers: tuple[Layer, ...]  # the first one outside
    rings: Rings | None

    @property
    def area(self) -> Float[Array, "n"]:
        """Area of the sections [m2] that displaces water."""
        area = self.outline.area
        return area if self.rings is None else area + self.rings.share * self.rings.layer.sections.area

    def stiffness(self, weight: Float[Array, "n 1"]) -> Float[Array, "n 6"]:
        """Stiffness in the order of strains, times weights."""
        if self.rings is None:
            return _sum(weight * one.geometry * one.moduli for one in self.layers)
        return weight * self._compliant()[0]

    def damping(self, weight: Float[Array, "n 1"]) -> Float[Array, "n 6"]:
        """Viscosity in the order of strains, times weights."""
        if self.rings is None:
            return _sum(weight * one.geometry * one.viscosities for one in self.layers)
        mean, alone, ribbed = self._compliant()
        share, ring = self.rings.share, self.rings.layer
        own = _sum(one.geometry * one.viscosities for one in self.layers)
        at_ribs = own + ring.geometry * ring.viscosities
        return weight * ((1 - share) * own * (mean / alone) ** 2 + share * at_ribs * (mean / ribbed) ** 2)

    def inertia(self, weight: Float[Array, "n 1"]) -> Float[Array, "n 6"]:
        """Moments of inertia about x, y and z, and the mass three times, of pieces of these lengths."""
        own = _sum(one.inertia(weight) for one in self.layers)
        return own if self.rings is None else own + self.rings.share * self.rings.layer.inertia(weight)

    def _compliant(self) -> tuple[Array, Array, Array]:
        """Stiffness on the mean, between ribs, and at them."""
        assert self.rings is not None
        share, ring = self.rings.share, self.rings.layer
        alone = _sum(one.geometry * one.moduli for one in self.layers)
        ribbed = alone + ring.geometry * ring.moduli
        return alone * ribbed / ((1 - share) * ribbed + share * alone), alone, ribbed


def matter_at(limb: Rod, s: np.ndarray) -> Matter:
    """What a rod is made of at fractions s of its length; numbers go over evenly from one section to the next."""
    shape = rectangle if limb.section == "rectangle" else ellipse
    sizes = ("radius", "radius") if limb.section == "circle" else ("width", "height")
    scale = 1.0 if limb.section == "circle" else 0.5

    def value(given: list) -> Array:
        places, values = zip(*given, strict=True)
        return number(values[0]) if len(values) == 1 else jnp.interp(jnp.asarray(s), np.array(places), vector(values))

    outer = [scale * value(limb.sections(size)) for size in sizes]
    outline, poisson = shape(*outer), number(limb.poisson)
    solid = outline.shear_factor(poisson)
    own = value(limb.along("young")), poisson, value(limb.along("density")), value(limb.shear_viscosities)
    if limb.wall is None:
        layers = (Layer(outline, *own, solid),)
    else:
        wall = value(limb.along("wall"))
        hole = shape(*(half - wall for half in outer))
        layers = (Layer(outline.around(hole), *own, outline.hollow_shear_factor(hole, poisson)),)
        if (inside := limb.filling) is not None:
            filling = number(inside.young), poisson, number(inside.density), number(inside.damping)
            layers += (Layer(hole, *filling, solid),)
    if (ribs := limb.ribs) is None:
        return Matter(outline, layers, None)
    full = jnp.ones_like(outline.area)
    around = shape(*(scale * number(getattr(ribs, size)) * full for size in sizes)).around(outline)
    young, density = (number(getattr(limb if getattr(ribs, x) is None else ribs, x)) for x in ("young", "density"))
    viscosity = layers[0].viscosity if ribs.young is None else jnp.zeros(())
    share = ribs.count * number(ribs.thickness) / number(limb.length)
    return Matter(outline, layers, Rings(share, Layer(around, young, poisson, density, viscosity, solid)))


def _sum(each: Iterable[Array]) -> Array:
    return reduce(jnp.add, each)


def _rows(*values: Array) -> Float[Array, "*n k"]:
    return jnp.stack(jnp.broadcast_arrays(*values), axis=-1)
