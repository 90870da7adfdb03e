"""Groups of fields of rods: damping of their material, strains at rest and at the start, strains that motors drive."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, Field, PrivateAttr, model_validator

from nectosome.description import fields
from nectosome.description.drives import AngularServo, AnyMotor, MotorDescription, check_drive
from nectosome.description.mirror import opposite
from nectosome.description.ranges import LOSES, SWUNG
from nectosome.description.signals import AngleSignal, Envelope, RateSignal, StrainSignal
from nectosome.io.schema.described import Described, OneOrMany, Uncertainty, unfit, wrong

_WAYS = ("uniaxial", "loss_factor", "loss_modulus")
_MOST, _WIDEST = 0.3, 100.0  # loss factor that is constant, and the band over which it is: up to there within 4.5 %
_BAND = (0.3, 30.0)  # Hz
Mark = Annotated[float, Field(strict=True, gt=0, lt=1)]


class Losses(Described):
    """The damping of a rod by what a test gives; exactly one of uniaxial viscosity, loss factor and loss modulus.

    Stress of a Kelvin-Voigt material in tension is E e + 3 eta de/dt with the shear viscosity eta, so that its loss
    modulus is 3 eta w and its loss factor 3 eta w / E at the angular frequency w. Both grow with the frequency: they
    are right at the one that is given. A loss factor without a frequency is constant over a band, as silicone and foam
    have it: the material relaxes, so that it is stiffer when it vibrates than Young's modulus, which is that at rest.
    """

    uniaxial: fields.Viscosity | None = None
    """Viscosity in tension and bending: three times that in shear."""
    loss_factor: fields.NonNegativeNumber | None = None
    """Loss modulus over storage modulus (tan delta) in tension or bending: at the frequency, or, without one, constant
    between two frequencies, and then 0.3 at most."""
    loss_modulus: fields.NonNegativePressure | None = None
    """Loss modulus in tension or bending, at the frequency; three times that in shear."""
    frequency: fields.PositiveFrequency | None = None
    """Frequency at which loss factor or loss modulus were measured: take that of the motion."""
    between: tuple[fields.PositiveFrequency, fields.PositiveFrequency] | None = None
    """Frequencies between which a loss factor without a frequency is constant, the higher one at most 100 times the
    lower one; left out 0.3 and 30 Hz."""

    spreads: ClassVar = {
        name: Uncertainty(0.5, 2.0, "chosen", SWUNG, law=LOSES) for name in ("uniaxial", "loss_factor", "loss_modulus")
    }

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        given = [name for name in _WAYS if getattr(self, name) is not None]
        if not given:
            raise wrong("uniaxial", "is missing. Give it, or a loss_factor or a loss_modulus with its frequency.")
        if len(given) > 1:
            raise wrong(given[1], f"there is a {given[0]} as well. Leave one of the two out.")
        if self.loss_modulus is not None and self.frequency is None:
            raise wrong("frequency", "is missing. Give the frequency at which the loss_modulus was measured.")
        if self.uniaxial is not None and self.frequency is not None:
            raise wrong("frequency", "goes with a loss_factor or a loss_modulus. Leave it out.")
        if self.between is not None and (self.loss_factor is None or self.frequency is not None):
            raise wrong("between", "goes with a loss_factor without a frequency. Leave it out.")
        if self.beyond is not None:
            raise wrong(*self.beyond)
        return self

    @property
    def constant(self) -> tuple[float, float, float] | None:
        """A loss factor that is constant, and the frequencies between which it is; None of others."""
        if self.loss_factor is None or self.frequency is not None:
            return None
        return self.loss_factor, *(self.between or _BAND)

    @property
    def beyond(self) -> tuple[str, str] | None:
        """Field of a constant loss factor that no branches have which only lose energy, and why."""
        if self.constant is None:
            return None
        factor, low, high = self.constant
        if factor > _MOST:
            return "loss_factor", f"{factor:g} over a band is more than {_MOST:g}, the most there. Give its frequency."
        if not low < high <= _WIDEST * low:
            return "between", f"the second must be larger than the first, {_WIDEST:g} times it at most."
        return None

    def shear_viscosity(self, young: float) -> float:
        """Return the shear viscosity eta [Pa s] of a material of Young's modulus `young` [Pa]."""
        if self.uniaxial is not None:
            return self.uniaxial / 3
        if self.constant is not None:
            return 0.0
        assert self.frequency is not None
        loss_modulus = young * self.loss_factor if self.loss_factor is not None else self.loss_modulus
        assert loss_modulus is not None
        return loss_modulus / (6 * math.pi * self.frequency)


