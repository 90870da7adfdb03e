"""Joints: how a part moves against what it sits on."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.base import ZERO, AngularVelocity, Axis, Described, Position, Rotation, Velocity, wrong
from nectosome.description.fields import (
    Angle,
    AngularDamping,
    AngularSpeed,
    AngularStiffness,
    Coordinate,
    Damping,
    Length,
    PositiveAngle,
    PositiveAngularSpeed,
    PositiveNumber,
    PositiveTorque,
    Pressure,
    Speed,
    Stiffness,
)
from nectosome.description.joint_signals import (
    FreeDrive,
    FreeMotion,
    PlanarDrive,
    PlanarMotion,
    SphericalDrive,
    SphericalMotion,
)
from nectosome.description.signals import AngleSignal, ForceSignal, LengthSignal, TorqueSignal


class FixedJoint(Described):
    """No motion."""

    kind: Literal["fixed"]


class AngularLimit(Described):
    """A stop `at` an angle [rad]: a spring of `stiffness` [N m/rad] and a damper [N m s/rad] that only push.

    Both rise smoothly over the first `softness` [rad] of the way into the stop.
    """

    at: Angle = 0.0
    stiffness: AngularStiffness
    damping: AngularDamping = 0.0
    softness: PositiveAngle = math.radians(1.0)


class LinearLimit(Described):
    """A stop `at` a place [m]: a spring of `stiffness` [N/m] and a damper [N s/m] that only push.

    Both rise smoothly over the first `softness` [m] of the way into the stop.
    """

    at: Coordinate = 0.0
    stiffness: Stiffness
    damping: Damping = 0.0
    softness: Length


class Flexure(Described):
    """A hinge made of a flexible strip that a spring stands for (pseudo-rigid body, Hu et al. 2024, eq. 16).

    k = pi ratio^2 E I / length with I = width thickness^3 / 12: `length` [m] is that of the whole flexible layer, and
    `ratio` its characteristic radius factor.
    """

    length: Length
    width: Length
    thickness: Length
    young: Pressure
    ratio: PositiveNumber = 0.85


class ServoLimits(Described):
    """What a servo can give at most, `torque` [N m] and `speed` [rad/s]: no motion is changed by it, but it is told."""

    torque: PositiveTorque
    speed: PositiveAngularSpeed


class RevoluteJoint(Described):
    """A hinge about `axis`: spring and damper, stops, and either a prescribed `motion`, a `torque`, or neither.

    `position` [rad] and `velocity` [rad/s] are those at the start; the spring is at ease at `rest` [rad]. Its
    `stiffness` is given, or follows from a `flexure`. `lower` and `upper` are stops that it runs into, `limits` those
    of the servo that makes the motion.
    """

    kind: Literal["revolute"]
    axis: Axis
    position: Angle = 0.0
    velocity: AngularSpeed = 0.0
    stiffness: AngularStiffness = 0.0
    damping: AngularDamping = 0.0
    rest: Angle = 0.0
    flexure: Flexure | None = None
    lower: AngularLimit | None = None
    upper: AngularLimit | None = None
    motion: AngleSignal | None = None
    torque: TorqueSignal | None = None
    limits: ServoLimits | None = None

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        if self.flexure is not None and self.stiffness != 0:
            raise wrong("stiffness", "follows from the flexure. Leave one of the two out.")
        return self

    @model_validator(mode="after")
    def _stops_apart(self) -> Self:
        _check_stops(self.lower, self.upper)
        return self

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        _check_drive(self.motion, "torque", self.torque, self.position, self.velocity)
        return self

    @model_validator(mode="after")
    def _limits_of_a_servo(self) -> Self:
        if self.limits is not None and self.motion is None:
            raise wrong("limits", "are those of a servo, but there is no motion that it makes. Leave them out.")
        return self


class PrismaticJoint(Described):
    """A slide along `axis`: spring and damper, stops, and either a prescribed `motion`, a `force`, or neither.

    `position` [m] and `velocity` [m/s] are those at the start; the spring is at ease at `rest` [m].
    """

    kind: Literal["prismatic"]
    axis: Axis
    position: Coordinate = 0.0
    velocity: Speed = 0.0
    stiffness: Stiffness = 0.0
    damping: Damping = 0.0
    rest: Coordinate = 0.0
    lower: LinearLimit | None = None
    upper: LinearLimit | None = None
    motion: LengthSignal | None = None
    force: ForceSignal | None = None

    @model_validator(mode="after")
    def _stops_apart(self) -> Self:
        _check_stops(self.lower, self.upper)
        return self

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        _check_drive(self.motion, "force", self.force, self.position, self.velocity)
        return self


def _check_stops(lower: AngularLimit | LinearLimit | None, upper: AngularLimit | LinearLimit | None) -> None:
    if lower is not None and upper is not None and not lower.at < upper.at:
        raise wrong("upper.at", "must be above the lower stop.")


def _check_drive(motion: object, drive_name: str, drive: object, position: float, velocity: float) -> None:
    if motion is None:
        return
    if drive is not None:
        raise wrong(drive_name, f"a joint with a motion cannot have a {drive_name} as well. Leave one of them out.")
    for name, value in (("position", position), ("velocity", velocity)):
        if value != 0:
            raise wrong(name, f"the motion already says where the joint starts. Leave the {name} out.")


class PlanarStart(Described):
    """Where a planar joint starts: `angle` [rad] about the axis, `position` [m], and their rates.

    All vectors lie in the plane. The velocity is in the moving part's own frame.
    """

    position: Position = ZERO
    angle: Angle = 0.0
    velocity: Velocity = ZERO
    angular_speed: AngularSpeed = 0.0


class PlanarJoint(Described):
    """Moves in the plane normal to `axis`: two translations and the rotation about the axis."""

    kind: Literal["planar"]
    axis: Axis
    start: PlanarStart = PlanarStart()
    motion: PlanarMotion | None = None
    drive: PlanarDrive | None = None

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        _check_either(self)
        return self

    @model_validator(mode="after")
    def _start_in_plane(self) -> Self:
        size = math.hypot(*self.axis)
        for name, vector in (("position", self.start.position), ("velocity", self.start.velocity)):
            out_of_plane = sum(a / size * b for a, b in zip(self.axis, vector, strict=True))
            if abs(out_of_plane) > 1e-9 * math.hypot(*vector):
                raise wrong(f"start.{name}", f"the {name} leaves the plane normal to the axis. Leave that part out.")
        return self


class SphericalStart(Described):
    """Where a spherical joint starts: `orientation` (roll, pitch, yaw) [rad], `angular_velocity` [rad/s].

    The angular velocity is in the moving part's own frame.
    """

    orientation: Rotation = ZERO
    angular_velocity: AngularVelocity = ZERO


class SphericalJoint(Described):
    """Turns freely in all three directions, with the same `stiffness` and `damping` in each."""

    kind: Literal["spherical"]
    stiffness: AngularStiffness = 0.0
    damping: AngularDamping = 0.0
    start: SphericalStart = SphericalStart()
    motion: SphericalMotion | None = None
    drive: SphericalDrive | None = None

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        _check_either(self)
        return self


class FreeStart(Described):
    """Where a free part starts: `position` [m], `orientation` (roll, pitch, yaw) [rad], and their rates.

    Both velocities are in the moving part's own frame.
    """

    position: Position = ZERO
    orientation: Rotation = ZERO
    velocity: Velocity = ZERO
    angular_velocity: AngularVelocity = ZERO


class FreeJoint(Described):
    """Moves and turns freely."""

    kind: Literal["free"]
    start: FreeStart = FreeStart()
    motion: FreeMotion | None = None
    drive: FreeDrive | None = None

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        _check_either(self)
        return self


def _check_either(joint: "PlanarJoint | SphericalJoint | FreeJoint") -> None:
    if joint.motion is None:
        return
    if joint.drive is not None:
        raise wrong("drive", "a joint with a motion cannot have a drive as well. Leave one of them out.")
    if joint.start != type(joint.start)():
        raise wrong("start", "the motion already says where the joint starts. Leave the start out.")


Joint = Annotated[
    FixedJoint | RevoluteJoint | PrismaticJoint | PlanarJoint | SphericalJoint | FreeJoint,
    Field(discriminator="kind"),
]
