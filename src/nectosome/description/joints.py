"""Joints: how a part moves against what it sits on."""

import math
from typing import Any, ClassVar, Generic, Literal, Self, TypeVar

from pydantic import model_validator

from nectosome.description.base import ZERO, AngularVelocity, Axis, Position, Rotation, Velocity
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
from nectosome.description.mirror import Mirror, Mirrored, about, along, opposite
from nectosome.description.signals import AngleSignal, ForceSignal, LengthSignal, TorqueSignal
from nectosome.io.schema.described import Described, wrong

Q = TypeVar("Q", bound=float)
"""The coordinate of a joint, `Angle` or `Coordinate`."""
S = TypeVar("S", bound=float)
"""Its rate."""
K = TypeVar("K", bound=float)
"""The stiffness against it."""
C = TypeVar("C", bound=float)
"""The damping of its rate."""


class JointDescription(Mirrored):
    """How a part moves against what it sits on. `drive_field` is the field of the forces that drive it."""

    kind: Any  # its name in a file, a literal of each class
    drive_field: ClassVar[str] = "drive"

    @model_validator(mode="after")
    def _one_drive(self) -> Self:
        if getattr(self, "motion", None) is None:
            return self
        drive = self.drive_field
        if getattr(self, drive) is not None:
            raise wrong(drive, f"a joint with a motion cannot have a {drive} as well. Leave one of them out.")
        for name in ("position", "velocity", "start"):
            field = type(self).model_fields.get(name)
            if field is not None and getattr(self, name) != field.default:
                raise wrong(name, f"the motion already says where the joint starts. Leave the {name} out.")
        return self


class FixedJoint(JointDescription):
    """No motion."""

    kind: Literal["fixed"]
    mirror = Mirror()


class _Limit(Described, Generic[Q, K, C]):
    at: Q = 0.0  # pyright: ignore[reportAssignmentType]
    stiffness: K
    damping: C = 0.0  # pyright: ignore[reportAssignmentType]


class AngularLimit(_Limit[Angle, AngularStiffness, AngularDamping]):
    """A stop `at` an angle [rad]: a spring of `stiffness` [N m/rad] and a damper [N m s/rad] that only push.

    Both rise smoothly over the first `softness` [rad] of the way into the stop.
    """

    softness: PositiveAngle = math.radians(1.0)


class LinearLimit(_Limit[Coordinate, Stiffness, Damping]):
    """A stop `at` a place [m]: a spring of `stiffness` [N/m] and a damper [N s/m] that only push.

    Both rise smoothly over the first `softness` [m] of the way into the stop.
    """

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


class _AxialJoint(JointDescription, Generic[Q, S, K, C]):
    """What a hinge and a slide share."""

    axis: Axis
    position: Q = 0.0  # pyright: ignore[reportAssignmentType]
    velocity: S = 0.0  # pyright: ignore[reportAssignmentType]
    stiffness: K = 0.0  # pyright: ignore[reportAssignmentType]
    damping: C = 0.0  # pyright: ignore[reportAssignmentType]
    rest: Q = 0.0  # pyright: ignore[reportAssignmentType]

    @model_validator(mode="after")
    def _stops_apart(self) -> Self:
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        if lower is not None and upper is not None and not lower.at < upper.at:
            raise wrong("upper.at", "must be above the lower stop.")
        return self


class RevoluteJoint(_AxialJoint[Angle, AngularSpeed, AngularStiffness, AngularDamping]):
    """A hinge about `axis`: spring and damper, stops, and either a prescribed `motion`, a `torque`, or neither.

    `position` [rad] and `velocity` [rad/s] are those at the start; the spring is at ease at `rest` [rad]. Its
    `stiffness` is given, or follows from a `flexure`. `lower` and `upper` are stops that it runs into, `limits` those
    of the servo that makes the motion.
    """

    kind: Literal["revolute"]
    flexure: Flexure | None = None
    lower: AngularLimit | None = None
    upper: AngularLimit | None = None
    motion: AngleSignal | None = None
    torque: TorqueSignal | None = None
    limits: ServoLimits | None = None
    mirror = Mirror(axis=about)
    drive_field = "torque"

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        if self.flexure is not None and self.stiffness != 0:
            raise wrong("stiffness", "follows from the flexure. Leave one of the two out.")
        return self

    @model_validator(mode="after")
    def _limits_of_a_servo(self) -> Self:
        if self.limits is not None and self.motion is None:
            raise wrong("limits", "are those of a servo, but there is no motion that it makes. Leave them out.")
        return self


class PrismaticJoint(_AxialJoint[Coordinate, Speed, Stiffness, Damping]):
    """A slide along `axis`: spring and damper, stops, and either a prescribed `motion`, a `force`, or neither.

    `position` [m] and `velocity` [m/s] are those at the start; the spring is at ease at `rest` [m].
    """

    kind: Literal["prismatic"]
    lower: LinearLimit | None = None
    upper: LinearLimit | None = None
    motion: LengthSignal | None = None
    force: ForceSignal | None = None
    mirror = Mirror(axis=along)
    drive_field = "force"


