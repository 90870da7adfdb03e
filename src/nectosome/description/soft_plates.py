"""Soft plates: thin sheets, clamped along one edge, that bend along and across."""

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from nectosome.description import fields
from nectosome.description.fields import Name
from nectosome.description.loads import SOFT_PLATE, LoadDescription
from nectosome.description.mirror import Mirror, opposite
from nectosome.description.part_base import Part
from nectosome.description.ranges import BENT, LOSES, SWUNG, YIELDS
from nectosome.io.schema.described import OneOf, OneOrMany, Shorthand, Uncertainty, inside, wrong

_MOST = 20  # entries of a table


class _Rows(Shorthand):
    """A table that may be written as one row, or as its only item."""

    def expand(self, value: Any) -> Any:
        """Put a single item into a row, and items of a row into rows of their own."""
        if not isinstance(value, list | tuple):
            return ((value,),)
        return tuple(row if isinstance(row, list | tuple) else (row,) for row in value)

    def shorten(self, row: list[Any]) -> Any:
        """Take single items out of their rows."""
        if any(len(one) > 1 for one in row):
            return row
        return row[0][0] if len(row) == 1 else [one[0] for one in row]

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of one item, or of a row of them."""
        item = row["items"]["items"]
        return {"anyOf": [item, {"type": "array", "items": item}]}


class SoftPlate(Part):
    """A thin soft sheet that bends along and across: a fin. It is clamped along its root edge, which lies along y.

    It lies flat in the plane of x and y, x from the root to the tip, and bends out of it along z.
    """

    kind: Literal["soft_plate"]
    loads: dict[Name, Annotated[LoadDescription, OneOf(lambda load: SOFT_PLATE in load.on)]] = Field(
        default_factory=dict
    )
    """What the water does to it, by name: plate_drag and sheet_added_mass."""
    length: fields.Length
    """Length along x, from the root edge to the tip edge."""
    width: Annotated[tuple[fields.Length, ...], Field(min_length=1, max_length=_MOST), OneOrMany()]
    """Full size along y, at places spread evenly from the root to the tip, joined by straight lines: one of a
    rectangle, two of a trapezoid."""
    middle: Annotated[tuple[fields.Coordinate, ...], Field(min_length=1, max_length=_MOST), OneOrMany()] = (0.0,)
    """Place along y of the middle of the width, at places spread evenly from the root to the tip: of a swept fin."""
    thickness: Annotated[
        tuple[Annotated[tuple[fields.Length, ...], Field(min_length=1, max_length=_MOST)], ...],
        Field(min_length=1, max_length=_MOST),
        _Rows(),
    ]
    """Thickness: one number, or a row of them at places spread evenly from the root to the tip; or a table of such
    rows, each with numbers spread evenly from the edge at -y to that at +y. Straight lines join them."""
    young: fields.Pressure
    """Young's modulus of the material."""
    poisson: fields.Poisson = 0.5
    """Poisson's ratio of the material; 0.5 is that of rubber."""
    density: fields.Density
    """Mass per volume of the material."""
    damping: fields.Viscosity = 0.0
    """Shear viscosity of a Kelvin-Voigt material: bending acts with three times it."""
    modes: tuple[
        Annotated[int, Field(strict=True, ge=1, le=8)],
        Annotated[int, Field(strict=True, ge=1, le=6)],
    ] = (4, 3)
    """Number of functions along and across it, whose products are its shapes. Across, one lets it only bend along, two
    let it twist, three or more let it curl."""
    points: tuple[
        Annotated[int, Field(strict=True, ge=2, le=40)],
        Annotated[int, Field(strict=True, ge=2, le=40)],
    ] = (8, 5)
    """Number of Gauss points along and across it, which carry mass and loads."""
    root: Literal["open", "closed"] = "open"
    """Whether water can pass around its edge at the root, or a body closes it there."""
    form: ClassVar[str] = SOFT_PLATE
    spreads: ClassVar = {
        "young": Uncertainty(0.8, 1.25, "data sheets of silicones and plastics, chosen", BENT, law=YIELDS),
        "density": Uncertainty(0.97, 1.03, "fillers and pores, chosen", "weigh it in air and in water"),
        "damping": Uncertainty(0.4, 2.5, "chosen", SWUNG, law=LOSES),
    }
    mirror = Mirror(middle=opposite, thickness=lambda table: tuple(row[::-1] for row in table))

    @property
    def mean_sizes(self) -> tuple[float, float, float]:
        """Its length, its mean width, and its mean thickness by the table [m]."""
        table = [mean_of(row) for row in self.thickness]
        return self.length, mean_of(self.width), mean_of(table)

    @model_validator(mode="after")
    def _rows_are_alike(self) -> Self:
        counts = [len(row) for row in self.thickness]
        for k, count in enumerate(counts):
            if count != counts[0]:
                why = f"row {k + 1} of the table has {count} numbers, the first one {counts[0]}"
                raise wrong(f"thickness.{k}", f"{why}. Give each row as many, from the edge at -y to that at +y.")
        return self

    @model_validator(mode="after")
    def _points_carry_modes(self) -> Self:
        for k, (way, modes, points) in enumerate(zip(("along", "across"), self.modes, self.points, strict=True)):
            if points <= modes:
                why = f"{points} points {way} it do not tell {modes} functions apart"
                raise wrong(f"points.{k}", f"{why}. Give at least {modes + 1}, or fewer modes.")
        return self

    @model_validator(mode="after")
    def _loads_fit(self) -> Self:
        for name, load in self.loads.items():
            with inside(f"loads.{name}"):
                load.check(SOFT_PLATE)
        return self


def mean_of(values: "tuple[float, ...] | list[float]") -> float:
    """Mean of a table at places spread evenly, joined by straight lines."""
    if len(values) == 1:
        return values[0]
    return (sum(values) - 0.5 * (values[0] + values[-1])) / (len(values) - 1)
