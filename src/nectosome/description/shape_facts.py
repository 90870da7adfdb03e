"""Facts about parts that are meshes, and about plates by their outlines, as tables."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from nectosome.io.tables import AXES, Branch, Number, Table
from nectosome.units import count, show_quantity

from .meshes import MeasuredMesh, MeshShape
from .parts import Rigid
from .plates import PlateShape
from .robot import RobotDescription
from .water import WaterDescription

if TYPE_CHECKING:
    from nectosome.geometry.drag_guesses import GuessedArea


def mesh_branches(shape: MeshShape, water: WaterDescription) -> list[Branch]:
    """Lines of a part: its file, size, volume and areas, what was found in it and repaired, and a guess of its drag."""
    known, kept = shape.numbers, shape.surface
    triangles = f"{shape.mesh} in {shape.unit}, {count(known.triangles, 'triangle')}"
    if len(kept.faces) < known.triangles:
        off = 100 * (kept.volume / known.volume - 1)
        triangles += f"; {len(kept.faces)} are kept, whose volume is off by {off:.2g} %"
    volume = f"{known.volume:.4g} m3 about ({_row(known.centre)}) m"
    if known.matter < known.volume:
        volume += f", of which {known.matter:.4g} m3 about ({_row(known.matter_centre)}) m is matter"
    areas = f"wetted {known.area:.4g} m2; as seen along x, y, z: {_row(known.projected)} m2"
    lines = {"mesh": triangles, "extent": _extent(shape), "volume": volume, "areas": areas}
    found = [Branch("found", text) for text in known.told]
    return [*(Branch(name, text) for name, text in lines.items()), *found, _guess_branch(shape, water)]


def drag_guesses(known: MeasuredMesh, water: WaterDescription) -> "tuple[GuessedArea, GuessedArea, GuessedArea]":
    """First guesses of the drag areas along x, y and z of what was measured, at a speed of one length per second."""
    from nectosome.geometry import unpack_surface
    from nectosome.geometry.drag_guesses import guessed_drag_areas, largest_sections

    x, y, z = (b - a for a, b in zip(known.low, known.high, strict=True))
    per_length = max(x, y, z) * water.density / water.viscosity
    sections = largest_sections(unpack_surface(known.surface))
    return guessed_drag_areas((x, y, z), known.projected, known.area, known.volume, per_length, sections)


def _guess_branch(shape: MeshShape, water: WaterDescription) -> Branch:
    """The load to copy, and where each of its numbers comes from."""
    guesses = drag_guesses(shape.numbers, water)
    said = []
    for axis, (area, guess, least, largest, out) in zip("xyz", guesses, strict=True):
        at = " at one length per second" if guess.area == "wetted" else ""
        text = f"{guess.coefficient:.2g} on the {guess.area} area, as {guess.form}{at} ({guess.source})"
        if out > 0:
            text += f", and 0.74 on {show_quantity(out, 'area')} that sticks out of its largest section"
        if largest > least:
            text += f"; from {show_quantity(least, 'area')}, {_LEAST[guess.area]}"
            if largest > area:
                text += f", to {show_quantity(largest, 'area')}, {_LARGEST[guess.area]}"
        said.append(Branch(f"along {axis}", text))
    said.append(
        Branch("of turning", "by strips across the longest axis; about that, what reaches out of round sections")
    )
    return Branch("drag, a first guess", guessed_load(shape.numbers, water), said)


_LEAST = {"wetted": "laminar and faired", "projected": "where its boundary layer is turbulent"}
_LARGEST = {"wetted": "turbulent, and plates where it sticks out", "projected": "with a flat nose"}


def guessed_load(known: MeasuredMesh, water: WaterDescription) -> str:
    """The load, as a robot file has it."""
    from nectosome.geometry import unpack_surface
    from nectosome.geometry.drag_guesses import guessed_turning

    x, y, z = drag_guesses(known, water)
    a, b, c = (one.drag_area / area for one, area in zip((x, y, z), known.projected, strict=True))
    areas = ", ".join(f"{one.drag_area:.2g} m2" for one in (x, y, z))
    turning = ", ".join(f"{c:.2g} kg m2" for c in guessed_turning(unpack_surface(known.surface), (a, b, c)))
    return f"{{kind: lumped_drag, drag_area: [{areas}], rotational: [{turning}]}}"


def mesh_table(description: RobotDescription) -> Table:
    """The same numbers, by part and quantity."""
    rows = [row for name, shape in _meshes(description) for row in _rows(name, shape, description.water)]
    return Table("meshes", {"part": "part", "what": "what", "value": "value", **AXES}, rows, listed=True)


def _meshes(description: RobotDescription) -> Iterator[tuple[str, MeshShape]]:
    for name, part in description.parts.items():
        if isinstance(part, Rigid) and isinstance(part.shape, MeshShape):
            yield name, part.shape


def _rows(name: str, shape: MeshShape, water: WaterDescription) -> Iterator[tuple[str | Number, ...]]:
    known = shape.numbers
    scalars = {"volume": (known.volume, "m3"), "matter": (known.matter, "m3"), "area": (known.area, "m2")}
    for what, (value, unit) in scalars.items():
        yield name, what, Number(value, unit)
    places = {"low": known.low, "high": known.high, "centre": known.centre, "matter_centre": known.matter_centre}
    for what, row in places.items():
        yield name, what, "", *(Number(x, "m") for x in row)
    yield name, "projected", "", *(Number(x, "m2") for x in known.projected)
    guesses = drag_guesses(known, water)
    yield name, "guessed_drag_area", "", *(Number(one.drag_area, "m2") for one in guesses)
    yield name, "least_drag_area", "", *(Number(one.least, "m2") for one in guesses)
    yield name, "largest_drag_area", "", *(Number(one.largest, "m2") for one in guesses)


def _extent(shape: MeshShape) -> str:
    known = shape.numbers
    sizes = (show_quantity(b - a, "length") for a, b in zip(known.low, known.high, strict=True))
    return f"{' x '.join(sizes)}, from ({_row(known.low)}) m"


def _row(values: tuple[float, float, float]) -> str:
    size = max(map(abs, values))
    return ", ".join(f"{0.0 if abs(x) < 1e-9 * size else x:.4g}" for x in values)


def plate_branch(plate: PlateShape) -> Branch:
    """A line with the sizes of a plate, and how slender it is as a fin with its span along x."""
    span, area = plate.size("length"), plate.area
    sides = [show_quantity(plate.size(side), "length") for side in ("length", "width", "height")]
    shown, chord = show_quantity(area, "area"), show_quantity(area / span, "length")
    said = f"{len(plate.outline)} points in the {plate.plane} plane, {' x '.join(sides)}, area {shown}"
    slender = f"with the span along x: span {sides[0]}, mean chord {chord}, aspect ratio {span**2 / area:.3g}"
    return Branch("outline", f"{said}; {slender}")


def plate_table(description: RobotDescription) -> Table:
    """The same numbers of all plates, by part."""
    heads = {"part": "part", "area": "area", "span": "span", "chord": "mean chord", "ratio": "aspect ratio"}
    plates = {
        name: part.shape
        for name, part in description.parts.items()
        if isinstance(part, Rigid) and isinstance(part.shape, PlateShape)
    }
    rows = []
    for name, plate in plates.items():
        span, area = plate.size("length"), plate.area
        numbers = (area, "m2"), (span, "m"), (area / span, "m"), (span**2 / area, "")
        rows.append((name, *(Number(value, unit) for value, unit in numbers)))
    return Table("plates", heads, rows)
