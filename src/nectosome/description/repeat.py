"""How often a limb comes."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.fields import Angle, Axis, Position
from nectosome.io.schema.described import Described, wrong


class Repeat(Described):
    """How often a limb comes: so many around an axis or along a row, or twice, by a mirror.

    All that sits on it comes with it. The copies of `leg` are `leg1`, `leg2`, ...; the first is as written.
    """

    count: Annotated[int, Field(strict=True, ge=2, le=100)] | None = None
    """How many there are, the first one included."""
    around: Axis | None = None
    """Axis about which the copies go around: copy k is turned by (k - 1) 360 deg / count. It is that of the part that
    the limb sits on, through the place where it sits."""
    along: Position | None = None
    """Step of a row, along the axes of the part that the limb sits on: copy k is moved by (k - 1) times the step."""
    mirror: Literal["x", "y", "z"] | None = None
    """The limb comes twice; the second is the image of the first in the plane normal to this axis."""
    phase: Angle = 0.0
    """The drives of copy k run ahead of those of the first by (k - 1) times this angle."""

    @model_validator(mode="after")
    def _one_pattern(self) -> Self:
        if self.mirror is not None:
            for name in ("count", "around", "along"):
                if getattr(self, name) is not None:
                    raise wrong(name, "a mirrored limb comes twice. Leave it out, or the mirror.")
            return self
        if self.around is not None and self.along is not None:
            raise wrong("along", "the copies go around an axis already. Leave one of the two out.")
        if self.count is None or (self.around is None and self.along is None):
            missing = "count" if self.count is None else "around"
            ways = "{count: 4, around: x}, {count: 5, along: [-2 cm, 0 m, 0 m]} for a row, or {mirror: y} for a pair"
            raise wrong(missing, f"is missing. Write {ways}.")
        if self.along is not None and not any(self.along):
            raise wrong("along", "is no step: all copies would be in one place.")
        return self
