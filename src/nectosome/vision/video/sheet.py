"""Sheets of tracking (`track.yaml`): colours of segments or markers, scale, cameras."""

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nectosome.description import fields
from nectosome.description.fields import Axis, Name, Position
from nectosome.io.schema.described import Described, wrong
from nectosome.io.schema.kinds import KINDS, check_kind
from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import InputError
from nectosome.vision.cameras import Glass, Lens

_Hue = Annotated[float, Quantity("angle", minimum=0, maximum=2 * math.pi)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]

Fit = Literal["moments", "rectangle"]
Length0 = Annotated[float, Quantity("length", minimum=0)]
Index = Annotated[float, Quantity("number", minimum=1, maximum=3)]


class Colour(Described):
    """A colour range: hue, saturation and value, each from low to high."""

    hue: tuple[_Hue, _Hue] = (0.0, 2 * math.pi)
    """Lowest and highest hue on the colour circle: red 0 deg, green 120 deg, blue 240 deg. It may wrap around, as in
    [345 deg, 15 deg]."""
    saturation: tuple[fields.Fraction, fields.Fraction] = (0.0, 1.0)
    """Lowest and highest saturation: 0 is grey, 1 is a pure colour."""
    value: tuple[fields.Fraction, fields.Fraction] = (0.0, 1.0)
    """Lowest and highest brightness: 0 is black, 1 is full light."""

    @model_validator(mode="after")
    def _ordered(self) -> "Colour":
        for name in ("saturation", "value"):
            low, high = getattr(self, name)
            if low >= high:
                raise wrong(name, f"[{low:g}, {high:g}] is empty: its lower end comes first.")
        if self.hue[0] == self.hue[1]:
            raise wrong("hue", "is empty: its ends are the same.")
        return self


class Segment(Colour):
    """A rigid layer of one colour."""

    length: fields.Length | None = None
    """Length along the chain, if it is known."""
    width: fields.Length | None = None
    """Width across the chain, if it is known."""


class SheetPlace(Described):
    """A known point of the plane, and its pixel."""

    at: tuple[fields.Coordinate, fields.Coordinate]
    """Its place x, y in the plane."""
    seen: tuple[fields.Number, fields.Number]
    """Its pixel, counted from the left and from the top."""


class LensSheet(Described):
    """A camera's lens in OpenCV's model."""

    focal: tuple[fields.PositiveNumber, fields.PositiveNumber]
    """Focal lengths along both sides of the picture [pixels]."""
    centre: tuple[fields.Number, fields.Number]
    """Pixel on the optical axis."""
    distortion: tuple[fields.Number, fields.Number, fields.Number, fields.Number, fields.Number]
    """Coefficients k1, k2, p1, p2, k3."""

    def build(self) -> Lens:
        """Build the lens."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return Lens(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), np.array(self.distortion))


class SegmentSheet(Described):
    """A chain of segments in one plane, seen by one camera."""

    about: str = ""
    """What it is about, in sentences."""
    rate: fields.PositiveFrequency | None = None
    """Frames a second of the camera, where the file is played slower or faster than it was filmed."""
    size: tuple[Count, Count] | None = None
    """Width and height of the picture in pixels, for which the sheet was written. A video of another size is refused.
    """
    pixel: fields.Length | None = None
    """What a pixel shows in the plane of motion, instead of points."""
    points: Annotated[tuple[SheetPlace, ...], Field(min_length=4)] | None = None
    """Known points of the plane with their pixels, instead of a pixel, where the camera looks aslant."""
    lens: LensSheet | None = None
    """The camera's lens; without it pictures are straight."""
    seen_from: Literal["above", "below"] = "above"
    """Whether the camera is above or below. Directions are counter-clockwise from x, seen from above."""
    origin: tuple[fields.Number, fields.Number] | None = None
    """Pixel where x and y are 0, beside a pixel; without it the lower left corner of the picture."""
    base: tuple[fields.Number, fields.Number] | None = None
    """Pixel where the chain begins; it helps where a neighbour is hidden."""
    fit: Fit = "moments"
    """How middle and axis of a segment are found: by moments of its pixels, or by the smallest rectangle around them.
    """
    smallest: Count = 20
    """Number of pixels; what has fewer is dirt."""
    segments: dict[Name, Segment] = Field(min_length=1, max_length=8)
    """The segments by name, in their order along the chain."""

    @model_validator(mode="after")
    def _one_scale(self) -> "SegmentSheet":
        if self.pixel is not None and self.points is not None:
            raise wrong("pixel", "is not needed beside points, which give the scale.")
        if self.origin is not None and self.points is not None:
            raise wrong("origin", "is not needed beside points, which give the origin.")
        if self.pixel is None and self.points is None:
            for name, segment in self.segments.items():
                if segment.length is not None or segment.width is not None:
                    raise wrong(f"segments.{name}", "has a size; give the size of a pixel, as in pixel: 2 mm.")
        return self


