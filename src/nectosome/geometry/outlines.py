"""Outlines of plates: lines of drawings, closed polygons in a plane, their checks, and the pieces that draw them."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, show_quantity

MOST_LINES = 2000  # of a drawing: pieces of which some make up the outline
MOST_PLACES = 10_000  # of all its lines, from which on no outline is looked for
MOST_POINTS = 500
TOLERANCE = 2e-4  # of an outline's larger extent, by which curves are off
_NEAR = 1e-9  # of an outline's size: what is nearer coincides


class DrawnLine(NamedTuple):
    """A line of a drawing, open or closed: its points in the drawing's own units, y up, for a tolerance in these."""

    names: tuple[str, ...]  # its label and its id, or its layer; the first one is shown
    points: Callable[[float], Float[np.ndarray, "k 2"]]


class Drawing(NamedTuple):
    """Lines of a drawing, and what one of its units is [m], where it says so."""

    lines: list[DrawnLine]
    unit: float | None
    named_by: str  # how lines are told apart: id, layer
    down: bool = False  # whether its own y runs down


def straightened(bend: float, tolerance: float, coarse: int = 8) -> int:
    """Return into how many straight lines a curve is cut that leaves a single one by `bend` at most, a parabola."""
    return coarse if math.isinf(tolerance) else max(1, min(math.ceil(math.sqrt(bend / tolerance)), MOST_PLACES))


def check_outline(points: Float[np.ndarray, "n 2"]) -> None:
    """Raise InputError for what does not bound one area: too few points, doubled ones, edges that cross or touch."""
    n = len(points)
    if not 3 <= n <= MOST_POINTS:
        raise InputError(f"has {n} points, where 3 to {MOST_POINTS} are expected.")
    size = float(np.ptp(points, axis=0).max())
    onward = np.roll(points, -1, axis=0) - points
    short = np.flatnonzero(np.hypot(*onward.T) <= _NEAR * size)
    if short.size:
        k = int(short[0])
        last = " The last point is joined to the first by itself." if k == n - 1 else ""
        raise InputError(f"points {k} and {(k + 1) % n}, counted from 0, are the same.{last} Leave one of them out.")
    met = _first_meeting(points, onward, size)
    if met is not None:
        i, j, place = met
        where = ", ".join(show_quantity(float(x), "length") for x in place)
        raise InputError(
            f"crosses or touches itself: lines that begin at points {i} and {j}, counted from 0, meet at ({where}). "
            "Draw it as one line around the plate."
        )


def _first_meeting(
    points: Float[np.ndarray, "n 2"], onward: Float[np.ndarray, "n 2"], size: float
) -> tuple[int, int, Float[np.ndarray, "2"]] | None:
    """Return the first two edges that have a point in common beside the corner of neighbours, and that point."""
    n, slack = len(points), _NEAR * size
    i, j = np.triu_indices(n, 1)
    for k in range(0, i.size, 20_000):
        a, b = i[k : k + 20_000], j[k : k + 20_000]
        # the ends of each edge against the line of the other one [m], and the ends along it as shares of it
        across_a, along_a = _seen(points, onward, a, b)
        across_b, along_b = _seen(points, onward, b, a)
        cross = (across_a.prod(axis=1) < 0) & (across_b.prod(axis=1) < 0)
        cross &= (np.abs(across_a) > slack).all(axis=1) & (np.abs(across_b) > slack).all(axis=1)
        touch_a, touch_b = (
            np.asarray((np.abs(across) <= slack) & (along >= -_NEAR) & (along <= 1 + _NEAR))
            for across, along in ((across_a, along_a), (across_b, along_b))
        )
        after, before = b == a + 1, (a == 0) & (b == n - 1)
        touch_a[after, 0] = touch_b[after, 1] = touch_a[before, 1] = touch_b[before, 0] = False  # the common corner
        touches = (touch_a | touch_b).max(axis=1)
        meetings = np.flatnonzero((cross & ~after & ~before) | touches)
        if meetings.size:
            m = int(meetings[0])
            if touches[m]:
                first = touch_a[m].any()
                corner = (b[m] + int(touch_a[m].argmax())) if first else (a[m] + int(touch_b[m].argmax()))
                return int(a[m]), int(b[m]), points[corner % n]
            share = across_b[m, 0] / (across_b[m, 0] - across_b[m, 1])
            return int(a[m]), int(b[m]), points[a[m]] + share * onward[a[m]]
    return None


