"""Triangles of even size in place of those that a CAD program makes: long and thin here, tiny there.

Edges that do not matter are collapsed, and those that are too long halved. Then the edges that matter least are
collapsed, one after the other, until a given number of triangles is left: those whose vertices move least away from
the planes of the triangles around them (Garland and Heckbert 1997), and the short ones first. All edges that do not
touch each other go at once.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from .triangles import Triangles, area_vectors, compact

_MOST = 100_000  # triangles, from which on edges are not halved
_CHEAP = 1e-3  # cost of a collapse before edges are halved, over the side squared: edges of half a side where flat
_LONGER = 1.01  # of a long edge by a collapse
_LONGEST = 1.8  # edge that a collapse may make, over that of the even triangles
_EVEN = 0.003  # weight of an edge's length squared, beside the squared distance that its collapse moves the surface
_TURN = 0.3  # least cosine of the angle by which a collapse turns a triangle


class _Edges(NamedTuple):
    """Each edge of a surface once, and the triangles beside it."""

    ends: Int[np.ndarray, "e 2"]  # the lower index first
    of_sides: Int[np.ndarray, "m 3"]  # edge of each side of each triangle


def even_triangles(triangles: Triangles, count: int) -> Triangles:
    """Closed surface of at most about `count` triangles that are about as long as wide, with the same volume.

    Sharp edges stay sharp. A round section loses volume to its few corners, for which the whole surface is scaled: by
    0.7 % for a cylinder twenty times as long as wide of 1000 triangles. Parts much thinner than a triangle is long keep
    their thickness, but not their outline to less than that. A surface that cannot be taken to so few triangles keeps
    more.
    """
    side = np.sqrt(4 / np.sqrt(3) * triangles.surface.size / count)
    few = _collapsed(triangles, count, side, _CHEAP * side**2)
    return _as_large_as(triangles, _collapsed(_halved(few, side), count, side, np.inf))


def fewer_triangles(triangles: Triangles, count: int) -> Triangles:
    """Closed surface of at most so many triangles of any size, by the collapses that move it least.

    A surface that cannot be taken to so few keeps more.
    """
    return _collapsed(triangles, count, np.ptp(triangles.bounds, axis=0).max(), np.inf)


def _as_large_as(original: Triangles, coarse: Triangles) -> Triangles:
    """The coarse surface, scaled about its middle to the volume of the original."""
    middle = coarse.vertices.mean(axis=0)
    scale = np.cbrt(original.solid.size / coarse.solid.size)
    return Triangles(middle + scale * (coarse.vertices - middle), coarse.faces)


def _edges(faces: np.ndarray, n: int) -> _Edges:
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys, inverse = np.unique(sides[:, 0] * n + sides[:, 1], return_inverse=True)
    return _Edges(np.stack(np.divmod(keys, n), axis=1), inverse.reshape(-1, 3))


def _halved(triangles: Triangles, side: float) -> Triangles:
    """Halve edges longer than 1.2 sides until there are none, or there are too many triangles."""
    vertices, faces = triangles
    while len(faces) < _MOST:
        edges = _edges(faces, len(vertices))
        ends = vertices[edges.ends]
        long = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > 1.2 * side
        if not long.any():
            break
        new = np.full(len(long), -1)
        new[long] = len(vertices) + np.arange(long.sum())
        faces = _cut(faces, new[edges.of_sides])
        vertices = np.concatenate([vertices, ends[long].mean(axis=1)])
    return Triangles(vertices, faces)


def _cut(faces: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Triangles cut at the middles of their sides, -1 where a side has none."""
    number = (middles >= 0).sum(axis=1)
    # turned so that with one middle it is on the first side, with two the third side has none
    first = np.where(
        number == 1, np.argmax(middles >= 0, axis=1), np.where(number == 2, np.argmin(middles, axis=1) + 1, 0)
    )
    turn = (first[:, None] + np.arange(3)) % 3
    (a, b, c), (p, q, r) = np.take_along_axis(faces, turn, 1).T, np.take_along_axis(middles, turn, 1).T
    pieces = {
        0: ((a, b, c),),
        1: ((a, p, c), (p, b, c)),
        2: ((p, b, q), (a, p, q), (a, q, c)),
        3: ((a, p, r), (p, b, q), (r, q, c), (p, q, r)),
    }
    return np.concatenate([np.stack(one, axis=1)[number == k] for k, cut in pieces.items() for one in cut])


