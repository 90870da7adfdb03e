"""A surface with fewer triangles, for pictures: edges collapse (Garland and Heckbert 1997).

Where there are many, corners in a cell become one before that (Rossignac and Borrel 1993).
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .even_triangles import fewer_triangles
from .triangles import Triangles, area_vectors, compact

MOST = 500  # triangles
_FINEST = 32  # cells along the longest side
_FEWEST = 4  # cells along each side, so that both sides of a wing are apart
_MANY, _TOO_MANY = 6000, 30_000  # triangles, from which on cells come first, and are not gone without
_FOLDED = 0.02  # share of the volume that cells may take
_CREASE = np.radians(40)
_HELD = 1e-3  # weight of the mean of a cell's corners beside the planes of their faces


def simplified(surface: Triangles, most: int = MOST) -> Triangles:
    """The surface with at most so many triangles; as it is where it has no more.

    A closed surface stays closed, and sharp edges stay sharp. Of a surface of over 30 000 triangles walls in it that
    are thinner than a cell, a 32nd of the largest extent, may lose their volume.
    """
    if len(surface.faces) <= most:
        return surface
    begun = surface
    if len(surface.faces) > _MANY:
        cells = _clustered(surface, _FINEST)
        if len(surface.faces) > _TOO_MANY or abs(cells.volume / surface.volume - 1) < _FOLDED:
            begun = cells
    few = fewer_triangles(begun, most)
    return few if len(few.faces) <= most else _by_cells(begun, most)


def _by_cells(surface: Triangles, most: int) -> Triangles:
    """By the finest grid of cells that gives at most so many triangles.

    Each cell's corner is nearest to the planes of the faces there, so that edges stay.
    """
    few, many = 2, _FINEST + 1
    while many - few > 1:
        middle = (few + many) // 2
        few, many = (middle, many) if len(_cells(surface, middle)[1]) <= most else (few, middle)
    return _clustered(surface, few)


def creased(surface: Triangles, angle: float = _CREASE) -> Triangles:
    """The same with a vertex of its own on each side of an edge sharper than `angle` [rad], for smooth shading."""
    normal = area_vectors(surface.corners)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]
    ends = np.concatenate([surface.faces[:, [0, 1]], surface.faces[:, [1, 2]], surface.faces[:, [2, 0]]])
    face, n = np.tile(np.arange(len(normal)), 3), len(surface.vertices)
    order = np.argsort(ends.min(axis=1) * n + ends.max(axis=1), kind="stable")
    ends, face = np.sort(ends[order], axis=1), face[order]
    one, other = face[:-1], face[1:]
    smooth = (ends[:-1] == ends[1:]).all(axis=1) & (np.sum(normal[one] * normal[other], axis=1) > np.cos(angle))
    graph = coo_array((smooth[smooth], (one[smooth], other[smooth])), shape=(len(normal),) * 2)
    _, patch = connected_components(graph, directed=False)
    key = patch[:, None] * n + surface.faces
    _, first, again = np.unique(key, return_index=True, return_inverse=True)
    return Triangles(surface.vertices[surface.faces.ravel()[first]], again.reshape(surface.faces.shape))


def _cells(surface: Triangles, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The cell of each vertex, counted without empty ones, and the faces between three cells."""
    low, high = surface.bounds
    pitch = (high - low).max() / cells
    counts = np.maximum(np.ceil((high - low) / pitch - 1e-9), _FEWEST).astype(int)
    place = np.clip(((surface.vertices - low) * (counts / (high - low))).astype(int), 0, counts - 1)
    key = place @ [1, counts[0], counts[0] * counts[1]]
    filled = np.zeros(counts.prod(), bool)
    filled[key] = True
    cell = (np.cumsum(filled) - 1)[key]
    a, b, c = cell[surface.faces].T
    return cell, cell[surface.faces][(a != b) & (b != c) & (c != a)]


def _clustered(surface: Triangles, cells: int) -> Triangles:
    cell, faces = _cells(surface, cells)
    n = int(cell.max()) + 1

    def summed(at: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(at, x, n) for x in values.T], axis=-1)

    mean = summed(cell, surface.vertices) / np.bincount(cell, minlength=n)[:, None]
    areas = area_vectors(surface.corners)
    size = np.linalg.norm(areas, axis=1)
    normal = areas / np.where(size > 0, size, 1.0)[:, None]
    planes, right, weight = np.zeros((n, 9)), np.zeros((n, 3)), np.zeros(n)
    for at, corner in zip(cell[surface.faces].T, surface.faces.T, strict=True):  # planes through them, about the means
        away = np.sum(normal * (surface.vertices[corner] - mean[at]), axis=1)
        planes += summed(at, (areas[:, :, None] * normal[:, None, :]).reshape(-1, 9))
        right += summed(at, areas * away[:, None])
        weight += np.bincount(at, size, n)
    held = _HELD * np.where(weight > 0, weight, 1.0)
    matrix = planes.reshape(n, 3, 3) + held[:, None, None] * np.eye(3)
    pitch = np.ptp(surface.bounds, axis=0).max() / cells
    moved = np.clip(np.linalg.solve(matrix, right[..., None])[..., 0], -pitch, pitch)
    return compact(mean + moved, faces)