def _seen(
    points: np.ndarray, onward: np.ndarray, line: np.ndarray, edge: np.ndarray
) -> tuple[Float[np.ndarray, "k 2"], Float[np.ndarray, "k 2"]]:
    """Both ends of edges seen from lines: distances to their left [m], and places along them as shares of them."""
    n = len(points)
    along = onward[line][:, None]
    away = points[np.stack([edge, (edge + 1) % n], axis=1)] - points[line][:, None]
    length = np.hypot(along[..., 0], along[..., 1])
    across = (along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0]) / length
    return across, (along * away).sum(axis=-1) / length**2


def placed(
    outline: Float[np.ndarray, "n 2"], origin: tuple[float, float] | None, source: str, *, down: bool = False
) -> Float[np.ndarray, "n 2"]:
    """An outline of the file `source` from its origin [m], to seven digits; `down` where y of `origin` runs down.

    Raises InputError where none is given and that of the file is not on the plate.
    """
    low, high = outline.min(axis=0), outline.max(axis=0)
    digits = 6 - math.floor(math.log10((high - low).max()))
    if origin is not None:
        return (outline - np.array(origin) * (1, -1 if down else 1)).round(digits) + 0.0
    size = 1e-6 * (high - low).max()
    if (low <= size).all() and (high >= -size).all():
        return outline.round(digits) + 0.0
    (x0, x1), (y0, y1) = sorted([low[0], high[0]]), sorted([low[1] * (-1) ** down, high[1] * (-1) ** down])
    shown = [show_quantity(float(v), "length") for v in (x0, x1, y0, y1)]
    raise InputError(
        f"has its outline from {shown[0]} to {shown[1]} along x and {shown[2]} to {shown[3]} along y, away from its "
        f"own origin. Say which place of it is the part's root, as in origin: [{shown[0]}, {shown[2]}].",
        file=source,
    )


def turned(points: Float[np.ndarray, "n 2"], angle: float) -> Float[np.ndarray, "n 2"]:
    """Points turned about the origin by an angle [rad], from the first axis towards the second, to seven digits."""
    c, s = math.cos(angle), math.sin(angle)
    rotated = points @ np.array([[c, s], [-s, c]])
    return rotated.round(6 - math.floor(math.log10(np.ptp(rotated, axis=0).max()))) + 0.0


def trapezoids(points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "m 4 2"]:
    """Trapezoids between lines across x through all corners, which make up the area: each counterclockwise."""
    x = np.unique(points[:, 0])
    low, high = np.sort([points[:, 0], np.roll(points[:, 0], -1)], axis=0)
    pieces = []
    for left, right in pairwise(x):
        own = np.flatnonzero((low <= left) & (high >= right))
        a, b = points[own], points[(own + 1) % len(points)]
        slope = (b[:, 1] - a[:, 1]) / (b[:, 0] - a[:, 0])
        at = a[:, 1, None] + slope[:, None] * (np.array([left, right]) - a[:, 0, None])  # [edge, left or right]
        at = at[np.argsort(at.sum(axis=1), kind="stable")]
        lower, upper = at[0::2], at[1::2]
        ends = np.broadcast_to([left, right], lower.shape)
        corners = [
            (ends[:, 0], lower[:, 0]),
            (ends[:, 1], lower[:, 1]),
            (ends[:, 1], upper[:, 1]),
            (ends[:, 0], upper[:, 0]),
        ]
        pieces.append(np.stack([np.stack(corner, axis=-1) for corner in corners], axis=1))
    return np.concatenate(pieces)


def plate_faces(points: Float[np.ndarray, "n 2"], thickness: float) -> Float[np.ndarray, "m 4 3"]:
    """Faces of a plate about the plane of its outline, corners counterclockwise as seen from outside; some have three.

    In the axes of the outline, and along their normal z.
    """
    pieces, half = trapezoids(points), 0.5 * thickness
    upper = np.concatenate([pieces, np.full((*pieces.shape[:2], 1), half)], axis=-1)
    lower = upper[:, ::-1] * (1, 1, -1)
    x, y = points.T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0:
        points = points[::-1]
    onward = np.roll(points, -1, axis=0)
    edge = np.stack([points, onward, onward, points], axis=1)
    z = np.broadcast_to(np.array([-half, -half, half, half])[:, None], (len(points), 4, 1))
    return np.concatenate([upper, lower, np.concatenate([edge, z], axis=-1)])
