"""What a `track.yaml` says of markers: cameras, known points in the tank, and where the markers are on the body."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nectosome.io.describe_base import Axis, Described, Name, Position, wrong
from nectosome.io.fields import Duration, Length, Number, PositiveNumber, Quantity, Time
from nectosome.measure.cameras import Glass

from .sheet import Colour, Count, LensSheet, Rate

Length0 = Annotated[float, Quantity("length", minimum=0)]
Index = Annotated[float, Quantity("number", minimum=1, maximum=3)]


class CameraSheet(Described):
    """A camera: its clock, its picture and its lens, known or estimated from the points.

    `offset` [s] is what its first frame is later than that of the first camera; `rate` [Hz] where the file is played
    slower or faster than it was filmed.
    """

    offset: Time = 0.0
    rate: Rate | None = None
    size: tuple[Count, Count] | None = None
    lens: LensSheet | Literal["k1", "k1 k2"] | None = None


class Pane(Described):
    """The tank's flat glass that all cameras look through, or the water's surface (without a thickness).

    `point` on its face towards the air [m] and `normal`, in the tank's frame; `index` of the glass, and of the water.
    """

    point: Position
    normal: Axis
    thickness: Length0 = 0.0
    index: Index = 1.52
    water: Index = 1.333

    def made(self) -> Glass:
        """The pane itself."""
        return Glass(np.array(self.point), np.array(self.normal), self.thickness, self.index, self.water)


class KnownPoint(Described):
    """A point whose place is known, `at` x, y, z [m] in the tank, and the pixel where each camera has it."""

    at: Position
    seen: dict[Name, tuple[Number, Number]] = Field(min_length=1)


class Marker(Colour):
    """A marker on the body, `at` x, y, z [m] in its frame, whose origin is what is tracked, and its colour."""

    at: Position


class MarkerSheet(Described):
    """Markers of one body, seen by two or more cameras, in the order of their videos.

    `lamp`, a colour, says that the known points are lamps: `seen` is then only near them, within `near` [px], and they
    are measured in the first frames. `misfit` [px] is the most that a marker's pixels may be off their place,
    `tolerance` [m] the most that the distances of markers may differ from those of the body. `fill` [s]: gaps up to
    that long are filled.
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
