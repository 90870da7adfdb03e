"""Outlines in drawings, SVG and DXF: the one closed line in them, its curves by straight lines, in metres."""

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from nectosome.geometry.dxf import read_dxf
from nectosome.geometry.svg import read_svg
from nectosome.io.file_system import exists, is_file, reason
from nectosome.units import InputError, shorten, show_quantity

from .outlines import MOST_LINES, MOST_PLACES, MOST_POINTS, TOLERANCE, Drawing, DrawnLine, check_outline, placed

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}  # [m]
MOST_BYTES = 2_000_000
_FARTHEST, _SMALLEST = 1e4, 1e-8  # [m], of what an outline may be
_GAP = 1e-4  # of the same: ends that are nearer meet


def read_outline(
    path: str | Path,
    *,
    name: str | None = None,
    unit: str | None = None,
    tolerance: float | None = None,
    origin: tuple[float, float] | None = None,
) -> Float[np.ndarray, "n 2"]:
    """Return the points [m] of the one closed line of an SVG or DXF file, from `origin` [m] in it, y up.

    - name: id of the line in an SVG file, its layer in a DXF file; without it the file has only this line.
    - unit: of the drawing's coordinates, a key of `UNITS`, where the file does not say it.
    - tolerance: largest distance of the straight lines from a curve [m]; 1/5000 of the larger extent without it.
    - origin: the y of an SVG file runs down, as drawing programs show it.

    Raises InputError for a file that cannot be read, that is no drawing or too large, without a unit or with another
    one, and for lines that are no outline.
    """
    source, ending = str(path), Path(path).suffix.lower()
    if ending not in (".svg", ".dxf"):
        raise InputError(
            f'is no drawing by its ending: "{shorten(ending)}". An .svg or .dxf file is read.', file=source
        )
    try:
        drawing = (read_svg if ending == ".svg" else read_dxf)(_bytes(path))
        lines = _called(drawing, name)
        metre = _unit(drawing, unit)
        rough = np.concatenate(_bounded(lines, math.inf))
        if not np.abs(rough).max() * metre < _FARTHEST:
            raise InputError(f"has places beyond {show_quantity(_FARTHEST, 'length')}. Check its unit.")
        size = float(np.ptp(rough, axis=0).max())
        if size * metre < _SMALLEST:
            raise InputError(f"is smaller than {show_quantity(_SMALLEST, 'length')}. Check its unit.")
        fine = TOLERANCE * size if tolerance is None else tolerance / metre
        pieces = _bounded(lines, max(fine, 1e-7 * size))
        outline = metre * _one_loop(pieces, lines, drawing, size)
        if len(outline) > MOST_POINTS:
            why = f"needs {len(outline)} points at a tolerance of {show_quantity(metre * fine, 'length')}"
            raise InputError(f"{why}, and at most {MOST_POINTS} are taken. Give a larger tolerance, or a plainer line.")
        check_outline(outline)
    except InputError as error:
        raise InputError(error.message, file=source) from None
    return placed(outline, origin, source, down=drawing.down)


def _bytes(path: str | Path) -> bytes:
    if exists(path) and not is_file(path):
        raise InputError("cannot be read: this is no file.")
    try:
        with Path(path).open("rb") as file:
            raw = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {reason(error)}.") from None
    if len(raw) > MOST_BYTES:
        raise InputError(f"larger than {MOST_BYTES // 1_000_000} MB, which is too large. Save the outline alone.")
    return raw


def _bounded(lines: list[DrawnLine], tolerance: float) -> list[np.ndarray]:
    """Points of lines, of which there are not too many."""
    outlines, count = list[np.ndarray](), 0
    for line in lines:
        outlines.append(line.points(tolerance))
        count += len(outlines[-1])
        if count > MOST_PLACES:
            raise InputError(f"has more than {MOST_PLACES} points. Save the outline alone, or give a larger tolerance.")
    return outlines


def _called(drawing: Drawing, name: str | None) -> list[DrawnLine]:
    """The lines of a name, or all."""
    if not drawing.lines:
        raise InputError("has no lines.")
    lines = [line for line in drawing.lines if name is None or name in line.names]
    if not lines:
        known = _listed(line.names[0] for line in drawing.lines)
        raise InputError(f'has no line with the {drawing.named_by} "{shorten(name)}". There are: {known}.')
    if len(lines) > MOST_LINES:
        raise InputError(f"has {len(lines)} lines, at most {MOST_LINES} are read. Save the outline alone.")
    return lines


def _listed(names: Iterable[str]) -> str:
    return shorten(", ".join(dict.fromkeys(name or "(none)" for name in names)), 200)


def _unit(drawing: Drawing, unit: str | None) -> float:
    """Unit of the coordinates [m]."""
    own, given = drawing.unit, None if unit is None else UNITS[unit]
    if own is None:
        if given is None:
            raise InputError("does not say its unit. Give it as unit: mm, or whatever it was drawn in.")
        return given
    if given is not None and not math.isclose(given, own, rel_tol=1e-3):
        said = next((name for name, one in UNITS.items() if math.isclose(one, own, rel_tol=1e-3)), None)
        shown = f"the {said}" if said else show_quantity(own, "length")
        raise InputError(
            f"says itself that its unit is {shown}, not the {unit}. Leave unit out, or change the drawing."
        )
    return own


def _one_loop(
    pieces: list[np.ndarray], lines: list[DrawnLine], drawing: Drawing, size: float
) -> Float[np.ndarray, "n 2"]:
    """The one closed line that pieces make up, end to end in any order and direction."""
    gap, loops, names, named_by = _GAP * size, list[np.ndarray](), list[str](), drawing.named_by
    waiting = [(p, line.names[0]) for p, line in zip(pieces, lines, strict=True) if len(_distinct(p, gap)) > 1]
    while waiting:
        chain, name = waiting.pop(0)
        while not _meet(chain[0], chain[-1], gap):
            ends = np.array([p[[0, -1]] for p, _ in waiting]).reshape(-1, 2)
            away = np.hypot(*(ends - chain[-1]).T)
            if not ends.size or away.min() > gap:
                own = chain[[0, -1]] * (1, -1 if drawing.down else 1) + 0.0
                first, last = (", ".join(f"{x:.6g}" for x in end) for end in own)
                called = f' ({named_by} "{shorten(name)}")' if name else ""
                raise InputError(f"has an open line{called}, from ({first}) to ({last}) in its own units. Close it.")
            k, turned = divmod(int(away.argmin()), 2)
            piece = waiting.pop(k)[0]
            chain = np.concatenate([chain, (piece[::-1] if turned else piece)[1:]])
        loops.append(_distinct(chain, 1e-6 * size)[:-1])
        names.append(name)
    if len(loops) != 1:
        why = f"has {len(loops)} closed lines, where one is expected ({named_by}: {_listed(names)})"
        raise InputError(
            f"{why}. Name that of the outline as path. A plate has no holes: give mass and inertia instead."
        )
    return loops[0]


def _meet(one: np.ndarray, other: np.ndarray, gap: float) -> bool:
    return bool(np.hypot(*(one - other)) <= gap)


def _distinct(points: np.ndarray, gap: float) -> np.ndarray:
    """Points without those at the place of the one before; the last one stays."""
    far = np.hypot(*np.diff(points, axis=0).T) > gap
    return points[np.concatenate([far, [True]])]
