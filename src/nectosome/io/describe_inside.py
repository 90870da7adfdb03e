"""Loads inside rods: tendons, chambers of fluid, muscles."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from nectosome.io.describe_base import Described, unfit, wrong
from nectosome.io.describe_signals import ForceSignal, PressureSignal
from nectosome.io.describe_waves import MomentWave
from nectosome.io.fields import Coordinate, PositiveArea


def _forward(along: tuple[float, float]) -> tuple[float, float]:
    if not along[0] < along[1]:
        raise unfit("the first fraction of the rod's length must be less than the second.")
    return along


_Fraction = Annotated[float, Field(ge=0, le=1)]
_Along = Annotated[tuple[_Fraction, _Fraction], AfterValidator(_forward)]
_Across = tuple[Coordinate, Coordinate]


class _Thread(Described):
    place: _Across
    tip_place: _Across | None = None
    along: _Along = (0.0, 1.0)


class TendonLoad(_Thread):
    """A tendon in a rod, without friction, pulled with `tension` [N].

    It runs `along` the rod from one fraction of its length to another, where it ends: from `place` [m] across the rod
    (y, z) straight to `tip_place` (the same, where it is left out).
    """

    kind: Literal["tendon"]
    tension: ForceSignal

    @model_validator(mode="after")
    def _pulls(self) -> Self:
        s = self.tension
        values = {"constant": lambda: (s.value,), "sine": lambda: (s.offset - abs(s.amplitude),)}
        if min(values.get(s.kind, lambda: s.values)()) < 0:
            raise wrong("tension", "a tendon pulls, it cannot push: its tension must not be below 0 N at any time.")
        return self


class ChamberLoad(_Thread):
    """A chamber in a rod, whose `pressure` [Pa] over that outside makes it longer; its section does not bulge.

    It runs `along` the rod from one fraction of its length to another, its middle from `place` [m] across the rod (y,
    z) straight to `tip_place`, its section from `area` [m2] to `tip_area` (the same, where they are left out).
    """

    kind: Literal["chamber"]
    pressure: PressureSignal
    area: PositiveArea
    tip_area: PositiveArea | None = None


class MuscleLoad(Described):
    """Muscles of a rod that bend or twist it: an active `moment` about one axis of its sections, as a wave [N m].

    A positive moment makes that strain larger. The strain must be one of the rod's.
    """

    kind: Literal["muscle"]
    strain: Literal["torsion", "bending_y", "bending_z"]
    moment: MomentWave