class _Strains(Described):
    """Strains as coefficients of Legendre polynomials along a rod."""

    torsion: Annotated[tuple[fields.Curvature, ...], OneOrMany()] = ()
    """Twist per length, about the axis of the rod."""
    bending_y: Annotated[tuple[fields.Curvature, ...], OneOrMany()] = ()
    """Curvature about y."""
    bending_z: Annotated[tuple[fields.Curvature, ...], OneOrMany()] = ()
    """Curvature about z."""
    extension: Annotated[tuple[fields.Number, ...], OneOrMany()] = ()
    """Elongation: 0.01 is 1 % longer."""
    shear_y: Annotated[tuple[fields.Number, ...], OneOrMany()] = ()
    """Shear along y."""
    shear_z: Annotated[tuple[fields.Number, ...], OneOrMany()] = ()
    """Shear along z."""


STRAINS_AT_REST = tuple(_Strains.model_fields)


class RestStrains(_Strains):
    """The strains at which a rod is free of stress, as coefficients of Legendre polynomials along it.

    A single number is the same all along the rod. Instead of them a drawn centre line, or a file with one or with a
    table of strains: the file is read, polynomials are fitted, and the rod holds those from then on.
    """

    line: tuple[Annotated[tuple[fields.Coordinate, ...], Field(min_length=2, max_length=3)], ...] = ()
    """Points of the rod's centre line free of stress, from root to tip: x and y of each, or x, y and z. It is moved and
    turned so that it begins at the root along x; sections do not twist along it."""
    file: str | None = None
    """Table beside the robot file instead: columns x, y and z of such points, or the place x (or at, a fraction of the
    length) and the strains there, such as bending_z (1/m), which are joined by straight lines."""
    order: Annotated[int | None, Field(strict=True, ge=0, le=20)] = None
    """Order of the polynomials that are fitted. Without it the lowest one that meets all points within a thousandth of
    the length, or strains within a fiftieth, 12 at most."""
    _note: str = PrivateAttr("")

    def with_note(self, told: str) -> Self:
        """Return the same strains with words on how well they meet what they were fitted to."""
        self._note = told
        return self

    @property
    def note(self) -> str:
        """How well they meet what they were fitted to; empty where they were given."""
        return self._note


class StrainRates(Described):
    """How fast the strains of a rod change at the start, as coefficients of Legendre polynomials along it."""

    torsion: Annotated[tuple[fields.CurvatureRate, ...], OneOrMany()] = ()
    """Rate of the twist per length."""
    bending_y: Annotated[tuple[fields.CurvatureRate, ...], OneOrMany()] = ()
    """Rate of the curvature about y."""
    bending_z: Annotated[tuple[fields.CurvatureRate, ...], OneOrMany()] = ()
    """Rate of the curvature about z."""
    extension: Annotated[tuple[fields.StrainRate, ...], OneOrMany()] = ()
    """Rate of the elongation."""
    shear_y: Annotated[tuple[fields.StrainRate, ...], OneOrMany()] = ()
    """Rate of the shear along y."""
    shear_z: Annotated[tuple[fields.StrainRate, ...], OneOrMany()] = ()
    """Rate of the shear along z."""


