"""What `nectosome show` tells of parts that are plates by their outlines."""

from nectosome.description import Rigid, RobotDescription
from nectosome.description.plates import PlateShape
from nectosome.io.tables import Branch, Number, Table
from nectosome.units import show_quantity


def plate_branch(plate: PlateShape) -> Branch:
    """A line with the sizes of a plate, and how slender it is as a fin with its span along x."""
    span, area = plate.size("length"), plate.area
    sides = [show_quantity(plate.size(side), "length") for side in ("length", "width", "height")]
    shown, chord = show_quantity(area, "area"), show_quantity(area / span, "length")
    said = f"{len(plate.outline)} points in the {plate.plane} plane, {' x '.join(sides)}, area {shown}"
    slender = f"with the span along x: span {sides[0]}, mean chord {chord}, aspect ratio {span**2 / area:.3g}"
    return Branch("outline", f"{said}; {slender}")


def plate_table(description: RobotDescription) -> Table:
    """The same numbers by part."""
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
