"""Joints: how a part moves against what it sits on."""

import math
from typing import Any, ClassVar, Generic, Literal, Self, TypeVar

from pydantic import model_validator

from nectosome.description import fields
from nectosome.description.drives import AngularServo, AnyMotor, LinearServo, MotorDescription, check_drive
from nectosome.description.fields import ZERO, AngularVelocity, Axis, Position, Rotation, Velocity
from nectosome.description.mirror import Mirror, Mirrored, about, along, opposite
from nectosome.description.ranges import BENT, SWUNG
from nectosome.description.signals import AngleSignal, ForceSignal, LengthSignal, TorqueSignal
from nectosome.io.schema.described import Described, Uncertainty, wrong

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
    coordinate: ClassVar[str] = ""  # name of the one that a motor can move
    spreads: ClassVar = {
        "stiffness": Uncertainty(0.85, 1.15, "springs and strips as they are made, chosen", BENT),
        "damping": Uncertainty(0.4, 2.5, "chosen", SWUNG),
        "friction": Uncertainty(0.5, 2.0, "chosen", "turn it slowly, measure the torque"),
    }
    decided_by = dict.fromkeys(("position", "velocity", "start"), "motion")

    @property
    def powered(self) -> MotorDescription | None:
        """Its servo or its motor; None without either."""
        return getattr(self, "servo", None) or getattr(self, "motor", None)

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
    """What stops of hinges and slides share."""

    at: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Where the stop is."""
    stiffness: K
    """Stiffness of its spring, which only pushes."""
    damping: C = 0.0  # pyright: ignore[reportAssignmentType]
    """Damping of its damper, which only pushes."""


class AngularLimit(_Limit[fields.Angle, fields.AngularStiffness, fields.AngularDamping]):
    """A stop at an angle: a spring and a damper that only push."""

    softness: fields.PositiveAngle = math.radians(1.0)
    """Angle into the stop over which spring and damper set in smoothly."""


class LinearLimit(_Limit[fields.Coordinate, fields.Stiffness, fields.Damping]):
    """A stop at a place: a spring and a damper that only push."""

    softness: fields.Length
    """Way into the stop over which spring and damper set in smoothly."""


class Flexure(Described):
    """A hinge made of a short flexible strip between two stiff parts, bent to a circular arc.

    k = E I / gap with I = width thickness^3 / 12, and the strain of its faces is angle thickness / (2 gap) (Howell,
    Compliant Mechanisms, 2001, section 5.2).
    """

    gap: fields.Length | None = None
    """Free length of the strip, between the edges of the stiff parts that it joins."""
    width: fields.Length
    """Width of the strip, along the axis of the hinge."""
    thickness: fields.Length | None = None
    """Thickness of the strip, the direction in which it bends."""
    stiffness: fields.PositiveAngularStiffness | None = None
    """Stiffness of the hinge as measured, instead of a thickness, which then follows from it."""
    young: fields.Pressure
    """Young's modulus of the strip."""
    as_printed: fields.Length | None = None
    """Instead of a gap: length of the whole layer of a chain of hinges, as eq. 16 of Hu et al. 2024 takes it, with k =
    pi ratio^2 E I / length. Strains are then those of a strip as long as this, far below those of a gap."""
    ratio: fields.PositiveNumber = 0.85
    """Characteristic radius factor of the strip as printed."""
    decided_by: ClassVar = {"ratio": "gap"}

    @model_validator(mode="before")
    @classmethod
    def _length_of_which(cls, given: Any) -> Any:
        if isinstance(given, dict) and "length" in given:
            why = "is of what? Write gap for that between the stiff parts"
            raise wrong("length", f"{why}, or as_printed for that of a whole layer, as in eq. 16 of Hu et al. 2024.")
        return given

    @model_validator(mode="after")
    def _one_strip(self) -> Self:
        for one, other in (("gap", "as_printed"), ("thickness", "stiffness")):
            if getattr(self, one) is None and getattr(self, other) is None:
                raise wrong(one, f"is missing. Give the {one} of the strip.")
            if getattr(self, one) is not None and getattr(self, other) is not None:
                raise wrong(other, f"there is a {one} as well. Leave one of the two out.")
        if self.gap is not None and "ratio" in self.model_fields_set:
            raise wrong("ratio", "goes with as_printed. A gap bends evenly: leave it out.")
        return self

    @property
    def bent_length(self) -> float:
        """Length that bends [m]: the gap, or length / (pi ratio^2) of a layer as printed."""
        if self.gap is not None:
            return self.gap
        assert self.as_printed is not None
        return self.as_printed / (math.pi * self.ratio**2)

    @property
    def bent_thickness(self) -> float:
        """Thickness [m], as given or as it follows from the stiffness."""
        if self.thickness is not None:
            return self.thickness
        assert self.stiffness is not None
        return (12 * self.stiffness * self.bent_length / (self.young * self.width)) ** (1 / 3)

    @property
    def spring(self) -> float:
        """Stiffness of the hinge [N m/rad]."""
        if self.stiffness is not None:
            return self.stiffness
        return self.young * self.width * self.bent_thickness**3 / (12 * self.bent_length)


