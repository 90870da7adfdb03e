"""Limbs that come several times: evenly around an axis, in a row, or as a mirrored pair."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.base import Axis, Described, Position, wrong
from nectosome.description.fields import Angle

Count = Annotated[int, Field(strict=True, ge=2, le=100)]


class Repeat(Described):
    """How often a limb comes: `count` times `around` an axis or `along` a row, or twice, by `mirror`.

    All that sits on it comes with it. Axis, row and mirror are those of the part that the limb sits on, through the
    place where it sits. Around: copy k is turned about the axis by (k - 1) 360 deg / count. Along: it is moved by
    (k - 1) times that step [m]. Mirror: the second copy is the image of the first in the plane
    normal to x, y or z. The copies of `leg` are `leg1`, `leg2`, ...; the first is as written. The drives of copy k
    run ahead of those of the first by (k - 1) `phase` [rad].
    """

    count: Count | None = None
    around: Axis | None = None
    along: Position | None = None
    mirror: Literal["x", "y", "z"] | None = None
    phase: Angle = 0.0

    @model_validator(mode="after")
    def _one_way(self) -> Self:
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