def _collapsed(triangles: Triangles, count: int, side: float, dearest: float) -> Triangles:
    """Collapse edges at less than a cost [m2] until `count` triangles are left, or no edge may be."""
    vertices, faces = triangles.vertices.copy(), triangles.faces
    n, rng = len(vertices), np.random.default_rng(0)
    quadrics = _quadrics(vertices, faces)
    refused = np.zeros(0, np.int64)  # edges that may not collapse as things stand
    while len(faces) > count:
        ends = _edges(faces, n).ends
        keys = ends[:, 0] * n + ends[:, 1]
        places, costs = _merged(vertices, quadrics, ends)
        open_ = ~np.isin(keys, refused) & (costs < dearest)
        if not open_.any():
            break
        ends, keys, places, costs = ends[open_], keys[open_], places[open_], costs[open_]
        costs = (costs + 1e-9 * side**2) * (1 + 0.2 * rng.random(len(costs)))  # no rows of edges one after the other
        few = np.argsort(costs)[: max(len(costs) // 3, 50)]
        chosen = few[_apart(ends[few], faces, n)][: max((len(faces) - count + 1) // 2, 1)]
        sound = _sound(vertices, faces, ends[chosen], places[chosen], _LONGEST * side)
        refused = np.concatenate([refused, keys[chosen[~sound]]])
        chosen = chosen[sound]
        kept, gone = ends[chosen].T
        vertices[kept], quadrics[kept] = places[chosen], quadrics[kept] + quadrics[gone]
        onto = np.arange(n)
        onto[gone] = kept
        faces = onto[faces]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return compact(vertices, faces)


def _quadrics(vertices: np.ndarray, faces: np.ndarray) -> Float[np.ndarray, "n 4 4"]:
    """Squared distances from the planes of the triangles at each vertex, weighted by a third of their areas."""
    areas = area_vectors(vertices[faces])
    sizes = np.linalg.norm(areas, axis=1)
    unit = areas / np.where(sizes > 0, sizes, 1.0)[:, None]
    planes = np.concatenate([unit, -np.einsum("ij,ij->i", unit, vertices[faces[:, 0]])[:, None]], axis=1)
    each = (sizes / 3)[:, None, None] * planes[:, :, None] * planes[:, None, :]
    quadrics = np.zeros((len(vertices), 4, 4))
    for k in range(3):
        np.add.at(quadrics, faces[:, k], each)
    return quadrics


def _merged(
    vertices: np.ndarray, quadrics: np.ndarray, ends: np.ndarray
) -> tuple[Float[np.ndarray, "e 3"], Float[np.ndarray, "e"]]:
    """Best place for both ends of each edge as one vertex, and the cost [m2] of moving them there."""
    both = quadrics[ends].sum(axis=1)
    area = np.trace(both[:, :3, :3], axis1=1, axis2=2)
    area = np.where(area > 0, area, 1.0)
    middle = vertices[ends].mean(axis=1)
    # the middle counts a little, or a place on a flat side would be anywhere
    pull = 1e-3 * area
    matrix = both[:, :3, :3] + pull[:, None, None] * np.eye(3)
    places = np.linalg.solve(matrix, (pull[:, None] * middle - both[:, :3, 3])[..., None])[..., 0]
    at = np.concatenate([places, np.ones((len(places), 1))], axis=1)
    away = np.einsum("ei,eij,ej->e", at, both, at) / area
    length = np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)
    return places, np.maximum(away, 0.0) + _EVEN * length**2


def _apart(ends: np.ndarray, faces: np.ndarray, n: int) -> Bool[np.ndarray, "e"]:
    """Which edges, the best one first, are better than all others whose triangles touch theirs."""
    rank = np.arange(len(ends))
    best = np.full(n, len(ends))
    for k in range(2):
        np.minimum.at(best, ends[:, k], rank)
    around = best.copy()
    for k in range(3):
        np.minimum.at(around, faces[:, k], best[faces].min(axis=1))
    return (around[ends] == rank[:, None]).all(axis=1)


def _sound(
    vertices: np.ndarray, faces: np.ndarray, ends: np.ndarray, places: np.ndarray, longest: float
) -> Bool[np.ndarray, "e"]:
    """Which edges may collapse: the surface stays one, no triangle turns over, no edge gets long."""
    from scipy.sparse import csr_array

    n = len(vertices)
    sides = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    near = csr_array((np.ones(len(sides), np.int32), (sides[:, 0], sides[:, 1])), shape=(n, n))
    common = near[ends[:, 0]].multiply(near[ends[:, 1]]).sum(axis=1)
    sound = np.asarray(common).ravel() == 2
    edge = np.full(n, -1)  # that each vertex is an end of
    edge[ends[:, 0]] = edge[ends[:, 1]] = np.arange(len(ends))
    own = edge[faces]  # no two edges share a triangle
    of = own.max(axis=1)
    stays = (of >= 0) & ((own >= 0).sum(axis=1) == 1)
    of, own, kept = of[stays], own[stays], faces[stays]
    corners = vertices[kept]
    moved = np.where((own >= 0)[..., None], places[of][:, None, :], corners)
    before, after = area_vectors(corners), area_vectors(moved)
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    turned = np.einsum("ij,ij->i", before, after) < _TURN * sizes
    lengths = (np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1) for x in (corners, moved))
    was, is_ = lengths
    bad = turned | (is_ > np.maximum(longest, _LONGER * was))
    sound[of[bad]] = False
    return sound
