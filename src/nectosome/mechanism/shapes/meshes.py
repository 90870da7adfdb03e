"""Rigid parts whose shape is a mesh: what was measured of it, with the part's mass and volume, traced."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Stations, Water
from nectosome.core.described import number, vector
from nectosome.description import Rigid
from nectosome.description.meshes import MeshShape
from nectosome.geometry import Triangles, keeps_volume
from nectosome.mechanism.parts import Link

from .contract import RigidShape, Solid

_BOX, _CYLINDER, _BALL = 1.0, np.pi / 4, np.pi / 6  # volume over that of the box around it
_SMALL = 1e-9  # half width of a slice without any [m]
_SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])  # of a box


class MeshBody(RigidShape):
    """A mesh, in whose frame its part is: root and tip of that are both the origin.

    Station 0 is at the centre of the displaced volume, and displaces all of it. Strips are slices across x, each at the
    centre of its own volume.
    """

    described_by = MeshShape

    def __init__(self, part: Rigid):
        super().__init__(part)
        assert isinstance(part.shape, MeshShape)
        self.mesh, self.known = part.shape, part.shape.numbers

    @property
    def volume(self) -> Float[Array, ""]:
        """That of its matter: without cavities, or of a shell [m3]."""
        known, thickness = self.known, self.mesh.thickness
        return number(known.matter) if thickness is None else number(known.area) * number(thickness)

    def own_inertia(self, mass: Float[Array, ""]) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
        """That of its matter."""
        known = self.known
        size, place, six = known.matter, known.matter_centre, known.matter_inertia
        if self.mesh.thickness is not None:
            size, place, six = known.area, known.area_centre, known.area_inertia
        return mass / number(size) * _matrix(six), jnp.asarray(np.array(place) - np.array(known.centre))

    def built(self, water: Water) -> tuple[Link, Stations]:
        """Rigid link and its stations."""
        part, known = self.part, self.known
        n = part.strips if any(load.per_length for load in part.loads.values()) else 0
        low, high, centre = (np.array(x) for x in (known.low, known.high, known.centre))
        size = high - low
        cut = self.mesh.slices.joined(max(n, 1))
        position = np.concatenate([centre[None], cut.centre[:n]])
        weight = np.concatenate([[0.0], np.full(n, size[0] / max(n, 1))])
        half = np.concatenate([0.5 * size[None, 1:], np.maximum(cut.half[:n], _SMALL)])

        filled = cut.share[:n] * known.volume / (4 * weight[1:] * half[1:].prod(axis=1))
        round_axes = np.concatenate([[_round_axes(known.volume / size.prod())], _round_section(filled)])
        stations = Stations(
            x=jnp.asarray(position[:, 0] - low[0]),
            half_length=jnp.asarray(np.concatenate([[0.5 * size[0]], 0.5 * weight[1:]])),
            weight=jnp.asarray(weight),
            half_width=jnp.asarray(half),
            round_axes=jnp.asarray(round_axes),
            volume=jnp.zeros(n + 1).at[0].set(number(known.volume if part.volume is None else part.volume)),
            inertia=jnp.zeros((n + 1, 6, 6)).at[0].set(self.mass_and_inertia()[1]),
        )
        ends = np.stack([np.array([x, *centre[1:]]) for x in (low[0], high[0])])
        turned = jnp.broadcast_to(jnp.eye(3), (n + 1, 3, 3))
        return Link(turned, jnp.asarray(position), jnp.eye(3), jnp.zeros(3), jnp.asarray(ends)), stations

    def wet_triangles(self, beside: int) -> tuple[Float[Array, "m 3 3"], Float[Array, ""]]:
        """Those of the kept surface, scaled to the volume measured, and the volume of the part over that.

        Of so many meshes in a robot each has its share of the triangles.

        Where thin walls of a lone body were lost in it, they are those of boxes, one for each slice.
        """
        known, solid = self.known, self.mesh.afloat(beside)
        if not keeps_volume(solid, known.volume):
            solid = _boxes(self.mesh)
        size, centre, _ = solid.solid
        corners = np.cbrt(known.volume / size) * (solid.corners - centre)
        given = self.part.volume
        return jnp.asarray(corners), number(1.0) if given is None else number(given) / known.volume

    def surface(self) -> Triangles:
        """The surface in pictures."""
        drawn = self.mesh.drawn
        return Triangles(drawn.vertices - self.known.centre, drawn.faces)

    def solids(self) -> tuple[Solid, ...]:
        """The mesh."""
        low, high = np.array(self.known.low), np.array(self.known.high)
        return (Solid("mesh", 0.5 * (high - low), np.eye(3), 0.5 * (high + low), self.mesh),)


def _boxes(shape: MeshShape) -> Triangles:
    """A box for each slice, as wide to high as that, of its volume and about its centre."""
    known, cut = shape.numbers, shape.slices
    thick = (known.high[0] - known.low[0]) / len(cut.share)
    half = np.maximum(cut.half, _SMALL)
    half = half * np.sqrt(cut.share * known.volume / (4 * thick * half.prod(axis=1)))[:, None]
    half = np.concatenate([np.full((len(half), 1), 0.5 * thick), half], axis=1)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = np.concatenate([_SIDES[:, :3], _SIDES[:, [0, 2, 3]]])
    vertices = cut.centre[:, None] + signs * half[:, None]
    return Triangles(vertices.reshape(-1, 3), (8 * np.arange(len(half))[:, None, None] + faces).reshape(-1, 3))


def _round_axes(filled: float) -> float:
    """Number of round axes of the shape that fills about as much of the box around it."""
    shapes = {0.0: _BOX, 2.0: _CYLINDER, 3.0: _BALL}
    return min(shapes, key=lambda axes: abs(shapes[axes] - filled))


def _round_section(filled: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """The same of slices: boxes or cylinders."""
    return np.where(filled > 0.5 * (_BOX + _CYLINDER), 0.0, 2.0)


def _matrix(six) -> Float[Array, "3 3"]:
    """The symmetric matrix of its elements xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = vector(tuple(six))
    return jnp.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
