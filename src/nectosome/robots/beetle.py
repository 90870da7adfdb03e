"""Rowing paddles of any number of segments, and the robot like a diving beetle: four of them on one hull."""

import math
from functools import cache

from nectosome.description import FixedJoint, FreeJoint, PlanarJoint, Rigid, RobotDescription, load_robot
from nectosome.description.drives import AngularServo, BatteryDescription
from nectosome.description.loads import LumpedDragLoad, SpheroidAddedMassLoad
from nectosome.units import InputError

from .shipped import file_of

_ABOUT = (
    "The rowing robot of Hu et al. 2024, section 5.2: a hull with four paddles (see `paddle`) cut into {joints} "
    "segments, two a side and mirrored; it swims forward along +x, {freedom}. 2.5 kg in all, paddles and rods "
    "included. Printed: mass, length, height, a width of 529 mm with the paddles stretched out, the servos' name, and "
    "the battery's voltage and capacity. Torque, speed and currents of the servos (XW540-T140-R at 11.1 V; 40 mA in "
    "standby) are their maker's. The stroke is that of the fastest swim that is printed, 75 deg at 1.1 Hz: it asks for "
    "86 rpm of servos that make 67, so that they lag behind by up to 30 deg, at full voltage. Nothing is fitted. "
    "Assumptions, printed nowhere: full voltage from an error of 12.5 deg on, 0.003 kg m2 of rotor and gears at the "
    "output of a servo, and a battery without resistance that feeds nothing else; along x the hull drags as a round "
    "cylinder with flat ends, 0.82 of its frontal area (Hoerner 1965, ch. 3), since the sealed compartment is one, as "
    "wide as the robot is high: a round nose has 0.2, and mounts and rods are not counted; the hull is a spheroid of "
    "that length and height, for its inertia and its added mass (Lamb 1932); across it feels the drag of round "
    "cylinders, strip by strip, with a coefficient of 1.1 (Hoerner 1965, ch. 3); the paddles sit at a quarter and at "
    "three quarters of its length; each part displaces its own weight of water, so that weight and buoyancy are left "
    "out; paddles and hull do not disturb each other's water, and parts do not touch. Nothing holds its course: a "
    "disturbance of its heading grows by 15 to 21 % in each stroke."
)
_ALL_SIX = "free in all six directions (nothing rights it: as it swims its pitch is unstable, by the added mass)"
_LENGTH, _HEIGHT, _MASS = 0.426, 0.110, 2.5  # m, m, kg
_AHEAD, _ACROSS = 0.82, 1.1  # drag coefficients of a round cylinder: along it with flat ends, across it
PADDLES = ("left1", "right1", "left2", "right2")  # the first pair is in front


def beetle(joints: int = 3) -> RobotDescription:
    """Robot with so many flexible joints in each of its four paddles, free in the plane z = 0.

    Limbs left1_arm, left1_segment1, ..., right2_segment3. Raises InputError for a count outside 1..5.
    """
    free = PlanarJoint(kind="planar", axis="z")  # pyright: ignore[reportArgumentType]
    return _beetle("beetle", joints, free, "free in the plane")


def beetle_free(joints: int = 3) -> RobotDescription:
    """Robot of `beetle`, free in all six directions. Raises InputError as it does."""
    return _beetle("beetle_free", joints, FreeJoint(kind="free"), _ALL_SIX)


@cache
def _battery() -> BatteryDescription:
    return BatteryDescription.model_validate({"voltage": "11.1 V", "capacity": "7000 mAh", "idle_power": "1.776 W"})


@cache
def _servo() -> AngularServo:
    """XW540-T140-R."""
    return AngularServo.model_validate(
        {
            "rated_voltage": "11.1 V",
            "stall_torque": "6.4 N m",
            "no_load_speed": "67 rpm",
            "stall_current": "4.5 A",
            "inertia": "0.003 kg m2",
            "battery": "pack",
            "full_voltage_at": "12.5 deg",
        }
    )


def _beetle(name: str, joints: int, joint: PlanarJoint | FreeJoint, freedom: str) -> RobotDescription:
    if joints not in range(1, 6):
        raise InputError(f"{name}: {joints} joints a paddle asked for; 1 to 5.")
    one = paddle(joints)
    limbs: dict[str, Rigid] = {}
    for place in PADDLES:
        limbs |= _mounted(one, place)
    hull = _hull(_MASS - sum(limb.mass or 0.0 for limb in limbs.values()), joint)
    return RobotDescription(
        name=f"{name}{joints}",
        about=_ABOUT.format(joints=joints, freedom=freedom),
        water=one.water,
        batteries={"pack": _battery()},
        body=hull,
        limbs={**limbs},
        aliases=_aliases(joints),
    )


