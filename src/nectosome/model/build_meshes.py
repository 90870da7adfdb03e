"""Rigid parts whose shape is a mesh: what was measured of it, with the part's mass and volume, traced; buoyancy."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Stations, Water
from nectosome.core.described import number, vector
from nectosome.description import Rigid
from nectosome.description.meshes import MeshShape
from nectosome.geometry import Triangles, keeps_volume
from nectosome.loads import Buoyancy, MeshBuoyancy
from nectosome.mechanism import Link
from nectosome.mechanism import links as lk

_BOX, _CYLINDER, _BALL = 1.0, np.pi / 4, np.pi / 6  # volume over that of the box around it
_SMALL = 1e-9  # half width of a slice without any [m]
_SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])  # of a box


def mesh_link(limb: Rigid, shape: MeshShape) -> tuple[Link, Stations]:
    """Rigid part and its stations, in the frame of its mesh, where its root and its tip are both the origin.

    Station 0 is at the centre of the displaced volume. Strips are slices across x, each at the centre of its own
    volume. The centre displaces all of it.
    """
    known = shape.numbers
    n = limb.strips if any(load.per_length for load in limb.loads.values()) else 0
    low, high, centre = (np.array(x) for x in (known.low, known.high, known.centre))
    size = high - low
    cut = shape.slices.joined(max(n, 1))
    position = np.concatenate([centre[None], cut.centre[:n]])
    weight = np.concatenate([[0.0], np.full(n, size[0] / max(n, 1))])
    half = np.concatenate([0.5 * size[None, 1:], np.maximum(cut.half[:n], _SMALL)])

    filled = cut.share[:n] * known.volume / (4 * weight[1:] * half[1:].prod(axis=1))
    inertia = jnp.zeros((n + 1, 6, 6)).at[0].set(_inertia(limb, shape, centre))
    stations = Stations(
        x=jnp.asarray(position[:, 0] - low[0]),
        half_length=jnp.asarray(np.concatenate([[0.5 * size[0]], 0.5 * weight[1:]])),
        weight=jnp.asarray(weight),
        half_width=jnp.asarray(half),
        round_axes=jnp.asarray(np.concatenate([[_round_axes(known.volume / size.prod())], _round_section(filled)])),
        volume=jnp.zeros(n + 1).at[0].set(number(known.volume if limb.volume is None else limb.volume)),
        inertia=inertia,
    )
    ends = np.stack([np.array([x, *centre[1:]]) for x in (low[0], high[0])])
    turned = jnp.broadcast_to(jnp.eye(3), (n + 1, 3, 3))
    return Link(turned, jnp.asarray(position), jnp.eye(3), jnp.zeros(3), jnp.asarray(ends)), stations


def mesh_buoyancy(limb: Rigid, shape: MeshShape, water: Water) -> Buoyancy:
    """Buoyancy of the part: where there is a surface, of its triangles about the centre of the displaced volume.

    They are those of the simplified surface, or boxes of its slices where thin walls of a lone body were lost in that,
    scaled about their centre so that volume and centre are the measured ones.
    """
    if water.surface is None:
        return Buoyancy()
    known, solid = shape.numbers, shape.surface
    if not keeps_volume(solid, known.volume):
        solid = _boxes(shape)
    size, centre, _ = solid.solid
    corners = np.cbrt(known.volume / size) * (solid.corners - centre)
    share = number(1.0) if limb.volume is None else number(limb.volume) / known.volume
    return MeshBuoyancy(jnp.asarray(corners), share)


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


def _inertia(limb: Rigid, shape: MeshShape, centre: Float[np.ndarray, "3"]) -> Float[Array, "6 6"]:
    """Inertia about the centre of the displaced volume; what the description gives comes before that of the mesh."""
    known = shape.numbers
    if shape.thickness is None:
        size, place, six = number(known.matter), known.matter_centre, known.matter_inertia
        matter = size
    else:
        size, place, six = number(known.area), known.area_centre, known.area_inertia
        matter = size * number(shape.thickness)
    mass = number(limb.mass) if limb.mass is not None else number(limb.density) * matter
    if limb.inertia is not None:
        given = (0.0, 0.0, 0.0) if limb.products is None else limb.products
        return lk.spatial_inertia(mass, _matrix([*limb.inertia, *given]), vector(limb.centre_of_mass))
    away = jnp.asarray(np.array(place) - centre)
    return lk.spatial_inertia(mass, mass / size * _matrix(six), away + vector(limb.centre_of_mass))


def _matrix(six) -> Float[Array, "3 3"]:
    """The symmetric matrix of its elements xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = vector(tuple(six))
    return jnp.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