class CameraSheet(Described):
    """A camera: its clock, its picture and its lens, known or estimated from the points."""

    offset: fields.Time = 0.0
    """Delay of its first frame after that of the first camera."""
    rate: fields.PositiveFrequency | None = None
    """Frames a second of the camera, where the file is played slower or faster than it was filmed."""
    size: tuple[Count, Count] | None = None
    """Width and height of the picture in pixels, for which the sheet was written. A video of another size is refused.
    """
    lens: LensSheet | Literal["k1", "k1 k2"] | None = None
    """Its lens, as known; `k1` or `k1 k2` to estimate that many coefficients from the points."""


class Pane(Described):
    """The tank's flat glass in front of all cameras, or the water's surface."""

    point: Position
    """A point on its face towards the air, in the tank's frame."""
    normal: Axis
    """Direction normal to it, in the tank's frame: x, y, z or three numbers."""
    thickness: Length0 = 0.0
    """Thickness; 0 for the water's surface."""
    index: Index = 1.52
    """Index of refraction of the glass."""
    water: Index = 1.333
    """Index of refraction of the water."""

    def build(self) -> Glass:
        """Build the pane."""
        return Glass(np.array(self.point), np.array(self.normal), self.thickness, self.index, self.water)


class KnownPoint(Described):
    """A point of the tank with a known place, and its pixel in each camera."""

    at: Position
    """Its place x, y, z in the tank."""
    seen: dict[Name, tuple[fields.Number, fields.Number]] = Field(min_length=1)
    """Its pixel in each camera, by name, counted from the left and from the top."""


class Marker(Colour):
    """A marker on the body: its place and its colour."""

    at: Position
    """Its place x, y, z in the frame of the body, whose origin is tracked."""


class MarkerSheet(Described):
    """Markers of one body, seen by two or more cameras."""

    about: str = ""
    """What it is about, in sentences."""
    cameras: dict[Name, CameraSheet] = Field(min_length=2, max_length=8)
    """The cameras by name, in the order of the videos."""
    glass: Pane | None = None
    """The glass of the tank, or the water's surface, through which the cameras look."""
    points: dict[Name, KnownPoint] = Field(min_length=6)
    """Points of the tank with known places, by name."""
    lamp: Colour | None = None
    """Colour of the known points, where they are lamps: they are then measured in the first frames."""
    near: fields.PositiveNumber = 10.0
    """How far a lamp may be from its pixel as written [pixels]."""
    markers: dict[Name, Marker] = Field(min_length=3, max_length=8)
    """The markers on the body, by name."""
    smallest: Count = 4
    """Number of pixels; what has fewer is dirt."""
    misfit: fields.PositiveNumber = 3.0
    """Largest reprojection error of a marker [pixels]."""
    tolerance: fields.Length = 0.005
    """Largest deviation of the markers' distances from those of the body."""
    fill: fields.Duration = 0.0
    """Length of gaps up to which they are filled."""

    @model_validator(mode="after")
    def _points_of_cameras(self) -> "MarkerSheet":
        for name, point in self.points.items():
            for camera in point.seen:
                if camera not in self.cameras:
                    known = ", ".join(self.cameras)
                    raise wrong(f"points.{name}.seen.{camera}", f"there is no such camera. Known: {known}.")
        return self


def load_sheet(path: str | Path) -> SegmentSheet | MarkerSheet:
    """Read a sheet. Raises InputError that names file, line and field."""
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    if isinstance(data, dict) and not {"segments", "cameras", "markers"} & set(data):
        check_kind(data, "segments", source)
        raise InputError(f"does not say what to track. {KINDS['segments'].least}", file=source)
    if isinstance(data, dict) and {"cameras", "markers"} & set(data):
        return validate_as(MarkerSheet, data, "markers", file=source, lines=lines)
    return validate_as(SegmentSheet, data, "segments", file=source, lines=lines)
