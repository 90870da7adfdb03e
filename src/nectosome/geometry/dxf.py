"""Lines of DXF files."""

from collections.abc import Iterator
from functools import partial
from io import StringIO
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.geometry.outlines import Drawing, DrawnLine
from nectosome.io.extras import package
from nectosome.units import InputError

# $INSUNITS, as in the reference of the format: inches, feet, miles, mm, cm, m, km, and smaller and rarer ones [m]
_UNITS = {
    1: 0.0254,
    2: 0.3048,
    3: 1609.344,
    4: 1e-3,
    5: 1e-2,
    6: 1.0,
    7: 1e3,
    8: 2.54e-8,
    9: 2.54e-5,
    10: 0.9144,
    13: 1e-6,
    14: 0.1,
}
_CURVES = ("ARC", "CIRCLE", "ELLIPSE", "SPLINE")
_POLYLINES = ("LWPOLYLINE", "POLYLINE")
_COARSE = 0.02  # of the extent of a curve's defining points, for a first look


def read_dxf(raw: bytes) -> Drawing:
    """Return lines, arcs, circles, ellipses, splines and polylines in the model space of a DXF file, by their layers.

    Its unit is that of $INSUNITS. What lies in blocks is not read. Raises InputError.
    """
    ezdxf = package("ezdxf", "mesh")
    if raw.startswith(b"AutoCAD Binary DXF"):
        raise InputError("is a binary DXF file. Save it as text.")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("cp1252", "replace")
    if "\0" in text or "SECTION" not in text[:20_000]:
        raise InputError("this is no DXF file: it has no sections.")
    try:
        document = ezdxf.read(StringIO(text.replace("\r\n", "\n")))
        entities = [e for e in document.modelspace() if e.dxftype() in (*_CURVES, *_POLYLINES, "LINE")]
        lines = [DrawnLine((str(e.dxf.layer),), partial(_points, part)) for e in entities for part in _parts(e)]
        unit = _UNITS.get(int(document.header.get("$INSUNITS", 0)))
    except (ezdxf.DXFError, ValueError, TypeError, IndexError, KeyError, AttributeError) as error:
        raise InputError(f"this DXF file cannot be read ({type(error).__name__}). Save it anew.") from None
    if not lines and len(document.modelspace()):
        raise InputError("has no lines outside of blocks. Explode its blocks in the drawing program.")
    return Drawing(lines, unit, "layer")


def _parts(entity: Any) -> Iterator[Any]:
    """Straight lines and curves of an entity."""
    if entity.dxftype() not in _POLYLINES:
        yield entity
    elif entity.dxftype() == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
        return  # a mesh
    else:
        yield from entity.virtual_entities()


def _points(entity: Any, tolerance: float) -> Float[np.ndarray, "k 2"]:
    """Points of a straight line or a curve."""
    ezdxf = package("ezdxf", "mesh")
    try:
        places = _places(entity, tolerance)
    except (ezdxf.DXFError, ArithmeticError, ValueError, TypeError, IndexError) as error:
        where = f"{entity.dxftype()} on layer {entity.dxf.layer}"
        raise InputError(f"has a line that cannot be read, {where} ({type(error).__name__}). Draw it anew.") from None
    points = np.array([[p.x, p.y] for p in places]).reshape(-1, 2)
    heights = [p.z for p in places]
    if max(heights) - min(heights) > 1e-6 * max(float(np.ptp(points, axis=0).max()), 1e-300):
        raise InputError(f"has a line on layer {entity.dxf.layer} that leaves the x-y plane. Draw the outline flat.")
    return points


def _places(entity: Any, tolerance: float) -> list[Any]:
    """Points of a straight line or a curve, not necessarily in a plane."""
    if entity.dxftype() == "LINE":
        return [entity.dxf.start, entity.dxf.end]
    return list(entity.flattening(min(tolerance, _COARSE * _extent(entity))))


def _extent(entity: Any) -> float:
    """Size of a curve, about, in its own units."""
    if entity.dxftype() == "SPLINE":
        known = np.array([[*p][:3] for p in (*entity.control_points, *entity.fit_points)])
        return max(float(np.ptp(known, axis=0).max()), 1e-300)
    if entity.dxftype() == "ELLIPSE":
        return max(float(entity.dxf.major_axis.magnitude), 1e-300)
    return max(float(entity.dxf.radius), 1e-300)
