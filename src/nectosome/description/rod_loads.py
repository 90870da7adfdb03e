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
    """What runs along a rod, straight from one place across it to another."""

    place: _Across
    """Place across the rod where it begins, along y and z."""
    tip_place: _Across | None = None
    """Place across the rod where it ends; the same where it is left out."""
    along: _Along = (0.0, 1.0)
    """Fractions of the length from which and up to which it runs."""
    on = ROD
    mirror = Mirror(place=across, tip_place=across)


class TendonLoad(_ThreadLoad):
    """A tendon in a rod, pulled where it begins, without friction unless it is given; it ends where it is fixed."""

    kind: Literal["tendon"]
    tension: ForceSignal
    """Tension over time, where it begins; at no time below 0 N."""
    friction: NonNegativeNumber = 0.0
    """Coefficient mu of friction against its sheath or discs: behind a bend by theta it pulls by exp(-mu theta) of its
    tension, where it slides back by exp(mu theta), and holds between. In `static` it was pulled last. 0: none."""

    @model_validator(mode="after")
    def _pulls(self) -> Self:
        if self.tension.least() < 0:
            raise wrong("tension", "a tendon pulls, it cannot push: its tension must not be below 0 N at any time.")
        return self


class PlayHysteresis(Described):
    """Hysteresis as a direct part and a sum of plays H (Prandtl-Ishlinskii): direct p + sum of weights H.

    A play H follows the pressure p once that is more than its threshold ahead. What repeats itself is taken as having
    done so for ever; in a ramp its distance from its mean grows.
    """

    direct: NonNegativeNumber = 1.0
    """Share of the pressure that has no hysteresis."""
    thresholds: Annotated[tuple[Pressure, ...], Field(min_length=1), increasing("the thresholds must increase.")]
    """Pressures by which each play lags behind, increasing."""
    weights: tuple[Number, ...]
    """Weight of each play."""

    @model_validator(mode="after")
    def _one_weight_a_play(self) -> Self:
        if len(self.thresholds) != len(self.weights):
            counts = f"there are {len(self.weights)} weights for {len(self.thresholds)} thresholds"
            raise wrong("weights", f"{counts}. Give one for each.")
        return self


class ChamberLoad(_ThreadLoad):
    """A chamber in a rod, whose pressure makes it longer; its section does not bulge."""

    kind: Literal["chamber"]
    pressure: PressureSignal
    """Pressure over that outside, over time."""
    hysteresis: PlayHysteresis | None = None
    """Hysteresis between that pressure and what pushes."""
    area: PositiveArea
    """Area of its section where it begins."""
    tip_area: PositiveArea | None = None
    """Area of its section where it ends; the same where it is left out."""

    @model_validator(mode="after")
    def _hysteresis_of_a_cycle(self) -> Self:
        known = "constant", "recording", "sine", "triangle", "stroke", "cycle"
        if self.hysteresis is not None and self.pressure.kind not in known:
            why = "is computed of a constant, recorded or periodic pressure. Record this one, or leave hysteresis out."
            raise wrong("hysteresis", why)
        return self


class MuscleLoad(LoadDescription):
    """Muscles of a rod that bend or twist it: an active moment about one axis of its sections."""

    kind: Literal["muscle"]
    strain: Literal["torsion", "bending_y", "bending_z"]
    """The strain that the moment changes; one of the rod's strains."""
    moment: MomentSignal
    """Moment as a wave along the rod. A positive one makes the strain larger."""
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
