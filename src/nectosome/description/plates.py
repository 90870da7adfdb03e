"""Plates by their outlines: polygons in robot files, or lines of SVG and DXF drawings that become such."""

from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import ValidationInfo, model_validator

from nectosome.description.fields import Coordinate, Length
from nectosome.description.mirror import Mirrored, negative
from nectosome.io.schema.described import wrong
from nectosome.io.schema.quantity import QuantitySource
from nectosome.units import InputError, shorten

Point = tuple[Coordinate, Coordinate]
_OF_A_DRAWING = ("unit", "path", "origin", "tolerance")


class PlateShape(Mirrored):
    """A flat plate of even thickness, its outline a polygon in the part's own frame; the root is at its origin.

    Strips for loads per length run across x, from the smallest x of the outline to the largest one.
    """

    outline: tuple[Point, ...] = ()
    """Corners of the plate in order around it, x and y of each, or x and z; the last one is joined to the first. There
    are 3 to 500."""
    drawing: str | None = None
    """SVG or DXF file with the outline, beside the robot file or in a folder below it, instead of corners; y runs up,
    in an SVG file too."""
    unit: Literal["m", "cm", "mm", "um", "in", "ft"] | None = None
    """Unit of the drawing's coordinates, where the drawing does not say it."""
    path: str | None = None
    """Id or label of the line in an SVG file, or its layer in a DXF file, where the drawing has several."""
    origin: Point | None = None
    """Place in the drawing that is the part's root, in its own coordinates. Without it that of the drawing's origin."""
    tolerance: Length | None = None
    """Largest distance between a curve and the straight lines that stand for it. Without it a 5000th of the larger
    extent."""
    thickness: Length
    """Thickness, half of it on either side of the plane."""
    plane: Literal["xy", "xz"] = "xy"
    """Plane of the part that the outline lies in: xy lies flat, xz stands upright."""
    form: ClassVar = "plate"

    @model_validator(mode="after")
    def _has_an_outline(self, info: ValidationInfo) -> Self:
        if self.drawing is not None:
            if self.outline:
                raise wrong("outline", "the drawing has the outline. Leave one of the two out.")
            folder = info.context.folder if isinstance(info.context, QuantitySource) else QuantitySource().folder
            known: dict[str, Any] = {"outline": self._read(folder, self.drawing), "drawing": None}
            for name, value in (known | dict.fromkeys(_OF_A_DRAWING)).items():
                object.__setattr__(self, name, value)  # from here on it holds its corners, wherever the drawing is
            return self
        for name in _OF_A_DRAWING:
            if getattr(self, name) is not None:
                raise wrong(name, "belongs to a drawing. Leave it out, or name the file as drawing.")
        if not self.outline:
            raise wrong("outline", "is missing. Give the corners of the plate, or a drawing.")
        import numpy as np

        from nectosome.geometry.outlines import check_outline

        try:
            check_outline(np.array(self.outline))
        except InputError as error:
            raise wrong("outline", error.message) from None
        return self

    def _read(self, folder: Path, drawing: str) -> tuple[Point, ...]:
        from nectosome.geometry.outline_files import read_outline

        path = folder / drawing
        try:
            outside = not path.resolve().is_relative_to(folder.resolve())
        except (OSError, ValueError, RuntimeError):
            raise wrong("drawing", "is no name of a file.") from None
        if outside:
            why = f"{shorten(drawing)} is outside of the folder of the robot file. Put it beside that file."
            raise wrong("drawing", why)
        options = {"name": self.path, "unit": self.unit, "tolerance": self.tolerance, "origin": self.origin}
        try:
            points = read_outline(path, **options)
        except InputError as error:
            raise wrong("drawing", str(error)) from None
        return tuple((x, y) for x, y in points.tolist())

    @property
    def area(self) -> float:
        """Area of one side [m2]."""
        following = (*self.outline[1:], self.outline[0])
        return abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(self.outline, following, strict=True))) / 2

    def image(self) -> Self:
        """Return the image: that of a plate that lies flat is turned over."""
        if self.plane == "xz":
            return self
        return self.model_copy(update={"outline": tuple((x, negative(y)) for x, y in self.outline)})

    def size(self, name: str) -> float:
        """Return its length along x, width along y or height along z [m]."""
        if name == ("height" if self.plane == "xy" else "width"):
            return self.thickness
        values = [point[name != "length"] for point in self.outline]
        return max(values) - min(values)


def shape_image(shape: str | Mirrored) -> str | Mirrored:
    """Return the image of the shape of a rigid part: of a name the same."""
    return shape if isinstance(shape, str) else shape.image()