class ServoLimits(Described):
    """What a servo can give at most: no motion is changed by it, but it is told."""

    torque: fields.PositiveTorque
    """Largest torque of the servo."""
    speed: fields.PositiveAngularSpeed
    """Largest speed of the servo."""


class _AxialJoint(JointDescription, Generic[Q, S, K, C]):
    """What a hinge and a slide share."""

    axis: Axis
    """Direction of the axis, in the frame where the part sits: x, y, z or three numbers."""
    position: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Coordinate at the start."""
    velocity: S = 0.0  # pyright: ignore[reportAssignmentType]
    """Rate of the coordinate at the start."""
    stiffness: K = 0.0  # pyright: ignore[reportAssignmentType]
    """Stiffness of the spring."""
    damping: C = 0.0  # pyright: ignore[reportAssignmentType]
    """Damping of the joint, against its rate."""
    rest: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Coordinate at which the spring is at ease."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        servo, motor, drive = getattr(self, "servo", None), getattr(self, "motor", None), self.drive_field
        if getattr(self, drive) is not None:
            if servo is not None:
                why = f"a servo follows a motion; it cannot have a {drive} as well. Leave one of them out."
                raise wrong(drive, why)
            if motor is not None:
                raise wrong(drive, "a joint with a motor is moved by its voltage. Leave one of the two out.")
        check_drive(self, "joint", slides=isinstance(self, PrismaticJoint))
        lower, upper = getattr(self, "lower", None), getattr(self, "upper", None)
        if lower is not None and upper is not None and not lower.at < upper.at:
            raise wrong("upper.at", "must be above the lower stop.")
        return self


class RevoluteJoint(_AxialJoint[fields.Angle, fields.AngularSpeed, fields.AngularStiffness, fields.AngularDamping]):
    """A hinge about an axis: spring and damper, stops, and either a prescribed motion, a torque, or neither."""

    kind: Literal["revolute"]
    friction: fields.NonNegativeTorque = 0.0
    """Dry friction: it holds what is less, and brakes by this torque at any speed. `static` leaves it out."""
    flexure: Flexure | None = None
    """A flexible strip whose stiffness the spring has, instead of a stiffness."""
    lower: AngularLimit | None = None
    """Stop at the smallest angle."""
    upper: AngularLimit | None = None
    """Stop at the largest angle."""
    motion: AngleSignal | None = None
    """Angle over time that the joint is made to take: by an ideal drive, or as a servo can."""
    servo: AngularServo | None = None
    """The servo that follows the motion, with its motor and its supply; without one the motion is ideal."""
    motor: AnyMotor | None = None
    """A motor that turns the joint by a voltage, instead of a motion."""
    torque: TorqueSignal | None = None
    """Torque over time that drives the joint, instead of a motion."""
    limits: ServoLimits | None = None
    """What the servo that makes an ideal motion can give. Results compare with it."""
    mirror = Mirror(axis=about)
    drive_field = "torque"
    coordinate = "angle"
    decided_by = JointDescription.decided_by | {"stiffness": "flexure"}

    @model_validator(mode="after")
    def _once(self) -> Self:
        if self.flexure is not None and self.stiffness != 0:
            raise wrong("stiffness", "follows from the flexure. Leave one of the two out.")
        if self.limits is not None and self.motion is None:
            raise wrong("limits", "are those of a servo, but there is no motion that it makes. Leave them out.")
        if self.limits is not None and self.servo is not None:
            raise wrong("limits", "follow from the servo. Leave one of the two out.")
        return self


class PrismaticJoint(_AxialJoint[fields.Coordinate, fields.Speed, fields.Stiffness, fields.Damping]):
    """A slide along an axis: spring and damper, stops, and either a prescribed motion, a force, or neither."""

    kind: Literal["prismatic"]
    friction: fields.NonNegativeForce = 0.0
    """Dry friction: it holds what is less, and brakes by this force at any speed. `static` leaves it out."""
    lower: LinearLimit | None = None
    """Stop at the smallest displacement."""
    upper: LinearLimit | None = None
    """Stop at the largest displacement."""
    motion: LengthSignal | None = None
    """Displacement over time that the joint is made to take: by an ideal drive, or as a servo can."""
    servo: LinearServo | None = None
    """The servo that follows the motion, with its motor and its supply; without one the motion is ideal."""
    motor: AnyMotor | None = None
    """A motor that moves the joint by a voltage, instead of a motion."""
    force: ForceSignal | None = None
    """Force over time that drives the joint, instead of a motion."""
    mirror = Mirror(axis=along)
    drive_field = "force"
    coordinate = "position"


class PlanarMotion(Described):
    """Where a planar joint is made to go."""

    x: LengthSignal | None = None
    """Place along x in the plane over time."""
    y: LengthSignal | None = None
    """Place along y in the plane over time."""
    angle: AngleSignal | None = None
    """Angle about the axis over time."""


class PlanarDrive(Described):
    """Forces and the torque that drive a planar joint."""

    x: ForceSignal | None = None
    """Force along the moving part's own x over time."""
    y: ForceSignal | None = None
    """Force along the moving part's own y over time."""
    angle: TorqueSignal | None = None
    """Torque about the axis over time."""


