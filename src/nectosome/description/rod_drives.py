"""Strains of a rod that motors drive: the shape that a shaft gives the rod, its motor, and the signal it follows."""

from typing import Annotated, Self

from pydantic import AfterValidator, model_validator

from nectosome.description.drives import AngularServo, AnyMotor, MotorDescription, check_drive
from nectosome.description.fields import Number
from nectosome.description.mirror import opposite
from nectosome.description.signals import AngleSignal, Envelope, RateSignal
from nectosome.io.schema.described import Described, unfit, wrong


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

    ratio: Annotated[Number, AfterValidator(_moves_it)]
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
