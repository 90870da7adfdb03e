"""Areas of the shadow of a surface along each axis."""

import numpy as np
from jaxtyping import Float

from .triangles import Triangles, highest, lowest

_ROWS = 256  # of a shadow, each as wide as at its middle


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