class PlanarMotion(Described):
    """Where a planar joint is made to go: `x`, `y` in the plane [m] and `angle` about its axis [rad]."""

    x: LengthSignal | None = None
    y: LengthSignal | None = None
    angle: AngleSignal | None = None


class PlanarDrive(Described):
    """Forces along the moving part's own `x` and `y` [N] and the torque about its axis, `angle` [N m]."""

    x: ForceSignal | None = None
    y: ForceSignal | None = None
    angle: TorqueSignal | None = None


class PlanarStart(Described):
    """Where a planar joint starts: `angle` [rad] about the axis, `position` [m], and their rates.

    All vectors lie in the plane. The velocity is in the moving part's own frame.
    """

    position: Position = ZERO
    angle: Angle = 0.0
    velocity: Velocity = ZERO
    angular_speed: AngularSpeed = 0.0


class PlanarJoint(JointDescription):
    """Moves in the plane normal to `axis`: two translations and the rotation about the axis."""

    kind: Literal["planar"]
    axis: Axis
    start: PlanarStart = PlanarStart()
    motion: PlanarMotion | None = None
    drive: PlanarDrive | None = None
    mirror = Mirror(axis=about, start=Mirror(position=along, velocity=along))

    def image(self) -> Self:
        """Return the image of a joint without a motion and a drive. Raises the error of a field for others."""
        field = next((name for name in ("motion", "drive") if getattr(self, name) is not None), None)
        if field is not None:
            raise wrong(field, f"a planar joint with a {field} cannot be mirrored. Write both limbs out.")
        return super().image()

    @model_validator(mode="after")
    def _start_in_plane(self) -> Self:
        size = math.hypot(*self.axis)
        for name, vector in (("position", self.start.position), ("velocity", self.start.velocity)):
            out_of_plane = sum(a / size * b for a, b in zip(self.axis, vector, strict=True))
            if abs(out_of_plane) > 1e-9 * math.hypot(*vector):
                raise wrong(f"start.{name}", f"the {name} leaves the plane normal to the axis. Leave that part out.")
        return self


class SphericalMotion(Described):
    """How a spherical joint is made to turn: `roll`, `pitch`, `yaw` [rad]."""

    roll: AngleSignal | None = None
    pitch: AngleSignal | None = None
    yaw: AngleSignal | None = None


class SphericalDrive(Described):
    """Torques about the moving part's own `x`, `y`, `z` [N m]."""

    x: TorqueSignal | None = None
    y: TorqueSignal | None = None
    z: TorqueSignal | None = None


class SphericalStart(Described):
    """Where a spherical joint starts: `orientation` (roll, pitch, yaw) [rad], `angular_velocity` [rad/s].

    The angular velocity is in the moving part's own frame.
    """

    orientation: Rotation = ZERO
    angular_velocity: AngularVelocity = ZERO


class SphericalJoint(JointDescription):
    """Turns freely in all three directions, with the same `stiffness` and `damping` in each."""

    kind: Literal["spherical"]
    stiffness: AngularStiffness = 0.0
    damping: AngularDamping = 0.0
    start: SphericalStart = SphericalStart()
    motion: SphericalMotion | None = None
    drive: SphericalDrive | None = None
    mirror = Mirror(
        start=Mirror(orientation=about, angular_velocity=about),
        motion=Mirror(roll=opposite, yaw=opposite),
        drive=Mirror(x=opposite, z=opposite),
    )


class FreeMotion(Described):
    """Where a free part is made to go: `x`, `y`, `z` [m] and `roll`, `pitch`, `yaw` [rad]: a moving base."""

    x: LengthSignal | None = None
    y: LengthSignal | None = None
    z: LengthSignal | None = None
    roll: AngleSignal | None = None
    pitch: AngleSignal | None = None
    yaw: AngleSignal | None = None


class FreeDrive(Described):
    """Torques about and forces along the moving part's own axes [N m, N]: thrusters."""

    torque_x: TorqueSignal | None = None
    torque_y: TorqueSignal | None = None
    torque_z: TorqueSignal | None = None
    force_x: ForceSignal | None = None
    force_y: ForceSignal | None = None
    force_z: ForceSignal | None = None


class FreeStart(Described):
    """Where a free part starts: `position` [m], `orientation` (roll, pitch, yaw) [rad], and their rates.

    Both velocities are in the moving part's own frame.
    """

    position: Position = ZERO
    orientation: Rotation = ZERO
    velocity: Velocity = ZERO
    angular_velocity: AngularVelocity = ZERO


class FreeJoint(JointDescription):
    """Moves and turns freely."""

    kind: Literal["free"]
    start: FreeStart = FreeStart()
    motion: FreeMotion | None = None
    drive: FreeDrive | None = None
    mirror = Mirror(
        start=Mirror(position=along, orientation=about, velocity=along, angular_velocity=about),
        motion=Mirror(y=opposite, roll=opposite, yaw=opposite),
        drive=Mirror(torque_x=opposite, torque_z=opposite, force_y=opposite),
    )
