"""Plates by their outlines: polygons in robot files; lines of drawings and sections of meshes become such."""

from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import ValidationInfo, model_validator

from nectosome.description.fields import Angle, Coordinate, Length
from nectosome.description.meshes import folder_of, path_in
from nectosome.description.mirror import negative
from nectosome.description.shapes import ShapeDescription
from nectosome.io.schema.described import wrong
from nectosome.units import InputError, shorten

Point = tuple[Coordinate, Coordinate]
_OF_A_FILE = ("unit", "path", "across", "origin", "tolerance", "turn")


class PlateShape(ShapeDescription):
    """A flat plate of even thickness, its outline a polygon in the part's own frame; the root is at its origin.

    Strips for loads per length run across x, from the smallest x of the outline to the largest one.
    """

    outline: tuple[Point, ...] = ()
    """Corners of the plate in order around it, x and y of each, or x and z; the last one is joined to the first. There
    are 3 to 500."""
    drawing: str | None = None
    """SVG or DXF file with the outline, beside the robot file or in a folder below it, instead of corners; y runs up,
    in an SVG file too."""
    section_of: str | None = None
    """File of a mesh, STL, OBJ or PLY, instead of a drawing: the outline is that of the mesh where the plane cuts it,
    in the axes of the mesh."""
    across: Coordinate | None = None
    """Place of that section across the plane: z in the mesh of an xy plane, y of an xz plane. Without it 0."""
    unit: Literal["m", "cm", "mm", "um", "in", "ft"] | None = None
    """Unit of the drawing's coordinates, where the drawing does not say it; of a mesh always."""
    path: str | None = None
    """Id or label of the line in an SVG file, or its layer in a DXF file, where the drawing has several."""
    origin: Point | None = None
    """Place in the drawing or the section that is the part's root, in its own coordinates. Without it that of the
    file's origin."""
    turn: Angle | None = None
    """Angle by which the outline is turned about the root: from x towards y, or towards z of an xz plane."""
    tolerance: Length | None = None
    """Largest distance between a curve and the straight lines that stand for it. Without it a 5000th of the larger
    extent."""
    thickness: Length
    """Thickness, half of it on either side of the plane."""
    plane: Literal["xy", "xz"] = "xy"
    """Plane of the part that the outline lies in: xy lies flat, xz stands upright."""
    form: ClassVar = "plate"
    no_sizes: ClassVar = "has all in its shape"
    section: ClassVar = "flat"

    @model_validator(mode="after")
    def _has_an_outline(self, info: ValidationInfo) -> Self:
        for file in ("drawing", "section_of"):
            if (name := getattr(self, file)) is not None:
                known: dict[str, Any] = {"outline": self._read(folder_of(info), file, name), file: None}
                for field, value in (known | dict.fromkeys(_OF_A_FILE)).items():
                    object.__setattr__(self, field, value)  # from here on it holds its corners, wherever the file is
                return self
        for name in _OF_A_FILE:
            if getattr(self, name) is not None:
                why = "belongs to a drawing or a section. Leave it out, or name the file as drawing or section_of."
                raise wrong(name, why)
        if not self.outline:
            raise wrong("outline", "is missing. Give the corners of the plate, a drawing, or the section of a mesh.")
        import numpy as np

        from nectosome.geometry.outlines import check_outline

        try:
            check_outline(np.array(self.outline))
        except InputError as error:
            raise wrong("outline", error.message) from None
        return self

    def _read(self, folder: Path, field: str, name: str) -> tuple[Point, ...]:
        """The corners from the file in a field; the two fields exclude each other, and those of the other one."""
        from nectosome.geometry.outline_files import read_outline
        from nectosome.geometry.outlines import turned
        from nectosome.geometry.sections import read_section

        if self.outline:
            raise wrong("outline", "the file has the outline. Leave one of the two out.")
        other, foreign = ("section_of", "across") if field == "drawing" else ("drawing", "path")
        if getattr(self, other) is not None:
            raise wrong(other, f"the outline comes from {shorten(name)} already. Leave one of the two out.")
        if getattr(self, foreign) is not None:
            of = "a section of a mesh" if field == "drawing" else "a drawing"
            raise wrong(foreign, f"belongs to {of}. Leave it out.")
        options = {"tolerance": self.tolerance, "origin": self.origin}
        try:
            path = path_in(folder, name)
            if field == "drawing":
                points = read_outline(path, name=self.path, unit=self.unit, **options)
            elif self.unit is None:
                raise wrong("unit", "is missing: a mesh has numbers without one.")
            else:
                of = {"plane": self.plane, "across": self.across or 0.0, "source": name}
                points = read_section(path, self.unit, **of, **options)
        except InputError as error:
            raise wrong(field, str(error)) from None
        points = points if self.turn is None else turned(points, self.turn)
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

    def check_load(self, load: Any) -> None:
        """Raise the error of a field for a load that needs another plane."""
        load.check_plate(self.plane)

    def size(self, name: str, part: Any = None) -> float:
        """Return its length along x, width along y or height along z [m]."""
        if name == ("height" if self.plane == "xy" else "width"):
            return self.thickness
        values = [point[name != "length"] for point in self.outline]
        return max(values) - min(values)
