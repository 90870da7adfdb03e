"""Loads inside rods: tendons, chambers of fluid, muscles."""

from collections.abc import Collection
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.fields import Coordinate, NonNegativeNumber, Number, PositiveArea, Pressure
from nectosome.description.loads import ROD, LoadDescription
from nectosome.description.mirror import Mirror, across, opposite
from nectosome.description.signals import ForceSignal, MomentSignal, PressureSignal
from nectosome.io.schema.described import Described, increasing, wrong

TURNED = ("torsion", "bending_z")
"""Strains whose image has the other sign."""

_Fraction = Annotated[float, Field(ge=0, le=1)]
_FORWARD = "the first fraction of the rod's length must be less than the second."
_Along = Annotated[tuple[_Fraction, _Fraction], increasing(_FORWARD)]
_Across = tuple[Coordinate, Coordinate]


class _ThreadLoad(LoadDescription):
    place: _Across
    tip_place: _Across | None = None
    along: _Along = (0.0, 1.0)
    on = ROD
    mirror = Mirror(place=across, tip_place=across)


class TendonLoad(_ThreadLoad):
    """A tendon in a rod, without friction, pulled with `tension` [N].

    It runs `along` the rod from one fraction of its length to another, where it ends: from `place` [m] across the rod
    (y, z) straight to `tip_place` (the same, where it is left out).
    """

    kind: Literal["tendon"]
    tension: ForceSignal

    @model_validator(mode="after")
    def _pulls(self) -> Self:
        if self.tension.least() < 0:
            raise wrong("tension", "a tendon pulls, it cannot push: its tension must not be below 0 N at any time.")
        return self


class PlayHysteresis(Described):
    """Hysteresis as a direct part and a sum of plays (Prandtl-Ishlinskii): `direct` p + sum of `weights` H.

    A play H follows the pressure p once that is more than its threshold [Pa] ahead. What repeats itself is taken as
    having done so for ever.
    """

    direct: NonNegativeNumber = 1.0
    thresholds: Annotated[tuple[Pressure, ...], Field(min_length=1), increasing("the thresholds must increase.")]
    weights: tuple[Number, ...]

    @model_validator(mode="after")
    def _one_weight_a_play(self) -> Self:
        if len(self.thresholds) != len(self.weights):
            counts = f"there are {len(self.weights)} weights for {len(self.thresholds)} thresholds"
            raise wrong("weights", f"{counts}. Give one for each.")
        return self


class ChamberLoad(_ThreadLoad):
    """A chamber in a rod, whose `pressure` [Pa] over that outside makes it longer; its section does not bulge.

    It runs `along` the rod from one fraction of its length to another, its middle from `place` [m] across the rod (y,
    z) straight to `tip_place`, its section from `area` [m2] to `tip_area` (the same, where they are left out). With
    `hysteresis` it pushes with what that makes of the pressure.
    """

    kind: Literal["chamber"]
    pressure: PressureSignal
    hysteresis: PlayHysteresis | None = None
    area: PositiveArea
    tip_area: PositiveArea | None = None


class MuscleLoad(LoadDescription):
    """Muscles of a rod that bend or twist it: an active `moment` about one axis of its sections, as a wave [N m].

    A positive moment makes that strain larger. The strain must be one of the rod's.
    """

    kind: Literal["muscle"]
    strain: Literal["torsion", "bending_y", "bending_z"]
    moment: MomentSignal
    on = ROD
    mirror = Mirror(moment=opposite)

    def image(self) -> Self:
        """Return the image: where the strain turns its sign, so does the moment."""
        return super().image() if self.strain in TURNED else self

    def check(self, shape: str, marks: tuple[float, ...] = (), strains: Collection[str] = ()) -> None:
        """Raise the error of a field for a strain that the rod does not have."""
        super().check(shape, marks, strains)
        if self.strain not in strains:
            raise wrong("strain", f"{self.strain} is not free: the rod's strains do not name it.")
