"""Limbs that come several times: evenly around an axis, or as a mirrored pair."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.io.describe_base import Axis, Described, wrong
from nectosome.io.fields import Angle

Count = Annotated[int, Field(strict=True, ge=2, le=100)]


class Repeat(Described):
    """How often a limb comes, with all that sits on it: `count` times `around` an axis, or twice, by `mirror`.

    Axis and mirror are those of the part that the limb sits on, through the place where it sits. Around: copy k is
    turned about the axis by (k - 1) 360 deg / count. Mirror: the second copy is the image of the first in the plane
    normal to x, y or z. The copies of `leg` are `leg1`, `leg2`, ...; the first is as written. The drives of copy k
    run ahead of those of the first by (k - 1) `phase` [rad].
    """

    count: Count | None = None
    around: Axis | None = None
    mirror: Literal["x", "y", "z"] | None = None
    phase: Angle = 0.0

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.mirror is not None:
            for name in ("count", "around"):
                if getattr(self, name) is not None:
                    raise wrong(name, "a mirrored limb comes twice. Leave it out, or the mirror.")
        elif self.count is None or self.around is None:
            missing = "around" if self.around is None else "count"
            raise wrong(missing, "is missing. Write {count: 4, around: x}, or {mirror: y} for a pair.")
        return self