class PlanarStart(Described):
    """Where a planar joint starts, and how fast. All vectors lie in the plane."""

    position: Position = ZERO
    """Place at the start, in the plane."""
    angle: fields.Angle = 0.0
    """Angle about the axis at the start."""
    velocity: Velocity = ZERO
    """Velocity at the start, in the plane, in the moving part's own frame."""
    angular_speed: fields.AngularSpeed = 0.0
    """Angular speed about the axis at the start."""


class PlanarJoint(JointDescription):
    """Moves in the plane normal to `axis`: two translations and the rotation about the axis."""

    kind: Literal["planar"]
    axis: Axis
    """Direction normal to the plane: x, y, z or three numbers."""
    start: PlanarStart = PlanarStart()
    """Where the part is at the start, and how fast it moves."""
    motion: PlanarMotion | None = None
    """Where the part is made to go, instead of a drive."""
    drive: PlanarDrive | None = None
    """Forces and torque that drive the part, instead of a motion."""
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
    """How a spherical joint is made to turn."""

    roll: AngleSignal | None = None
    """Angle about x over time."""
    pitch: AngleSignal | None = None
    """Angle about y over time."""
    yaw: AngleSignal | None = None
    """Angle about z over time."""


class SphericalDrive(Described):
    """Torques that drive a spherical joint."""

    x: TorqueSignal | None = None
    """Torque about the moving part's own x over time."""
    y: TorqueSignal | None = None
    """Torque about the moving part's own y over time."""
    z: TorqueSignal | None = None
    """Torque about the moving part's own z over time."""


class SphericalStart(Described):
    """Where a spherical joint starts, and how fast."""

    orientation: Rotation = ZERO
    """Roll, pitch and yaw at the start."""
    angular_velocity: AngularVelocity = ZERO
    """Angular velocity at the start, in the moving part's own frame."""


class SphericalJoint(JointDescription):
    """Turns freely in all three directions."""

    kind: Literal["spherical"]
    stiffness: fields.AngularStiffness = 0.0
    """Stiffness of the spring, the same in all directions."""
    damping: fields.AngularDamping = 0.0
    """Damping of the joint, the same in all directions."""
    start: SphericalStart = SphericalStart()
    """How the part is turned at the start, and how fast it turns."""
    motion: SphericalMotion | None = None
    """How the part is made to turn, instead of a drive."""
    drive: SphericalDrive | None = None
    """Torques that drive the part, instead of a motion."""
    mirror = Mirror(
        start=Mirror(orientation=about, angular_velocity=about),
        motion=Mirror(roll=opposite, yaw=opposite),
        drive=Mirror(x=opposite, z=opposite),
    )


class FreeMotion(Described):
    """Where a free part is made to go: a moving base."""

    x: LengthSignal | None = None
    """Place along x over time."""
    y: LengthSignal | None = None
    """Place along y over time."""
    z: LengthSignal | None = None
    """Place along z over time."""
    roll: AngleSignal | None = None
    """Angle about x over time."""
    pitch: AngleSignal | None = None
    """Angle about y over time."""
    yaw: AngleSignal | None = None
    """Angle about z over time."""


class FreeDrive(Described):
    """Torques about and forces along the moving part's own axes: thrusters."""

    torque_x: TorqueSignal | None = None
    """Torque about the moving part's own x over time."""
    torque_y: TorqueSignal | None = None
    """Torque about the moving part's own y over time."""
    torque_z: TorqueSignal | None = None
    """Torque about the moving part's own z over time."""
    force_x: ForceSignal | None = None
    """Force along the moving part's own x over time."""
    force_y: ForceSignal | None = None
    """Force along the moving part's own y over time."""
    force_z: ForceSignal | None = None
    """Force along the moving part's own z over time."""


class FreeStart(Described):
    """Where a free part starts, and how fast."""

    position: Position = ZERO
    """Place at the start."""
    orientation: Rotation = ZERO
    """Roll, pitch and yaw at the start."""
    velocity: Velocity = ZERO
    """Velocity at the start, in the moving part's own frame."""
    angular_velocity: AngularVelocity = ZERO
    """Angular velocity at the start, in the moving part's own frame."""


class FreeJoint(JointDescription):
    """Moves and turns freely."""

    kind: Literal["free"]
    start: FreeStart = FreeStart()
    """Where the part is at the start, and how fast it moves."""
    motion: FreeMotion | None = None
    """Where the part is made to go, instead of a drive."""
    drive: FreeDrive | None = None
    """Forces and torques that drive the part, instead of a motion."""
    mirror = Mirror(
        start=Mirror(position=along, orientation=about, velocity=along, angular_velocity=about),
        motion=Mirror(y=opposite, roll=opposite, yaw=opposite),
        drive=Mirror(torque_x=opposite, torque_z=opposite, force_y=opposite),
    )
