"""Closed surfaces of triangles as plain data, and their moments, exact for the polyhedron."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

_ROUNDING = 1e-14  # of the extent


class Moments(NamedTuple):
    r"""Size, centre and $\int (r^2 1 - r r^T)$ about the centre, axes as given, of a solid or of a surface.

    The third is an inertia over a density [m5] of a solid, over a mass per area [m4] of a surface.
    """

    size: float  # volume [m3] or area [m2]
    centre: Float[np.ndarray, "3"]  # [m]
    inertia: Float[np.ndarray, "3 3"]


class Triangles(NamedTuple):
    """A closed surface: the corners of each face run counter-clockwise as seen from outside.

    Each vertex is a corner of a face.
    """

    vertices: Float[np.ndarray, "n 3"]  # [m]
    faces: Int[np.ndarray, "m 3"]

    @property
    def corners(self) -> Float[np.ndarray, "m 3 3"]:
        """The three corners of each face [m]."""
        return self.vertices[self.faces]

    @property
    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Least and largest coordinates [m]."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def mirrored(self) -> "Triangles":
        """Its image, y against -y."""
        return Triangles(self.vertices * [1, -1, 1], self.faces[:, ::-1])

    @property
    def volume(self) -> float:
        """Volume inside [m3], also of what is folded to nothing."""
        return float(np.sum(_tetrahedra(self.corners - self.bounds.mean(axis=0))))

    @property
    def solid(self) -> Moments:
        """Moments of the volume inside: sums over tetrahedra from the faces to one point."""
        origin = self.bounds.mean(axis=0)
        corners = self.corners - origin
        return _moments(_tetrahedra(corners), corners, 4, origin)

    @property
    def surface(self) -> Moments:
        """Moments of the surface itself."""
        origin = self.bounds.mean(axis=0)
        corners = self.corners - origin
        return _moments(np.linalg.norm(area_vectors(corners), axis=1), corners, 3, origin)


def compact(vertices: Float[np.ndarray, "n 3"], faces: Int[np.ndarray, "m 3"]) -> Triangles:
    """The surface of some faces, without vertices that none of them has."""
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    return Triangles(vertices[used], (np.cumsum(used) - 1)[faces])


def lowest(corners: Float[np.ndarray, "n 3 *k"]) -> Float[np.ndarray, "n *k"]:
    """The least of three corners; NumPy along so short an axis takes three times as long."""
    return np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2])


def highest(corners: Float[np.ndarray, "n 3 *k"]) -> Float[np.ndarray, "n *k"]:
    """The largest of three corners."""
    return np.maximum(np.maximum(corners[:, 0], corners[:, 1]), corners[:, 2])


def joined(bodies: Sequence[Triangles]) -> Triangles:
    """Several bodies as one surface."""
    before = np.cumsum([0, *(len(one.vertices) for one in bodies)])
    faces = [one.faces + first for one, first in zip(bodies, before[:-1], strict=True)]
    return Triangles(np.concatenate([one.vertices for one in bodies]), np.concatenate(faces))


def separate(surface: Triangles) -> list[Triangles]:
    """The bodies of `joined`: faces that have vertices in common are of one body."""
    a, b, c = surface.faces.T
    ends = np.concatenate([a, b]), np.concatenate([b, c])
    group = linked(len(surface.vertices), *ends)
    return [compact(surface.vertices, surface.faces[group[a] == k]) for k in range(group.max() + 1)]


def linked(n: int, one: Int[np.ndarray, "k"], other: Int[np.ndarray, "k"]) -> Int[np.ndarray, "{n}"]:
    """Number of the group of each of n things, of which links join pairs; groups are in the order of their first.

    Each group takes the least name among its neighbours' until none differ (Shiloach and Vishkin 1982): SciPy's graphs
    take longer to import than most meshes to read.
    """
    name = np.arange(n)
    while True:
        a, b = name[one], name[other]
        differ = a != b
        if not differ.any():
            return np.unique(name, return_inverse=True)[1]
        one, other, a, b = one[differ], other[differ], a[differ], b[differ]
        np.minimum.at(name, np.maximum(a, b), np.minimum(a, b))
        while not np.array_equal(name, above := name[name]):
            name = above


def area_vectors(corners: Float[np.ndarray, "m 3 3"]) -> Float[np.ndarray, "m 3"]:
    """Areas of triangles along their outward normals [m2]."""
    return 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _tetrahedra(corners: Float[np.ndarray, "m 3 3"]) -> Float[np.ndarray, "m"]:
    """Signed volumes between triangles and the origin."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.sum(a * np.cross(b, c), axis=1) / 6


def _moments(weight: np.ndarray, corners: np.ndarray, points: int, origin: np.ndarray) -> Moments:
    r"""Of simplices of these sizes, with as many `points`: the corners, and the origin where there are four.

    Of one with k points, of which the origin counts as 0, $\int x = w \sum x_i / k$ and
    $\int x x^T = w (\sum x_i x_i^T + \sum x_i \sum x_i^T) / (k (k + 1))$.
    """
    size, total = weight.sum(), corners.sum(axis=1)
    centre = weight @ total / points / size
    each = (weight[:, None, None] * corners).reshape(-1, 3).T @ corners.reshape(-1, 3)
    second = each + (weight[:, None] * total).T @ total
    second = second / (points * (points + 1)) - size * np.outer(centre, centre)
    place = centre + origin
    place[np.abs(place) < _ROUNDING * np.ptp(corners)] = 0.0  # that of a part which is the same on both sides
    return Moments(float(size), place, np.trace(second) * np.eye(3) - second)
