"""Names of rows of forces and powers in results that the program makes itself: no load, pair or tendon has them."""

from nectosome.io.schema.described import wrong

ADDED_MASS, SHAPE_CHANGE, SLAMMING = "added_mass", "shape_change", "slamming"
VISCOUS, DRIVE = "viscous", "drive"
WEIGHT, BUOYANCY, SPRING, DAMPER, STOP = "weight", "buoyancy", "spring", "damper", "stop"
JOINT_FRICTION = "joint_friction"
MEMBRANE = "membrane"
OWN_ROWS = {
    ADDED_MASS: "water that is carried along",
    SHAPE_CHANGE: "loads that change a body's shape",
    SLAMMING: "water that a body meets at the surface",
    VISCOUS: "damping of rods",
    DRIVE: "driven joints and motors",
    WEIGHT: "weight",
    BUOYANCY: "buoyancy",
    SPRING: "springs of joints",
    DAMPER: "dampers of joints",
    STOP: "stops of joints",
    JOINT_FRICTION: "dry friction of joints",
    MEMBRANE: "tension of webs",
}
"""What each is of."""


def check_row(field: str, name: str, kind: str = "") -> None:
    """Raise ValueError where the row of a load, pair or tendon would mix with one of these.

    Added mass alone, by its `kind`, has no row of its own: it may be called added_mass.
    """
    if name in OWN_ROWS and not (name == ADDED_MASS and kind.endswith(ADDED_MASS)):
        why = f'"{name}" is the row of {OWN_ROWS[name]} in results, which would mix with it. Choose another name.'
        raise wrong(f"{field}.{name}", why)
