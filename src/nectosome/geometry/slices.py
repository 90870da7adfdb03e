"""A closed surface cut into slices across x: where its volume lies along it, and how wide it is there."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .triangles import Triangles, area_vectors, highest, lowest

COUNT = 60  # slices, which many smaller numbers divide
_NEAR = 1e-9  # of the length: a corner on a plane


class MeshSlices(NamedTuple):
    """Slices of equal thickness from the least x to the largest."""

    share: Float[np.ndarray, "k"]  # of the volume
    centre: Float[np.ndarray, "k 3"]  # of the volume of each [m]
    half: Float[np.ndarray, "k 2"]  # half of its extent along y and z, on the mean of its two sides [m]

    def mirrored(self) -> "MeshSlices":
        """Those of the image, y against -y."""
        return self._replace(centre=self.centre * [1, -1, 1])

    def joined(self, n: int) -> "MeshSlices":
        """The same in n slices, at most as many; sums of volumes and of their moments stay as they are."""
        edge, cell = np.linspace(0, self.share.size, n + 1), np.arange(self.share.size)
        within = np.minimum(edge[1:, None], cell + 1) - np.maximum(edge[:-1, None], cell)
        within = np.clip(within, 0.0, 1.0)  # how much of each of the old ones lies in each of the new ones
        weight = within * np.maximum(self.share, 1e-12)
        mean = weight / weight.sum(axis=1, keepdims=True)
        return MeshSlices(
            within @ self.share, mean @ self.centre, within @ self.half / within.sum(axis=1, keepdims=True)
        )


def slices_of(surface: Triangles) -> MeshSlices:
    r"""Cut a closed surface.

    By Gauss's theorem with fields along y the cuts, whose normals are along x, add nothing:
    $\int dV = \oint y\, n_y dA$, $\int (x, y, z)\, dV = \oint (x y, y^2/2, z y)\, n_y dA$ over the pieces of faces.
    """
    low, high = surface.bounds
    origin, length = 0.5 * (low + high), high[0] - low[0]
    planes = np.linspace(low[0], high[0], COUNT + 1) - origin[0]
    pieces, at = _cut(surface.corners - origin, planes)

    middles = 0.5 * (pieces + np.roll(pieces, 1, axis=1))  # where means of products are exact
    flux = area_vectors(pieces)[:, 1]
    x, y, z = np.moveaxis(middles, -1, 0)
    volume = np.bincount(at, flux * y.mean(axis=1), COUNT)
    moment = np.stack([np.bincount(at, flux * f.mean(axis=1), COUNT) for f in (x * y, 0.5 * y * y, z * y)], axis=-1)

    total = volume.sum()
    volume = np.where(volume > 1e-12 * total, volume, 0.0)
    middle = np.stack([0.5 * (planes[1:] + planes[:-1]), *np.zeros((2, COUNT))], axis=-1)
    centre = np.where(volume[:, None] > 0, moment / np.where(volume > 0, volume, 1.0)[:, None], middle)
    sides = [
        _half(pieces, at, np.abs(pieces[..., 0] - side[at, None]) < _NEAR * length)
        for side in (planes[:-1], planes[1:])
    ]
    return MeshSlices(volume / volume.sum(), centre + origin, 0.5 * (sides[0] + sides[1]))


def _half(pieces: np.ndarray, at: np.ndarray, there: np.ndarray) -> Float[np.ndarray, "k 2"]:
    """Half extents along y and z of the corners that are `there`, by slice; 0 where there are none."""
    row = np.broadcast_to(at[:, None], there.shape)[there]
    across = pieces[there][:, 1:]
    low, high = np.full((COUNT, 2), np.inf), np.full((COUNT, 2), -np.inf)
    np.minimum.at(low, row, across)
    np.maximum.at(high, row, across)
    return np.where(high >= low, 0.5 * (high - low), 0.0)


def _cut(corners: Float[np.ndarray, "m 3 3"], planes: Float[np.ndarray, "k1"]) -> tuple[np.ndarray, np.ndarray]:
    """Pieces of triangles between planes across x, and the slice of each."""
    last = planes.size - 2
    x = corners[..., 0]
    first = np.clip(np.searchsorted(planes, lowest(x), side="right") - 1, 0, last)
    whole = highest(x) <= planes[first + 1]
    pieces, at, rest = [corners[whole]], [first[whole]], corners[~whole]
    for k, plane in enumerate(planes[1:]):
        begun = lowest(rest[..., 0]) < plane
        below, above = _split(rest[begun], plane) if k < last else (rest, rest[:0])
        rest = np.concatenate([rest[~begun], above])
        ends = highest(rest[..., 0]) <= planes[min(k + 2, last + 1)]
        pieces += [below, rest[ends]]
        at += [np.full(len(below), k), np.full(int(ends.sum()), min(k + 1, last))]
        rest = rest[~ends]
    return np.concatenate(pieces), np.concatenate(at)


def _split(corners: Float[np.ndarray, "m 3 3"], plane: float) -> tuple[np.ndarray, np.ndarray]:
    """Pieces of triangles below and above a plane across x that each of them crosses."""
    over = corners[..., 0] >= plane
    alone = np.where(over.sum(axis=1) == 1, over.argmax(axis=1), (~over).argmax(axis=1))  # on its side of the plane
    turned = corners[np.arange(len(corners))[:, None], (alone[:, None] + np.arange(3)) % 3]
    a, b, c = np.moveaxis(turned, 1, 0)

    def on_plane(end: np.ndarray) -> np.ndarray:
        part = ((plane - a[:, 0]) / (end[:, 0] - a[:, 0]))[:, None]
        return np.concatenate([np.full((len(a), 1), plane), (a + part * (end - a))[:, 1:]], axis=1)

    ab, ac = on_plane(b), on_plane(c)
    tip = np.stack([a, ab, ac], axis=1)
    base = np.stack([np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)], axis=1)
    up = over[np.arange(len(over)), alone]
    return (
        np.concatenate([tip[~up], base[up].reshape(-1, 3, 3)]),
        np.concatenate([tip[up], base[~up].reshape(-1, 3, 3)]),
    )
