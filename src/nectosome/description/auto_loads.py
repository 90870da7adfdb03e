"""`water: auto` of a part: the loads that fit it by its shape and its place, with first guesses of their numbers."""

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

from nectosome.io.schema.described import inside, wrong

from .copies import BODY, spread
from .loads import LoadDescription
from .parts import Limb, Rigid, Rod
from .plates import PlateShape
from .which_load import PartInWater, lacking, load_kinds, parts_in_water

_CYLINDER = 1.1  # drag coefficient across a cylinder, Reynolds numbers of 1e3 to 2e5 (Hoerner 1965, chapter 3)
_ALONG = 0.01  # the same along it, by its diameter: friction of its sides


class _OnPart(NamedTuple):
    part: Limb
    piece: PartInWater
    reynolds_per_length: float  # at one length per second [1/m]


def with_auto_loads(
    body: Limb | None,
    limbs: Mapping[str, Limb],
    forward: str,
    in_stream: bool,
    pulled: Collection[str],
    viscosity: float,
) -> tuple[Limb | None, dict[str, Limb]]:
    """The parts as they are written, those with `water: auto` with the loads that fit and that they have none of.

    Copies take those of the first one, as its image where they are mirrored. Raises the error of a field for a part
    without a form of its own. What is decided does not change within a sweep. `viscosity` is the kinematic one [m2/s].
    """
    asked = {name: part for name, part in (*([(BODY, body)] if body else []), *limbs.items()) if part.water}
    if not asked:
        return body, dict(limbs)
    alone, copies = spread(body, limbs)
    parts = {BODY: body, **alone} if body else alone
    over = {copy.name for name in pulled for copy in copies.get(name, ())} | {*pulled}
    known = parts_in_water(parts, forward, in_stream, over)
    changed = dict(limbs)
    for name, part in asked.items():
        with inside(BODY if name == BODY else f"limbs.{name}"):
            loads = {**part.loads, **_chosen(part, known.get(copies[name][0].name), viscosity)}
        # what was written is of no use from here on
        whole = part.model_copy(update={"loads": loads, "water": None})
        body, changed = (whole, changed) if name == BODY else (body, {**changed, name: whole})
    return body, changed


def _chosen(part: Limb, piece: PartInWater | None, viscosity: float) -> dict[str, LoadDescription]:
    """Loads that a part has none of, by the names of their kinds."""
    if piece is None or (isinstance(part, Rigid) and part.form == "mesh"):
        why = "a point has no size" if piece is None else "`nectosome new FILE.stl` writes the loads of a mesh"
        raise wrong("water", f"auto finds no loads here: {why}. Give its loads instead.")
    at = _OnPart(part, piece, max(piece.sizes) / viscosity)
    found = dict[str, LoadDescription]()
    for kinds in lacking(part, piece.row, piece.last)[1]:
        kind = next(kind for kind in kinds if kind in _NUMBERS)
        if kind in part.loads:
            why = f"auto adds a load called {kind}, and one of another kind is called so. Give that another name."
            raise wrong("water", why)
        found[kind] = load_kinds()[kind](kind=kind, **_NUMBERS[kind](at))
    return found


def _foil(at: _OnPart) -> dict[str, Any]:
    """Of the planform: span and chord along the part's own axes."""
    part, piece = at.part, at.piece
    assert piece.normal is not None
    axes = {"span_along": "xyz"[piece.span], "ahead": piece.ahead, "thickness": _short(piece.sizes[piece.normal])}
    if isinstance(part, Rigid) and isinstance(part.own_shape, PlateShape):
        return axes  # the outline has its chords
    if isinstance(part, Rod):
        import numpy as np

        name = "_wh"[piece.along]
        at_ends = part.sections({"w": "width", "h": "height"}[name])
        places, sizes = zip(*at_ends, strict=True)
        spread_out = np.linspace(0.0, 1.0, 2 if len(places) == 2 else 9)
        return {**axes, "chord": tuple(_short(x) for x in np.interp(spread_out, places, sizes).tolist())}
    return {**axes, "chord": (piece.chord,)}


def _broadside(at: _OnPart) -> dict[str, Any]:
    """Of a plate across the flow by its aspect ratio, 1.11 + 0.018 A, at most 2.01 (Viterna and Corrigan 1982)."""
    across, along = sorted((at.piece.sizes[0], max(at.piece.sizes[1:])))
    return {"normal": _short(1.11 + 0.018 * min(along / across, 50.0))}


