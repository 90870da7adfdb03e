"""Outlines of plates as sections of meshes: the one closed line in which a plane cuts a surface."""

from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from nectosome.units import InputError, show_quantity

from .mesh_files import read_mesh_bytes
from .mesh_numbers import UNITS, outer_surface
from .outlines import TOLERANCE, check_outline, placed
from .triangles import Triangles

_AXES = {"xy": ([0, 1], 2), "xz": ([0, 2], 1)}  # of a plane, and across it


def read_section(
    path: str | Path,
    unit: str,
    *,
    plane: Literal["xy", "xz"],
    across: float = 0.0,
    tolerance: float | None = None,
    origin: tuple[float, float] | None = None,
    source: str = "",
) -> Float[np.ndarray, "n 2"]:
    """Return the corners [m] of the section of a mesh, from `origin` [m] in its own axes, counterclockwise.

    - unit: of the numbers in the file, a key of `UNITS`; `source` is what messages call it.
    - across: place of the plane, along z of an xy plane and along y of an xz plane [m].
    - tolerance: largest distance of the corners that are left out [m]; 1/5000 of the larger extent without it.

    Raises InputError for what is no mesh or bounds no body, for another unit, and for a section that is no outline: the
    plane passes by, or cuts the surface in several lines.
    """
    source = source or str(path)
    if unit not in UNITS:
        raise InputError(f"has a mesh, whose unit is one of {', '.join(UNITS)}, not {unit}.", file=source)
    surface = outer_surface(read_mesh_bytes(path, source), unit, source)
    (a, b), axis = _AXES[plane]
    try:
        line = _one_line(surface, axis, across)[:, [a, b]]
        size = float(np.ptp(line, axis=0).max())
        outline = thinned(line, max(TOLERANCE * size if tolerance is None else tolerance, 1e-9 * size))
        check_outline(outline)
    except InputError as error:
        raise InputError(f"its section {error.message}", file=source) from None
    x, y = outline.T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0:
        outline = outline[::-1]
    return placed(outline, origin, source)


def _one_line(surface: Triangles, axis: int, across: float) -> Float[np.ndarray, "n 3"]:
    """Points in order around the one closed line in which the plane cuts a closed surface.

    Corners in the plane count to its upper side, and where then none is below it, to its lower side: a part that stands
    on the plane has the outline of its foot.
    """
    away = surface.vertices[:, axis] - across
    for above in (away >= 0, away > 0):
        lines = _lines(surface, away, above)
        if len(lines) > 1:
            why = f"consists of {len(lines)} closed lines, where one is expected. A plate has no holes and is one piece"
            raise InputError(f"{why}: take another plane.")
        if lines:
            return lines[0]
    low, high = (float(x) for x in surface.bounds[:, axis])
    between = f"from {show_quantity(low, 'length')} to {show_quantity(high, 'length')}"
    raise InputError(
        f"is empty: the plane is at {show_quantity(across, 'length')} along {'xyz'[axis]}, the mesh {between}."
    )


def _lines(
    surface: Triangles, away: Float[np.ndarray, "n"], above: Bool[np.ndarray, "n"]
) -> list[Float[np.ndarray, "k 3"]]:
    """The closed lines between vertices above and those that are not: a point on each edge between both."""
    faces = surface.faces
    mixed = faces[above[faces].any(axis=1) & ~above[faces].all(axis=1)]
    up, down = (_crossing(mixed, above, rising=rising) for rising in (True, False))
    # each face goes from the edge by which its border rises to the one by which it falls, which is the next face's
    onward = {tuple(begin): tuple(end) for begin, end in zip(up.tolist(), down[:, ::-1].tolist(), strict=True)}
    lines = []
    while onward:
        edge = first = next(iter(onward))
        edges = []
        while edge in onward:
            edges.append(edge)
            edge = onward.pop(edge)
        if edge != first:
            raise InputError("is an open line: the surface has a gap there. Take another plane.")
        i, j = np.array(edges).T
        share = (away[i] / (away[i] - away[j]))[:, None]
        lines.append(surface.vertices[i] + share * (surface.vertices[j] - surface.vertices[i]))
    return lines


def _crossing(faces: Int[np.ndarray, "m 3"], above: Bool[np.ndarray, "n"], *, rising: bool) -> Int[np.ndarray, "m 2"]:
    """The edge of each face, from corner to corner along its border, that rises above the plane or falls below it."""
    begins, ends = faces, np.roll(faces, -1, axis=1)
    which = (above[ends] & ~above[begins]) if rising else (above[begins] & ~above[ends])
    k = which.argmax(axis=1)
    rows = np.arange(len(faces))
    return np.stack([begins[rows, k], ends[rows, k]], axis=1)


def thinned(line: Float[np.ndarray, "n 2"], tolerance: float) -> Float[np.ndarray, "k 2"]:
    """Corners of a closed line without those that are nearer to the others' straight lines than a tolerance.

    Halved where the distance is largest (Ramer 1972; Douglas and Peucker 1973), from two corners far apart on.
    """
    start = int(np.hypot(*(line - line.mean(axis=0)).T).argmax())
    closed = np.concatenate([np.roll(line, -start, axis=0), line[start : start + 1]])
    far = int(np.hypot(*(closed - closed[0]).T).argmax())
    kept, waiting = {0, far}, [(0, far), (far, len(line))]
    while waiting:
        i, j = waiting.pop()
        if j - i < 2:
            continue
        away = _from_segment(closed[i + 1 : j], closed[i], closed[j])
        k = i + 1 + int(away.argmax())
        if away.max() > tolerance:
            kept.add(k)
            waiting += [(i, k), (k, j)]
    return closed[sorted(kept)]


def _from_segment(
    points: Float[np.ndarray, "n 2"], a: Float[np.ndarray, "2"], b: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "n"]:
    """Distances of points from the straight line between a and b."""
    along = b - a
    share = np.clip((points - a) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
    return np.hypot(*(points - a - share[:, None] * along).T)
