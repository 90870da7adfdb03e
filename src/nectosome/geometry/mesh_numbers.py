"""What a mesh says of a rigid part: volumes, centres, inertia, areas, slices, a simplified surface; each per unit."""

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, show_quantity

from .mesh_files import parse_mesh, read_mesh_bytes
from .repair import Bodies, UnsoundError, repaired
from .simplify import keeps_volume, simplified
from .slices import COUNT, MeshSlices, slices_of
from .triangles import Moments, Triangles, highest, lowest

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
"""Units of meshes [m]."""
_LARGE, _SMALL = 20.0, 2e-3  # extents of the largest and smallest part that is not asked about [m]
_ROWS = 256  # of a shadow, each as wide as at its middle


class Measured(NamedTuple):
    """A mesh in SI, in its own frame."""

    sha256: str  # of the file
    displaced: Moments  # of the water, closed cavities among it
    matter: Moments  # of a solid part, without cavities
    skin: Moments  # of the wetted surface
    projected: Float[np.ndarray, "3"]  # areas as seen along x, y, z [m2]
    bounds: Float[np.ndarray, "2 3"]  # least and largest coordinates [m]
    slices: MeshSlices
    surface: Triangles  # wetted, simplified
    triangles: int  # of the file
    touch: bool  # bodies touch or overlap, so that faces of them lie inside
    told: tuple[str, ...]  # what was found and repaired


def is_likely(extent: float) -> bool:
    """Whether a part of this largest extent [m] is not asked about."""
    return _SMALL <= extent <= _LARGE


def measure(path: str | Path, unit: str, source: str = "") -> Measured:
    """Measure the mesh in a file in one of UNITS; `source` names it in messages.

    Raises InputError for what is no such file (`read_mesh_bytes`, `parse_mesh`) and what bounds no body (`repaired`).
    """
    source = source or str(path)
    return measured_bytes(read_mesh_bytes(path, source), unit, source)


def file_hash(path: str | Path) -> str:
    """SHA-256 of a file of a mesh. Raises InputError as `read_mesh_bytes`."""
    return hashlib.sha256(read_mesh_bytes(path, str(path))).hexdigest()


@lru_cache(8)
def measured_bytes(data: bytes, unit: str, source: str) -> Measured:
    """The same of the contents of a file; those of the last few are remembered."""
    bodies, triangles = _bodies(data, unit, source)
    low, high = bodies.outer.bounds
    size = float((high - low).max())
    told = bodies.told
    if not is_likely(size):
        told = (f"its largest extent is {show_quantity(size, 'length')}: check the unit, {unit}", *told)
    displaced, simple = bodies.outer.solid, simplified(bodies.outer)
    if not keeps_volume(simple, displaced.size):
        why = "thin walls are lost in the simplified surface"
        told = (*told, f"{why}: at the water's surface buoyancy is that of {COUNT} boxes across x")
    hollow = len(bodies.all.faces) > len(bodies.outer.faces)
    return Measured(
        hashlib.sha256(data).hexdigest(),
        displaced,
        bodies.all.solid if hollow else displaced,
        bodies.outer.surface,
        projected_areas(bodies.outer),
        bodies.outer.bounds,
        slices_of(bodies.outer),
        simple,
        triangles,
        bodies.touch,
        told,
    )


def outer_surface(data: bytes, unit: str, source: str) -> Triangles:
    """Wetted surface of the contents of a file, in SI, as it is measured. Raises InputError as `measure`."""
    return _bodies(data, unit, source)[0].outer


def _bodies(data: bytes, unit: str, source: str) -> tuple[Bodies, int]:
    """What the contents of a file bound, and the number of its triangles."""
    vertices, faces = parse_mesh(data, source)
    try:
        return repaired(vertices * UNITS[unit], faces), len(faces)
    except UnsoundError as error:
        raise InputError(str(error), file=source) from None


def projected_areas(surface: Triangles) -> Float[np.ndarray, "3"]:
    """Areas of the shadows along x, y and z [m2]: unions of what the faces cover of rows, exact along a row."""
    corners = surface.corners
    return np.array([_shadow(corners[..., [1, 2]]), _shadow(corners[..., [0, 2]]), _shadow(corners[..., [0, 1]])])


def _shadow(corners: Float[np.ndarray, "m 3 2"]) -> float:
    """Area that triangles in a plane cover together."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    pitch = (high[1] - low[1]) / _ROWS
    across = (corners[..., 1] - low[1]) / pitch - 0.5  # row k is at k
    first, last = np.ceil(lowest(across)).astype(int), np.floor(highest(across)).astype(int)
    count = np.maximum(last - first + 1, 0)
    triangle = np.repeat(np.arange(len(corners)), count)
    row = np.arange(triangle.size) - np.repeat(np.cumsum(count) - count, count) + first[triangle]
    x, y = corners[triangle, :, 0] - low[0], across[triangle] - row[:, None]
    after_x, after_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    crosses = (y <= 0) != (after_y <= 0)
    at = x + (after_x - x) * np.where(crosses, y / np.where(crosses, y - after_y, 1.0), 0.0)
    begin, end = lowest(np.where(crosses, at, np.inf)), highest(np.where(crosses, at, -np.inf))
    seen = end >= begin
    row, begin, end = row[seen], begin[seen], end[seen]
    far = 2 * (high[0] - low[0]) * row  # so that rows come one after the other on one line
    order = np.argsort(begin + far, kind="stable")
    begin, end = (begin + far)[order], (end + far)[order]
    reached = np.concatenate([[-np.inf], np.maximum.accumulate(end)[:-1]])
    return float(pitch * np.sum(np.maximum(end - np.maximum(begin, reached), 0.0)))