def _strips(at: _OnPart) -> dict[str, Any]:
    """Potential flow about sections; a paddle's ends with its length."""
    ends = {"length": _short(at.piece.sizes[0])} if at.piece.row in ("paddle", "hull") else {}
    return {"normal": 1.0, **ends}


def _slender(at: _OnPart) -> dict[str, Any]:
    """Of a cylinder; along it none beside a load of friction."""
    return {"normal": _CYLINDER, **({} if at.piece.row in ("body", "finned body") else {"tangential": _ALONG})}


def _lumped(at: _OnPart) -> dict[str, Any]:
    r"""Of the form that is most like, at one length per second; turning across its axis by strips of width w:
    $c = \tfrac12 \rho\, C \int w\,|x|^3 dx\, (1 - 4 r^2/l^2)$, as of a mesh."""
    from nectosome.geometry.drag_guesses import guessed_drag_areas

    assert isinstance(at.part, Rigid)
    (x, y, z), form = at.piece.sizes, at.part.form
    projected, wetted, volume = _surface(form, x, y, z)
    if isinstance(shape := at.part.own_shape, PlateShape):
        a, b, c = projected
        projected = (a, shape.area, c) if shape.plane == "xz" else (a, b, shape.area)
        wetted, volume = 2 * shape.area, shape.area * shape.thickness
    areas = [one.drag_area for one in guessed_drag_areas((x, y, z), projected, wetted, volume, at.reynolds_per_length)]
    slender = max(1 - (y * z) / x**2, 0.0)
    share = 2 / 15 if form == "spheroid" else 1 / 4
    turning = [1000.0 * share * (x / 2) ** 4 * slender * areas[k] / projected[k] * wide for k, wide in ((2, y), (1, z))]
    return {"drag_area": tuple(map(_short, areas)), "rotational": (0.0, *map(_short, turning))}


def _surface(form: str, x: float, y: float, z: float) -> tuple[tuple[float, float, float], float, float]:
    """Areas as seen along the axes and of the surface [m2], and volume [m3], of a shape of these sizes [m]."""
    r = y / 2
    if form == "cylinder":
        return (math.pi * r**2, x * z, x * y), 2 * math.pi * r * (x + r), math.pi * r**2 * x
    if form == "capsule":
        side = 2 * r * (x - 2 * r) + math.pi * r**2
        return (math.pi * r**2, side, side), 2 * math.pi * r * x, math.pi * r**2 * (x - 2 * r / 3)
    if form == "spheroid":
        p = 1.6075  # Thomsen: within 1.1 %
        surface = 4 * math.pi * ((2 * (x / 2 * r) ** p + r ** (2 * p)) / 3) ** (1 / p)
        return (math.pi * r**2, math.pi * x * z / 4, math.pi * x * y / 4), surface, 2 / 3 * math.pi * r**2 * x
    return (y * z, x * z, x * y), 2 * (x * y + y * z + x * z), x * y * z


def _short(value: float) -> float:
    """A first guess in three digits."""
    return float(f"{value:.3g}")


_NUMBERS: dict[str, Callable[[_OnPart], dict[str, Any]]] = {
    "foil": _foil,
    "plate_drag": _broadside,
    "drag": _slender,
    "added_mass": _strips,
    "lumped_drag": _lumped,
    "skin_friction": lambda at: {},
    "trailing_edge": lambda at: {},
    "spheroid_added_mass": lambda at: {},
    "cylinder_added_mass": lambda at: {},
    "sheet_added_mass": lambda at: {},
}
"""Numbers of the loads that can be chosen, by kind; others need more than the shape."""

SOURCES = {
    "foil": "span and chord of the part",
    "plate_drag": "1.11 + 0.018 A, Viterna and Corrigan 1982",
    "drag": "a cylinder, Hoerner 1965",
    "added_mass": "potential flow",
    "lumped_drag": "first guess by form, Hoerner 1965",
    "skin_friction": "a plate, Schlichting 1979",
    "trailing_edge": "Lighthill 1960",
    "spheroid_added_mass": "Lamb 1932",
    "cylinder_added_mass": "potential flow",
    "sheet_added_mass": "potential flow",
}
"""Where the numbers of these kinds are from, in few words."""
