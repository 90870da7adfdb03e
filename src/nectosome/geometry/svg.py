"""Lines of SVG files."""

import re
from functools import partial
from io import StringIO
from typing import Any
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from nectosome.geometry.outlines import MOST_LINES, Drawing, DrawnLine, straightened
from nectosome.io.extras import package
from nectosome.units import InputError, shorten

_PIXEL = 0.0254 / 96  # [m], of CSS
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_LENGTHS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6, "Q": 2.5e-4}  # [m]
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"\s*({_NUMBER})\s*({'|'.join(_LENGTHS)})\s*")
_COMMANDS = {"m": 2, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "a": 7, "z": 0}  # numbers of each
_SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
MOST_NUMBERS = 40_000
_STRETCHED = 0.01  # by how much the sides of a view box may be out of proportion to those of the page


def read_svg(raw: bytes) -> Drawing:
    """Return the lines of an SVG file by their labels or ids, y up, in units of its outermost view box.

    Its unit is known where its width and height are lengths, such as 120mm. Raises InputError.
    """
    svgelements = package("svgelements", "mesh")
    root = _root(raw)
    try:
        svg = svgelements.SVG.parse(StringIO(ElementTree.tostring(root, "unicode")), reify=True, ppi=96)
        transform = svgelements.Matrix(svg.viewbox_transform or "")
        drawn = [e for e in svg.elements() if isinstance(e, svgelements.Shape) and e.values.get("display") != "none"]
        paths = [(e, abs(svgelements.Path(e))) for e in drawn]
    except (ValueError, TypeError, IndexError, KeyError, AttributeError, ZeroDivisionError, RecursionError) as error:
        raise InputError(f"this SVG cannot be read ({type(error).__name__}). Save it as plain SVG.") from None
    if abs(transform.a * transform.d) < 1e-300:
        raise InputError("this SVG shows nothing: its view box or its size is 0.")
    scale, shift = np.array([transform.a, transform.d]), np.array([transform.e, transform.f])
    lines = []
    for element, path in paths:
        names = tuple(str(element.values[key]) for key in (_LABEL, "id") if element.values.get(key)) or ("",)
        pieces = [list(svgelements.Path(sub)) for sub in path.as_subpaths()]
        lines += [DrawnLine(names, partial(_points, piece, scale, shift)) for piece in pieces if len(piece) > 1]
    return Drawing(lines, _unit(root), "id", down=True)


def _root(raw: bytes) -> ElementTree.Element:
    """The element `svg` of a file without entities or references to other elements, which may unfold to any size."""
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("this is no SVG: it is not text in UTF-8.") from None
    if "<!ENTITY" in text:
        raise InputError("declares entities, which are not read. Save it as plain SVG.")
    if re.search(r"transform\s*:", text):
        raise InputError("has transforms in styles, which are not read. Save it as plain SVG.")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        why, (line, _) = str(error).partition(":")[0], error.position
        raise InputError(f"this is not XML: {why}, in line {line}.") from None
    if _tag(root) != "svg":
        raise InputError("this is no SVG: its outermost element is another one.")
    elements = [element for element in root.iter() if _tag(element) in (*_SHAPES, "use")]
    if any(_tag(element) == "use" for element in elements):
        raise InputError("has clones (<use>), which are not read. Unlink them in the drawing program.")
    if len(elements) > MOST_LINES:
        raise InputError(f"has {len(elements)} lines, at most {MOST_LINES} are read. Save the outline alone.")
    if sum(map(_numbers, elements)) > MOST_NUMBERS:
        raise InputError(f"has more than {MOST_NUMBERS} coordinates. Save the outline alone.")
    return root


def _tag(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _numbers(element: ElementTree.Element) -> int:
    """Return how many numbers the coordinates of an element have.

    Raises InputError where they are not whole, so that a part could be read and be taken for all.
    """
    text = element.get("d" if _tag(element) == "path" else "points", "")
    called = f'the line with the id "{shorten(element.get("id", ""))}"'
    commands, total = re.findall(r"([A-DF-Za-df-z]?)([^A-DF-Za-df-z]*)", text), 0
    odd = [re.sub(_NUMBER, " ", data).replace(",", " ").strip() for _, data in commands]
    odd += [command for command, _ in commands if command and command.lower() not in _COMMANDS]
    if any(odd):
        raise InputError(f'{called} has "{shorten(max(odd))}" in its coordinates, which is none.')
    for command, data in commands:
        each, numbers = _COMMANDS[(command or "l").lower()], len(re.findall(_NUMBER, data))
        short = numbers > 0 if each == 0 else command.lower() != "a" and numbers % each  # flags of arcs may touch
        if short or (each and command and not numbers):
            raise InputError(f'{called} has {numbers} numbers after "{command}", where each point needs its own.')
        total += numbers
    return total


def _unit(root: ElementTree.Element) -> float | None:
    """Unit of the view box [m]; None where width and height are no lengths, or only pixels."""
    sides = [_LENGTH.fullmatch(root.get(side, "")) for side in ("width", "height")]
    if any(side is None for side in sides):
        return None
    size = [float(side[1]) * _LENGTHS[side[2]] for side in sides if side is not None]
    box = re.findall(_NUMBER, root.get("viewBox", ""))
    if len(box) != 4:
        return _PIXEL
    units = [long / float(shown) for long, shown in zip(size, box[2:], strict=True) if float(shown) > 0]
    if len(units) != 2 or max(units) > (1 + _STRETCHED) * min(units):
        raise InputError("is stretched: its view box has another ratio of width to height than its size.")
    return min(units)


def _points(
    segments: list[Any], scale: Float[np.ndarray, "2"], shift: Float[np.ndarray, "2"], tolerance: float
) -> Float[np.ndarray, "k 2"]:
    """Points of the segments of a path, y up; `scale` and `shift` led from the view box to pixels."""
    svgelements = package("svgelements", "mesh")
    within = tolerance * float(np.abs(scale).min())  # [px]
    points = [np.array([[*segments[0].end]])]
    for segment in segments[1:]:
        if isinstance(segment, svgelements.Line | svgelements.Close | svgelements.Move):
            if segment.end is not None:
                points.append(np.array([[*segment.end]]))
            continue
        if isinstance(segment, svgelements.Arc):
            radius, sweep = max(abs(segment.rx), abs(segment.ry)), abs(float(segment.sweep))
            bend, coarse = radius * sweep**2 / 8, max(8, int(4 * sweep))
        else:
            names = (
                ("start", "control", "end") if hasattr(segment, "control") else ("start", "control1", "control2", "end")
            )
            p = np.array([[*getattr(segment, name)] for name in names])
            degree = len(p) - 1
            second = degree * (degree - 1) * np.abs(np.diff(p, n=2, axis=0)).max(initial=0.0) * np.sqrt(2)
            bend, coarse = second / 8, 8
        n = straightened(bend, within, coarse)
        points.append(np.array([[*segment.point(t)] for t in np.linspace(0, 1, n + 1)[1:]]))
    return (np.concatenate(points) - shift) / scale * (1, -1)
