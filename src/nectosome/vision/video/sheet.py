"""Sheets of tracking (`track.yaml`): colours of segments or markers, scale, cameras."""

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nectosome.description.base import Axis, Name, Position
from nectosome.description.fields import Coordinate, Duration, Fraction, Length, Number, PositiveNumber, Time
from nectosome.io.schema.described import Described, wrong
from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import InputError
from nectosome.vision.cameras import Glass, Lens

_Hue = Annotated[float, Quantity("angle", minimum=0, maximum=2 * math.pi)]
Rate = Annotated[float, Quantity("frequency", minimum=0, exclusive=True)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]

Fit = Literal["moments", "rectangle"]
Length0 = Annotated[float, Quantity("length", minimum=0)]
Index = Annotated[float, Quantity("number", minimum=1, maximum=3)]
_LEAST = "It needs segments, for one video; or cameras, points and markers, for several."


class Colour(Described):
    """A colour range: hue [rad], which may wrap around 360 deg, saturation and value, each from low to high."""

    hue: tuple[_Hue, _Hue] = (0.0, 2 * math.pi)
    saturation: tuple[Fraction, Fraction] = (0.0, 1.0)
    value: tuple[Fraction, Fraction] = (0.0, 1.0)

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
    """A rigid layer of one colour; `length` along it and `width` across [m], if known."""

    length: Length | None = None
    width: Length | None = None


class SheetPlace(Described):
    """A known point of the plane, `at` x, y [m], and its pixel `seen`, from the left and from the top."""

    at: tuple[Coordinate, Coordinate]
    seen: tuple[Number, Number]


class LensSheet(Described):
    """A camera's lens in OpenCV's model: focal lengths and centre [px], k1, k2, p1, p2, k3."""

    focal: tuple[PositiveNumber, PositiveNumber]
    centre: tuple[Number, Number]
    distortion: tuple[Number, Number, Number, Number, Number]

    def build(self) -> Lens:
        """Build the lens."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return Lens(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), np.array(self.distortion))


class SegmentSheet(Described):
    """A chain of segments in one plane, seen by one camera; `segments` in their order along the chain."""

    about: str = ""
    rate: Rate | None = None
    size: tuple[Count, Count] | None = None
    pixel: Length | None = None
    points: Annotated[tuple[SheetPlace, ...], Field(min_length=4)] | None = None
    lens: LensSheet | None = None
    seen_from: Literal["above", "below"] = "above"
    origin: tuple[Number, Number] | None = None
    base: tuple[Number, Number] | None = None
    fit: Fit = "moments"
    smallest: Count = 20
    segments: dict[Name, Segment] = Field(min_length=1, max_length=8)

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
    """A camera: its clock, its picture and its lens, known or estimated from the points.

    `offset` [s] is the delay of its first frame after that of the first camera; `rate` [Hz] is that of the camera, for
    a file in slow or fast motion.
    """

    offset: Time = 0.0
    rate: Rate | None = None
    size: tuple[Count, Count] | None = None
    lens: LensSheet | Literal["k1", "k1 k2"] | None = None


class Pane(Described):
    """The tank's flat glass in front of all cameras, or the water's surface (thickness 0).

    `point` on its face towards the air [m] and `normal`, in the tank's frame; `index` of the glass, and of the water.
    """

    point: Position
    normal: Axis
    thickness: Length0 = 0.0
    index: Index = 1.52
    water: Index = 1.333

    def build(self) -> Glass:
        """Build the pane."""
        return Glass(np.array(self.point), np.array(self.normal), self.thickness, self.index, self.water)


class KnownPoint(Described):
    """A point with a known position, `at` x, y, z [m] in the tank, and its pixel in each camera."""

    at: Position
    seen: dict[Name, tuple[Number, Number]] = Field(min_length=1)


class Marker(Colour):
    """A marker on the body, `at` x, y, z [m] in its frame, and its colour; the frame's origin is tracked."""

    at: Position


class MarkerSheet(Described):
    """Markers of one body, seen by two or more cameras, in the order of their videos.

    `lamp`, a colour: the known points are lamps; they are measured in the first frames, within `near` [px] of `seen`.
    `misfit` [px] is the largest reprojection error of a marker, `tolerance` [m] the largest deviation of the markers'
    distances from those of the body. Gaps up to `fill` [s] are filled.
    """

    about: str = ""
    cameras: dict[Name, CameraSheet] = Field(min_length=2, max_length=8)
    glass: Pane | None = None
    points: dict[Name, KnownPoint] = Field(min_length=6)
    lamp: Colour | None = None
    near: PositiveNumber = 10.0
    markers: dict[Name, Marker] = Field(min_length=3, max_length=8)
    smallest: Count = 4
    misfit: PositiveNumber = 3.0
    tolerance: Length = 0.005
    fill: Duration = 0.0

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
        raise InputError(f"does not say what to track. {_LEAST}", file=source)
    model = MarkerSheet if isinstance(data, dict) and {"cameras", "markers"} & set(data) else SegmentSheet
    return validate_as(model, data, _LEAST, file=source, lines=lines)
