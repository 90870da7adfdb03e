"""A surface with fewer triangles, to be kept and for pictures: edges collapse (Garland and Heckbert 1997).

Where there are many, corners in a cell become one before that (Rossignac and Borrel 1993).
"""

import numpy as np

from .even_triangles import fewer_triangles
from .triangles import Triangles, area_vectors, compact, joined, linked, separate

MOST = 8000  # triangles that are kept: a hull's metacentric radius is right to 0.1 %
EACH = 200  # of many bodies
_THIN, _ALL = 8000, 100_000  # the most for one that would lose volume, and for all: corners are numbered by 16 bits
_KEPT = 0.1  # share of the volume that a simplified surface may lack or have too much
_FINEST, _COARSER = 1.4, 0.7  # cells along the longest side of a lone body, of one of several, over root MOST
_FEWEST = 4  # cells along each side, so that both sides of a wing are apart
_MANY, _TOO_MANY = 12, 60  # times MOST, from which on cells come first, and are not gone without
_MANY_EACH = 4  # the first of these for one of several bodies
_FOLDED = 0.02  # share of the volume that cells may take
_CREASE = np.radians(40)
_HELD = 1e-3  # weight of the mean of a cell's corners beside the planes of their faces


def simplified(surface: Triangles, most: int = MOST) -> Triangles:
    """The surface with at most so many triangles, or with about EACH for each of many bodies.

    A surface that has no more stays as it is. A closed surface stays closed, and sharp edges stay sharp. Of a lone body
    of over 60 times as many triangles walls that are thinner than a cell, a 125th of the largest extent for 8000, may
    lose their volume. Each of several bodies has its volume about its centre; one that lost much of it has more
    triangles.
    """
    if len(surface.faces) <= most:
        return surface
    bodies = separate(surface)
    return _fewer(surface, most) if len(bodies) == 1 else joined(_each_fewer(bodies, most))


def keeps_volume(simple: Triangles, volume: float) -> bool:
    """Whether a simplified surface has about the volume [m3] of the body: no thin walls are lost in it."""
    return abs(simple.volume / volume - 1) < _KEPT


def _fewer(surface: Triangles, most: int) -> Triangles:
    begun, finest = surface, round(_FINEST * most**0.5)
    if len(surface.faces) > _MANY * most:
        cells = _clustered(surface, finest)
        if len(surface.faces) > _TOO_MANY * most or _is_close(cells, surface):
            begun = cells
    few = fewer_triangles(begun, most)
    return few if len(few.faces) <= most else _by_cells(begun, most, finest)


def _is_close(cells: Triangles, surface: Triangles) -> bool:
    return abs(cells.volume / surface.volume - 1) < _FOLDED


def _each_fewer(bodies: list[Triangles], most: int) -> list[Triangles]:
    """Bodies with triangles by their shares of the area, at least EACH, where they have so many.

    All at once, at sizes at which a triangle of each has the same area: so the same collapses are the cheapest.
    """
    areas = np.array([one.surface.size for one in bodies])
    counts = np.maximum(most * areas / areas.sum(), EACH).astype(int)
    begun, coarser = list[Triangles](), round(_COARSER * most**0.5)
    for one, scale in zip(bodies, np.sqrt(counts / areas), strict=True):
        cells = _clustered(one, coarser) if len(one.faces) > _MANY_EACH * most else one
        start = cells if _is_close(cells, one) and len(separate(cells)) == 1 else one
        begun.append(Triangles(scale * (start.vertices - one.bounds.mean(axis=0)), start.faces))
    total = sum(min(n, len(one.faces)) for n, one in zip(counts, bodies, strict=True))
    few = separate(fewer_triangles(joined(begun), total))
    if len(few) < len(bodies):  # beside round ones a thin one may fold to nothing
        few = [fewer_triangles(start, n) for start, n in zip(begun, counts, strict=True)]
    fewer, more = list[Triangles](), min(_THIN, _ALL // len(bodies))
    for simple, start, one in zip(few, begun, bodies, strict=True):
        kept = simple if keeps_volume(simple, start.volume) else fewer_triangles(start, more)
        fewer.append(_as_large(kept, one))
    return fewer


def _as_large(simple: Triangles, body: Triangles) -> Triangles:
    """The simplified surface, at any scale, with the body's volume about the body's centre."""
    own, known = simple.solid, body.solid
    return Triangles(known.centre + np.cbrt(known.size / own.size) * (simple.vertices - own.centre), simple.faces)


def _by_cells(surface: Triangles, most: int, finest: int) -> Triangles:
    """By the finest grid of cells that gives at most so many triangles.

    Each cell's corner is nearest to the planes of the faces there, so that edges stay.
    """
    few, many = 2, finest + 1
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
    patch = linked(len(normal), one[smooth], other[smooth])
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
