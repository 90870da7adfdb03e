"""What a `track.yaml` says: which colours are what, how large a pixel is, how the camera looks."""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from nectosome.io.describe_base import Described, Name, wrong
from nectosome.io.fields import Coordinate, Fraction, Length, Number, PositiveNumber, Quantity
from nectosome.measure.cameras import Lens

_Hue = Annotated[float, Quantity("angle", minimum=0, maximum=2 * math.pi)]
Rate = Annotated[float, Quantity("frequency", minimum=0, exclusive=True)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]

Fit = Literal["moments", "rectangle"]


class Colour(Described):
    """A range of colours: hue [rad], which may go over 360 deg to 0, saturation and value, each from low to high."""

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
    """A rigid layer of one colour; `length` along it and `width` across [m], where they are known."""

    length: Length | None = None
    width: Length | None = None


class Place(Described):
    """A known point of the plane, `at` x, y [m], and the pixel where it is `seen`, from the left and from the top."""

    at: tuple[Coordinate, Coordinate]
    seen: tuple[Number, Number]


class LensSheet(Described):
    """A camera's lens as OpenCV calibrates it: focal lengths and centre [px], k1, k2, p1, p2, k3."""

    focal: tuple[PositiveNumber, PositiveNumber]
    centre: tuple[Number, Number]
    distortion: tuple[Number, Number, Number, Number, Number]

    def made(self) -> Lens:
        """The lens itself."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return Lens(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]), np.array(self.distortion))


class SegmentSheet(Described):
    """A chain of segments in one plane, seen by one camera; `segments` in their order along the chain."""

    about: str = ""
    rate: Rate | None = None
    size: tuple[Count, Count] | None = None
    pixel: Length | None = None
    points: Annotated[tuple[Place, ...], Field(min_length=4)] | None = None
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
            raise wrong("pixel", "is not needed beside points, which say how large a pixel is.")
        if self.origin is not None and self.points is not None:
            raise wrong("origin", "is not needed beside points, which say where the origin is.")
        if self.pixel is None and self.points is None:
            for name, segment in self.segments.items():
                if segment.length is not None or segment.width is not None:
                    raise wrong(f"segments.{name}", "has a size; say how large a pixel is, as in pixel: 2 mm.")
        return self