class StartStrains(_Strains):
    """The strains with which a rod starts, beyond those at rest, as coefficients of Legendre polynomials along it.

    A single number is the same all along the rod; what is left out starts at 0, free of stress.
    """

    rate: StrainRates = StrainRates()
    """How fast they change at the start."""

    @property
    def given(self) -> bool:
        """Whether any is given."""
        return any(len(values) for own in (self, self.rate) for name, values in own if name != "rate")

    def check(self, orders: Mapping[Any, int], moved: Mapping[str, str]) -> None:
        """Raise the error of a field for a strain that does not start by itself.

        `orders` are those of the free strains, `moved` says what moves another, by strain.
        """
        for where, own in (("", self), ("rate.", self.rate)):
            for name, values in own:
                if name == "rate" or not values:
                    continue
                if name in moved:
                    raise wrong(f"{where}{name}", f"{moved[name]} already says how it starts. Leave this out.")
                if name not in orders:
                    raise wrong(f"{where}{name}", f"the rod's strains do not name {name}. Give it an order there.")
                if len(values) > orders[name] + 1:
                    most = f"{name} has an order of {orders[name]}, so {orders[name] + 1} at most"
                    raise wrong(f"{where}{name}", f"has {len(values)} numbers; {most}.")


def _moves_it(ratio: float) -> float:
    if ratio == 0:
        why = "with 0 the shaft does not move the rod. Give the radius of its drum over the distance of the cord."
        raise unfit(why)
    return ratio


class DrivenStrain(Described):
    """A strain of one shape whose size follows the shaft of a motor, as where cords on a drum bend the rod.

    At the angle a of the shaft the curvature is `ratio a envelope/length`. The rod's elasticity, its viscosity, its
    inertia and the water act back on the motor.
    """

    ratio: Annotated[fields.Number, AfterValidator(_moves_it)]
    """Angle by which the rod bends or twists from its root to its tip, where the envelope is 1, for one radian of the
    shaft: radius of the drum over the distance of the cord from the rod's axis. A negative one turns it backward."""
    envelope: Envelope = (1.0,)
    """Numbers at places spread evenly from the root to the tip, joined by straight lines: the shape of the strain."""
    motion: AngleSignal | None = None
    """Angle of the shaft over time that the servo follows."""
    servo: AngularServo | None = None
    """The servo that follows the motion, with its motor and its supply."""
    motor: AnyMotor | None = None
    """A motor that turns the shaft by a voltage, instead of a motion and a servo."""

    @property
    def powered(self) -> MotorDescription:
        """Its servo or its motor."""
        drive = self.servo or self.motor
        assert drive is not None
        return drive

    def opposite(self) -> Self:
        """Return the same drive of the strain with the other sign."""
        return self.model_copy(update={"ratio": opposite(self.ratio)})

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        check_drive(self, "strain")
        if isinstance(self.motion, RateSignal):
            raise wrong(
                "motion", "a shaft that turns on and on bends the rod without end. Take another kind of signal."
            )
        if self.servo is None and self.motor is None:
            if self.motion is None:
                raise wrong("motor", "is missing. Give a motor, or a motion and the servo that follows it.")
            raise wrong("servo", "is missing. Give one, or leave the drive out and give the rod itself the motion.")
        return self


class DrivenStrains(Described):
    """Strains of a rod that motors drive: curvatures about its sections' axes."""

    torsion: DrivenStrain | None = None
    """Twist per length."""
    bending_y: DrivenStrain | None = None
    """Curvature about y."""
    bending_z: DrivenStrain | None = None
    """Curvature about z."""

    @property
    def given(self) -> dict[str, DrivenStrain]:
        """Those that there are, by strain."""
        return {name: strain for name, strain in self if strain is not None}


class PrescribedStrains(Described):
    """Strains that a rod is made to take: curvatures about its sections' axes."""

    torsion: StrainSignal | None = None
    """Twist per length over time."""
    bending_y: StrainSignal | None = None
    """Curvature about y over time."""
    bending_z: StrainSignal | None = None
    """Curvature about z over time."""
