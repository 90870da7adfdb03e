"""Foils: fins and wings with lift by their angle of attack."""

import math
from collections.abc import Collection
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from nectosome.description import fields
from nectosome.description.fields import DIRECTIONS, Direction
from nectosome.description.loads import LoadDescription
from nectosome.description.mirror import Mirror
from nectosome.description.ranges import THRUST, TOWED, at_least, up_to
from nectosome.io.schema.described import OneOrMany, Uncertainty, wrong

_Lengths = Annotated[tuple[fields.NonNegativeLength, ...], Field(min_length=1), OneOrMany()]
_Places = Annotated[tuple[fields.Coordinate, ...], Field(min_length=2)]

_SIZES = {"x": "length", "y": "width", "z": "height"}
_IMAGES = {"y": "-y", "-y": "y"}  # of directions; others stay


class FoilLoad(LoadDescription):
    """A fin or wing, section by section along its span: lift that lags, suction at its leading edge, stall, drag and
    added mass."""

    kind: Literal["foil"]
    span_along: Literal["x", "y", "z"]
    """Axis of the part along which the span runs: x of a flipper that the part is as a whole, z of a tail fin that
    stands upright on it."""
    ahead: Direction
    """Direction of the leading edge, along another axis of the part."""
    chord: _Lengths | None = None
    """Chord; or chords evenly spaced along the span, from its beginning to its end. Without it that of the outline of a
    plate, with its leading edge."""
    span: fields.Length | None = None
    """Span, of rigid parts. Without it the size of the part along that axis."""
    leading_edge: _Places | None = None
    """Place of the leading edge along `ahead`, from the centre of the part's shape, evenly spaced along the span, as
    of a swept fin. Without it the middles of all chords are at that centre."""
    sections: Annotated[int, Field(strict=True, ge=1, le=50)] = 4
    """Number of sections along the span of a rigid part."""
    thickness: fields.NonNegativeLength = 0.0
    """Largest thickness; it adds to the drag along the chord."""
    aspect_ratio: fields.PositiveNumber | None = None
    """Aspect ratio of lift and added mass, instead of span squared over area: twice that of a fin that stands against a
    wall, 1e6 between two walls."""
    profile_drag: fields.NonNegativeNumber | None = None
    """Drag coefficient along the chord, by the area of one side. Without it, friction by the Reynolds number."""
    broadside_drag: fields.NonNegativeNumber | None = None
    """Drag coefficient across the flow once all flow is separated; a start and a reversal have more in proportion.
    Without it, by the aspect ratio."""
    lift: fields.PositiveShare = 1.0
    """Share of the lift of thin foils of its aspect ratio that it has; foils at small Reynolds numbers have less."""
    suction: fields.Fraction = 1.0
    """Share of the suction of ideal flow at its leading edge, which pulls ahead; sharp and rough edges have less."""
    stall: fields.PositiveAngle = math.radians(15.0)
    """Angle of attack at which half of the flow separates from the leading edge, slowly reached."""
    softness: fields.PositiveSpeed = 1e-3
    """Speed below which the flow along the chord has no direction, so that no edge leads, and with which vortices go
    away from a foil at rest."""
    on = ("box", "cylinder", "mesh", "plate", "rod")
    mirror = Mirror(ahead=lambda direction: _IMAGES.get(direction, direction))
    reynolds_length = "chord"
    aspect_ratios: ClassVar = at_least(
        "aspect_ratio",
        0.5,
        "lift is that of a slender body: take added_mass, drag and a trailing_edge, on a box or a rod",
        "R. T. Jones 1946",
    )
    ranges = (
        aspect_ratios,
        up_to(
            "reduced_frequency",
            2.0,
            "the wake rolls up: thrust and power within a quarter, of strokes below 0.75 chords not known",
            "Theodorsen 1935, tested",
        ),
        up_to("stalled", 0.5, "most of its force is that of separated flow, known to a quarter or a third", "chosen"),
    )
    spreads: ClassVar = {
        "aspect_ratio": Uncertainty(0.75, 1.35, "gaps and neighbours at its ends", THRUST),
        "lift": Uncertainty(0.75, 1.0, "beside discrete vortices; Laitone 1997", THRUST),
        "suction": Uncertainty(0.6, 1.0, "chosen: from sharp edges to round ones", THRUST),
        "stall": Uncertainty(
            math.radians(8.0), math.radians(25.0), "foils and plates at small Reynolds numbers", THRUST, True
        ),
        "broadside_drag": Uncertainty(0.75, 1.35, "Viterna 1982, Hoerner 1965", TOWED),
        "profile_drag": Uncertainty(0.5, 2.0, "chosen", TOWED),
    }

    @model_validator(mode="after")
    def _has_two_axes(self) -> Self:
        if self.ahead[-1] == self.span_along:
            raise wrong("ahead", f"the span runs along {self.span_along}. Take another axis.")
        if self.chord is None and self.leading_edge is not None:
            raise wrong("chord", "is missing. Give it beside the leading edge, or neither of them on a plate.")
        if self.chord is not None and not max(self.chord) > 0:
            raise wrong("chord", "is 0 everywhere: a foil needs an area.")
        return self

    @property
    def chords(self) -> tuple[float, ...]:
        """Return its chords as given, two of a rectangle."""
        given = self.chord or ()
        return given * 2 if len(given) == 1 else given

    @property
    def mean_chord(self) -> float:
        """Return its area over its span, of chords that are given."""
        return sum((a + b) / 2 for a, b in pairwise(self.chords)) / (len(self.chords) - 1)

    def span_on(self, part: Any) -> float:
        """Return its span on a part."""
        if self.span is not None:
            return self.span
        return part.length if self.span_along == "x" and part.kind == "rod" else part.size(_SIZES[self.span_along])

    def ratio(self, part: Any) -> float:
        """Return the aspect ratio of its lift and added mass on a part."""
        if self.aspect_ratio is not None:
            return self.aspect_ratio
        span = self.span_on(part)
        return span / self.mean_chord if self.chord is not None else span**2 / part.shape.area

    def check_plate(self, plane: str) -> None:
        """Raise the error of a field for a plate in another plane, where the chord is that of its outline."""
        if self.chord is None and {self.span_along, self.ahead[-1]} != {*plane}:
            field = "ahead" if self.span_along in plane else "span_along"
            raise wrong(field, f"the plate lies in the {plane} plane, and span and chord lie in it. Or give a chord.")
        if self.chord is None and self.span is not None:
            raise wrong("span", "the plate's outline says it, as it says the chord. Leave it out.")

    def check(self, shape: str, marks: tuple[float, ...] = (), strains: Collection[str] = ()) -> None:
        """Raise the error of a field for a part that it does not fit."""
        super().check(shape, marks, strains)
        if self.chord is None and shape != "plate":
            section = " Give it, or take the section of the mesh as a plate: shape: {section_of: ...}."
            why = f"is missing. Only a plate by its outline has one of its own.{section if shape == 'mesh' else ''}"
            raise wrong("chord", why)
        if shape == "rod":
            if self.span_along != "x":
                raise wrong("span_along", "the span of a foil on a rod runs along the rod. Write x.")
            if self.span is not None:
                raise wrong("span", "on a rod it is the rod's length. Leave it out.")
            if self.leading_edge is not None:
                raise wrong("leading_edge", "a foil on a rod has the middles of its chords on the rod. Leave it out.")
        elif self.span is None and self.span_along != "x" and shape == "cylinder":
            raise wrong("span", "is missing. Give the span of the fin.")


def axes_of(foil: FoilLoad) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return unit vectors ahead and along the span, in the part's frame."""
    return DIRECTIONS[foil.ahead], DIRECTIONS[foil.span_along]
