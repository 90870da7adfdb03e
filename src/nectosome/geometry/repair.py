"""From the triangles of a file to closed bodies with outward normals; what is repaired is told, the rest refused."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .touching import NEAR, any_touch
from .triangles import Triangles, area_vectors, compact, highest, joined, linked, lowest

_STEPS = 2**21 - 1  # of the size along each axis: corners within one are one
_FLAT = 0.02  # how far the corners of a hole may be from their plane, of its size
_SMALL_HOLES = 0.1  # of the whole surface: holes that are closed together
_TINY_HOLE = 1e-3  # of the whole surface: it need not be flat
_THIN = 1e-6  # of the volume of the ball with the same surface, below which a body is a sheet
_MOST_BODIES = 200
_OVERLAP = 0.01  # of the volume, counted twice or the wrong way round
_LINES = 300  # along which bodies are looked through
_PLACES = np.random.default_rng(0).dirichlet(np.ones(3), 9)  # in faces, from their corners: on no edge as seen along z
_SHEET = "it encloses no volume: it is a sheet. Give the part as a closed body."


class UnsoundError(Exception):
    """Why triangles do not bound a body."""


class Bodies(NamedTuple):
    """Closed bodies: all surfaces, those that touch the water, and sentences on what was found and repaired."""

    all: Triangles  # normals of cavities point into them
    outer: Triangles  # without the surfaces of closed cavities
    told: tuple[str, ...]
    touch: bool  # bodies touch or overlap, so that faces of them lie inside


def repaired(vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]) -> Bodies:
    """Closed bodies of the triangles of a file.

    Corners that coincide become one, faces without area are dropped, normals of one body are made to agree and to point
    outwards, flat small holes are closed. Raises UnsoundError for what stays open, encloses no volume or overlaps.
    """
    told: list[str] = []
    vertices, faces = _merged(vertices, faces)
    faces = _without_empty(faces, told)
    faces, body = _agreeing(faces, told)
    vertices, faces, body = _closed(vertices, faces, body, told)
    if (n := int(body.max()) + 1) > _MOST_BODIES:
        raise UnsoundError(f"it has {n} separate bodies, at most {_MOST_BODIES} are read. Leave small parts out.")
    bodies = [compact(vertices, faces[body == k]) for k in range(n)]
    bodies, depth = _outwards(bodies, told)
    everything = joined(bodies)
    wet = [one for one, deep in zip(bodies, depth, strict=True) if deep == 0]
    outer = joined(wet)
    _check_overlap(everything, told)
    touch = any_touch(wet) or _has_inner_faces(outer)
    if touch:
        told.append("bodies in it touch or overlap: faces that lie inside count as wetted")
    return Bodies(everything, outer, tuple(told), touch)


def _merged(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners at the same place as one; those that no face has are left out."""
    vertices, faces = compact(vertices, faces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = np.round((vertices - low) / (high - low).max() * _STEPS).astype(np.int64)
    _, first, same = np.unique(step @ [1 << 42, 1 << 21, 1], return_index=True, return_inverse=True)
    return vertices[first], same[faces]


def _without_empty(faces: np.ndarray, told: list[str]) -> np.ndarray:
    """Faces between three corners, once each; those between bodies that touch, which cancel, are left out."""
    empty = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    if empty.all():
        raise UnsoundError("all of its triangles are without area.")
    faces = faces[~empty]
    turned = np.take_along_axis(faces, (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    _, first = np.unique(_keys(turned), return_index=True)
    if (twice := len(faces) - len(first)) > 0:
        told.append(f"triangles given twice, left out once: {twice}")
    faces = faces[np.sort(first)]
    _, same, sides = np.unique(_keys(np.sort(faces, axis=1)), return_inverse=True, return_counts=True)
    if (sides > 1).any():
        told.append(f"faces between bodies that touch, left out: {int((sides > 1).sum())}")
        faces = faces[sides[same] == 1]
    if not len(faces):
        raise UnsoundError(_SHEET)
    return faces


def _keys(faces: np.ndarray) -> np.ndarray:
    """A number for each triple of corners: three numbers of corners in one would not fit in 64 bits."""
    n = int(faces.max()) + 1
    _, pair = np.unique(faces[:, 0] * n + faces[:, 1], return_inverse=True)
    return pair * n + faces[:, 2]


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """By side of a face: its edge, which way along it, its face; and how many sides each edge has."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    n = int(faces.max()) + 1
    key = ends.min(axis=1) * n + ends.max(axis=1)
    _, edge, sides = np.unique(key, return_inverse=True, return_counts=True)
    return edge, np.where(ends[:, 0] < ends[:, 1], 1, -1), np.tile(np.arange(len(faces)), 3), sides


def _agreeing(faces: np.ndarray, told: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Faces whose neighbours run round the same way, and the body of each."""
    edge, way, face, sides = _edges(faces)
    order = np.argsort(edge, kind="stable")
    paired = order[np.repeat(sides == 2, sides)].reshape(-1, 2)
    one, other = face[paired].T
    turned = way[paired[:, 0]] == way[paired[:, 1]]
    n = len(faces)
    # each face is there twice, as it is and turned round
    rows, columns = np.concatenate([one, one + n]), np.concatenate([other + n * turned, other + n * ~turned])
    label = linked(2 * n, rows, columns)
    as_it_is, other_way = label[:n], label[n:]
    if (as_it_is == other_way).any():
        raise UnsoundError("its surface has one side only, as a Moebius strip has: it bounds no volume.")
    _, body = np.unique(np.minimum(as_it_is, other_way), return_inverse=True)
    flipped = as_it_is > other_way
    bodies = int(body.max()) + 1
    most = np.bincount(body, flipped, bodies) > 0.5 * np.bincount(body, minlength=bodies)
    flipped ^= most[body]
    if flipped.any():
        told.append(f"normals turned round to agree with those beside them: {int(flipped.sum())}")
    return np.where(flipped[:, None], faces[:, ::-1], faces), body


def _balance(edge: np.ndarray, way: np.ndarray, body: np.ndarray) -> np.ndarray:
    """By side of a face: what is left of its edge in its body, 0 where faces meet in pairs."""
    _, own = np.unique(edge * (int(body.max()) + 1) + body, return_inverse=True)
    return np.bincount(own, way)[own]


def _united(edge: np.ndarray, way: np.ndarray, body: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """By side of a face: its body, after those that close up only together are one."""
    shared = (sides[edge] > 2) & (_balance(edge, way, body) != 0)
    if not shared.any():
        return body
    n = int(body.max()) + 1
    label = linked(n + len(sides), body[shared], n + edge[shared])
    return np.unique(label[body], return_inverse=True)[1]


def _closed(
    vertices: np.ndarray, faces: np.ndarray, body: np.ndarray, told: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same with holes filled by fans about their middles."""
    edge, way, face, sides = _edges(faces)
    body = _united(edge, way, body[face], sides)[: len(faces)]
    balance, lone = _balance(edge, way, body[face]), sides[edge] == 1
    if balance[~lone].any():
        raise UnsoundError(
            "more than two of its faces meet at an edge and do not close up. Mend it where it was drawn."
        )
    if not lone.any():
        return vertices, faces, body
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])[lone, ::-1]  # against the faces
    loops, owner = list(_loops(ends)), dict(zip(ends[:, 0].tolist(), body[face[lone]].tolist(), strict=True))
    middles = np.array([vertices[loop].mean(axis=0) for loop in loops])
    whole = np.linalg.norm(area_vectors(vertices[faces]), axis=1).sum()
    shares = [_hole_area(vertices[loop]) / whole for loop in loops]
    if sum(shares) > _SMALL_HOLES:
        raise UnsoundError(f"it is not closed: holes have {100 * sum(shares):.0f} % of the area of all faces.")
    for loop, share in zip(loops, shares, strict=True):
        if share > _TINY_HOLE and not _is_flat(vertices[loop]):
            raise UnsoundError(f"it is not closed: a hole of {100 * share:.2g} % of its area is not flat.")
    told.append(f"holes closed by flat faces: {len(loops)}, with {100 * sum(shares):.2g} % of its area")
    fans = [
        np.stack([loop, np.roll(loop, -1), np.full(len(loop), len(vertices) + k)], axis=1)
        for k, loop in enumerate(loops)
    ]
    owners = [np.full(len(loop), owner[loop[0]]) for loop in loops]
    return np.concatenate([vertices, middles]), np.concatenate([faces, *fans]), np.concatenate([body, *owners])


def _loops(ends: np.ndarray) -> Iterator[np.ndarray]:
    """Rims of holes: corners in turn, from edges that lead from corner to corner."""
    follow = dict(ends.tolist())
    touching = UnsoundError("it is not closed, and its holes touch one another. Close them where it was drawn.")
    if len(follow) < len(ends):
        raise touching
    while follow:
        loop = [next(iter(follow))]
        while (step := follow.pop(loop[-1], None)) is not None and step != loop[0]:
            loop.append(step)
        if step is None:
            raise touching
        yield np.array(loop)


def _fan(rim: np.ndarray) -> np.ndarray:
    """Sum of the areas of a fan about the middle of a rim, along their normals."""
    middle = np.broadcast_to(rim.mean(axis=0), rim.shape)
    return area_vectors(np.stack([rim, np.roll(rim, -1, axis=0), middle], axis=1)).sum(axis=0)


def _hole_area(rim: np.ndarray) -> float:
    return float(np.linalg.norm(_fan(rim)))


def _is_flat(rim: np.ndarray) -> bool:
    away = np.abs((rim - rim.mean(axis=0)) @ _fan(rim)).max()
    return bool(away <= _FLAT * np.ptp(rim, axis=0).max() * _hole_area(rim))


def _outwards(bodies: list[Triangles], told: list[str]) -> tuple[list[Triangles], list[int]]:
    """Bodies with normals out of their matter, and in how many others each of them lies."""
    volumes = np.array([one.volume for one in bodies])
    areas = np.array([one.surface.size for one in bodies])
    sheets = np.abs(volumes) < _THIN * areas**1.5 / 10.6  # a ball has V = A^1.5 / (6 sqrt(pi))
    if sheets.all():
        raise UnsoundError(_SHEET)
    if sheets.any():
        told.append(f"sheets without volume, left out: {int(sheets.sum())}")
        bodies = [one for one, sheet in zip(bodies, sheets, strict=True) if not sheet]
        volumes = volumes[~sheets]
    inside = [[k for k, other in enumerate(bodies) if k != i and _within(one, other)] for i, one in enumerate(bodies)]
    depth = [len(around) for around in inside]
    outward, turned, cavities = [], 0, 0
    for one, volume, around in zip(bodies, volumes, inside, strict=True):
        hollow = len(around) % 2 == 1
        if hollow:
            nearest = max(around, key=lambda k: depth[k])
            if (volume > 0) == (volumes[nearest] > 0):
                raise UnsoundError(
                    "a body lies within another one, so that its volume counts twice. Take it out, or turn its normals "
                    "round if it is a cavity."
                )
            cavities += 1
        flip = (volume < 0) != hollow
        turned += flip
        outward.append(Triangles(one.vertices, one.faces[:, ::-1]) if flip else one)
    if len(outward) > cavities + 1:
        told.append(f"separate bodies, which make one part: {len(outward) - cavities}")
    if cavities:
        told.append(f"closed cavities, without matter and without water: {cavities}")
    if turned:
        told.append(f"normals turned round, which pointed into the matter: {turned} of {len(outward)} surfaces")
    return outward, depth


def _within(one: Triangles, other: Triangles) -> bool:
    """Whether most of some places on a body lie in another one: a line from there crosses it an odd number of times.

    A line that runs along an edge of the other one misses the faces on both sides of it.
    """
    (low, high), (outer_low, outer_high) = one.bounds, other.bounds
    if (low < outer_low).any() or (high > outer_high).any():
        return False
    seen, faces = _Seen.of(other), np.linspace(0, len(one.faces) - 1, len(_PLACES)).astype(int)
    points = np.einsum("ik,ikj->ij", _PLACES, one.corners[faces])
    return sum(seen.count_above(x) % 2 for x in points) > len(points) / 2


def _has_inner_faces(surface: Triangles) -> bool:
    """Whether a face at an edge of more than two has more of the body on its outer side, as where bodies touch."""
    edge, _, face, sides = _edges(surface.faces)
    corners = surface.corners[np.unique(face[sides[edge] > 2])]
    normal = area_vectors(corners)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    beside = _PLACES[0] @ corners + NEAR * np.ptp(surface.bounds, axis=0).max() * normal
    seen = _Seen.of(surface)
    return any(seen.count_above(x) % 2 for x in beside)


class _Seen(NamedTuple):
    """Faces as seen along z."""

    corners: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, surface: Triangles) -> "_Seen":
        corners = surface.corners
        flat = corners[..., :2]
        return cls(corners, lowest(flat).T.copy(), highest(flat).T.copy())

    def crossings(self, at: Float[np.ndarray, "2"]) -> tuple[np.ndarray, np.ndarray]:
        """Heights at which a line along z crosses faces; 1 where it comes in from below, -1 where it goes out."""
        near = (self.low[0] <= at[0]) & (self.high[0] >= at[0]) & (self.low[1] <= at[1]) & (self.high[1] >= at[1])
        c = self.corners[near]
        flat = c[..., :2] - at
        after, last = np.roll(flat, -1, axis=1), np.roll(flat, -2, axis=1)
        weight = after[..., 0] * last[..., 1] - after[..., 1] * last[..., 0]  # of each corner, twice an area
        hit = (weight > 0).all(axis=1) | (weight < 0).all(axis=1)
        weight, c = weight[hit], c[hit]
        return np.sum(weight * c[..., 2], axis=1) / weight.sum(axis=1), -np.sign(weight[:, 0])

    def count_above(self, point: Float[np.ndarray, "3"]) -> int:
        """How often a line upwards from a point crosses faces: an odd number from inside."""
        return int(np.sum(self.crossings(point[:2])[0] > point[2]))


def _check_overlap(surface: Triangles, told: list[str]) -> None:
    """Look along lines whether each goes in and out in turn: what is inside twice, or in reverse, counts wrongly."""
    low, high = surface.bounds
    seen, k = _Seen.of(surface), np.arange(1, _LINES + 1)
    share = np.stack([k * 0.7548776662466927, k * 0.5698402909980532], axis=-1) % 1  # Roberts' sequence R2
    right = wrong = 0.0
    for at in low[:2] + share * (high - low)[:2]:
        z, step = seen.crossings(at)
        order = np.argsort(z)
        length, deep = np.diff(z[order]), np.cumsum(step[order])
        if deep.size and deep[-1] == 0:  # else it ran along an edge
            right += length[deep[:-1] > 0].sum()
            wrong += (np.abs(deep[:-1] - np.clip(deep[:-1], 0, 1)) * length).sum()
    if wrong > _OVERLAP * right:
        share = f"about {100 * wrong / right:.0f} %" if right > 0 else "all"
        why = f"parts of it overlap: {share} of its volume counts twice or the wrong way round."
        raise UnsoundError(f"{why} Unite its bodies where they were drawn.")
    if wrong > 1e-6 * right:
        told.append(f"parts of it overlap: about {100 * wrong / right:.2g} % of its volume counts twice")
