"""Whether closed bodies touch or cross one another, by their triangles."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

from .triangles import Triangles

NEAR = 1e-5  # of the extent of all: bodies that are nearer touch
_PAIRS = 20_000  # of triangles that are looked at together


def any_touch(bodies: Sequence[Triangles]) -> bool:
    """Whether faces of two of the bodies touch or cross. One that is wholly inside another does neither."""
    bounds = np.array([one.bounds for one in bodies])
    near = NEAR * (bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max()
    pairs = (pair for pair in combinations(range(len(bodies)), 2) if _close(bounds[pair[0]], bounds[pair[1]], near))
    return any(_touch(bodies[i].corners, bodies[j].corners, near) for i, j in pairs)


def _close(one: Float[np.ndarray, "2 3"], other: Float[np.ndarray, "2 3"], near: float) -> bool:
    return bool((one[0] <= other[1] + near).all() and (other[0] <= one[1] + near).all())


def _touch(one: Float[np.ndarray, "n 3 3"], other: Float[np.ndarray, "m 3 3"], near: float) -> bool:
    """Whether triangles of two sets are nearer than `near` [m]: half by half of the box that both sets are in."""
    low = np.maximum(one.min(axis=(0, 1)), other.min(axis=(0, 1))) - near
    high = np.minimum(one.max(axis=(0, 1)), other.max(axis=(0, 1))) + near
    todo = [(one, other, low, high)]
    while todo:
        one, other, low, high = todo.pop()
        one, other = (x[((x.min(axis=1) <= high) & (x.max(axis=1) >= low)).all(axis=1)] for x in (one, other))
        size = high - low
        if len(one) * len(other) <= _PAIRS or size.max() < 8 * near:
            if _any_near(one, other, near):
                return True
            continue
        middle = low + 0.5 * np.where(np.arange(3) == size.argmax(), size, 0.0)
        lower = np.where(middle > low, middle, high)
        todo += [(one, other, low, lower), (one, other, middle, high)]
    return False


def _any_near(one: np.ndarray, other: np.ndarray, near: float) -> bool:
    rows = max(_PAIRS // max(len(other), 1), 1)
    for begin in range(0, len(one), rows):
        some = one[begin : begin + rows]
        a, b = some[:, None], other[None]
        boxes = (a.min(axis=2) <= b.max(axis=2) + near) & (b.min(axis=2) <= a.max(axis=2) + near)
        i, j = np.nonzero(boxes.all(axis=2))
        if _near(some[i], other[j], near).any():
            return True
    return False


def _near(one: Float[np.ndarray, "n 3 3"], other: Float[np.ndarray, "n 3 3"], near: float) -> Bool[np.ndarray, "n"]:
    """Which pairs of triangles no plane keeps apart by more than `near` [m].

    Of its possible normals 17 are enough: both normals, those of sides within each plane, and products of two sides.
    """
    sides, others = (np.roll(x, -1, axis=1) - x for x in (one, other))
    normal, its_normal = (np.cross(x[:, :1], x[:, 1:2]) for x in (sides, others))
    products = np.cross(sides[:, :, None], others[:, None]).reshape(-1, 9, 3)
    axes = np.concatenate([normal, its_normal, np.cross(normal, sides), np.cross(its_normal, others), products], axis=1)
    length = np.linalg.norm(axes, axis=2, keepdims=True)
    axes /= np.where(length > 0, length, 1.0)
    at, its = axes @ one.swapaxes(1, 2), axes @ other.swapaxes(1, 2)
    gap = np.maximum(at.min(axis=2) - its.max(axis=2), its.min(axis=2) - at.max(axis=2))
    return (gap <= near).all(axis=1)