def _hull(mass: float, joint: PlanarJoint | FreeJoint) -> Rigid:
    r"""Spheroid of half axes a, b: drag areas across $C \pi a b$, and about y and z $c = \tfrac{4}{15} \rho C b a^4$.

    c is half the density times the integral of C 2 b(x) |x|^3 along the axis, with b(x) = b sqrt(1 - x^2/a^2).
    """
    a, b = 0.5 * _LENGTH, 0.5 * _HEIGHT
    ahead = _AHEAD * math.pi * b**2
    across, turning = _ACROSS * math.pi * a * b, 4 / 15 * 1000.0 * _ACROSS * b * a**4
    return Rigid(
        kind="rigid",
        shape="spheroid",
        length=_LENGTH,
        radius=b,
        mass=mass,
        volume=mass / 1000.0,
        joint=joint,
        loads={
            "drag": LumpedDragLoad(
                kind="lumped_drag", drag_area=(ahead, across, across), rotational=(0.0, turning, turning)
            ),
            "added_mass": SpheroidAddedMassLoad(kind="spheroid_added_mass"),
        },
    )


def _mounted(one: RobotDescription, place: str) -> dict[str, Rigid]:
    """Arm and segments of a paddle at its place: a left one points to +y, a right one is its mirror image."""
    left, front = place.startswith("left"), place.endswith("1")
    out: dict[str, Rigid] = {}
    for name, part in one.limbs.items():
        assert isinstance(part, Rigid)
        assert part.mass is not None
        update: dict[str, object] = {"on": f"{place}_{part.on}", "volume": part.mass / 1000.0}
        if name == "arm":
            side = 1.0 if left else -1.0
            offset = ((0.75 if front else 0.25) * _LENGTH, side * 0.5 * _HEIGHT, 0.0)
            rotation = (0.0 if left else math.pi, 0.0, side * 0.5 * math.pi)
            joint = part.joint.model_copy(update={"servo": _servo(), "limits": None})
            update |= {"on": "body", "at": "root", "offset": offset, "rotation": rotation, "joint": joint}
        out[f"{place}_{name}"] = part.model_copy(update=update)
    return out


def _aliases(joints: int) -> dict[str, tuple[str, ...]]:
    motion = {place: f"limbs.{place}_arm.joint.motion" for place in PADDLES}
    left, right = PADDLES[::2], PADDLES[1::2]
    return {
        "A": tuple(f"{motion[place]}.amplitude" for place in PADDLES),
        "A_left": tuple(f"{motion[place]}.amplitude" for place in left),
        "A_right": tuple(f"{motion[place]}.amplitude" for place in right),
        "f": tuple(f"{motion[place]}.frequency" for place in PADDLES),
        "Cn": tuple(f"limbs.{place}_segment{k + 1}.loads.drag.normal" for place in PADDLES for k in range(joints)),
        "drag_area": ("body.loads.drag.drag_area.0",),
        **{f"phase_{place}": (f"{motion[place]}.phase",) for place in PADDLES},
    }


def paddle(segments: int) -> RobotDescription:
    """Paddle cut into so many equal segments, each on a flexible passive joint; 0: a rigid plate of the same size.

    Segments share length and mass of the whole paddle; all joints have the same flexure. Raises InputError for a count
    outside 0..5.
    """
    if segments not in range(6):
        raise InputError(f"paddle: {segments} segments asked for; 1 to 5, or 0 for a rigid plate.")
    three = load_robot(file_of("paddle"))
    parts = [part for name, part in three.limbs.items() if name != "arm"]
    first, count = parts[0], max(segments, 1)
    assert isinstance(first, Rigid)
    assert first.length is not None
    assert first.mass is not None
    length, share = first.length * len(parts) / count, len(parts) / count
    joint = first.joint if segments else FixedJoint(kind="fixed")
    same = {"length": length, "mass": first.mass * share, "centre_of_mass": (0.5 * length, 0.0, 0.0), "joint": joint}
    names = [f"segment{k + 1}" for k in range(count)]
    limbs = {"arm": three.limbs["arm"]}
    for on, name in zip(["arm", *names], names, strict=False):
        limbs[name] = first.model_copy(update={**same, "on": on})
    aliases = {**three.aliases, "Cn": tuple(f"limbs.{name}.loads.drag.normal" for name in names)}
    with_joints = "with three flexible passive joints"
    about = three.about.replace(with_joints, f"cut into {segments} segments" if segments else "in one rigid piece")
    return three.model_copy(update={"name": f"paddle{segments}", "about": about, "limbs": limbs, "aliases": aliases})
