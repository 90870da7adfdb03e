"""Names of rows of forces and powers in results that the program makes itself: no load, pair or tendon has them."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from nectosome.io.schema.described import wrong

if TYPE_CHECKING:
    from nectosome.description.robot import RobotDescription

ADDED_MASS, SHAPE_CHANGE, VISCOUS, DRIVE = "added_mass", "shape_change", "viscous", "drive"
WEIGHT, BUOYANCY, SPRING, DAMPER, STOP = "weight", "buoyancy", "spring", "damper", "stop"
OWN_ROWS = {
    ADDED_MASS: "water that is carried along",
    SHAPE_CHANGE: "loads that change a body's shape",
    VISCOUS: "damping of rods",
    DRIVE: "driven joints and motors",
    WEIGHT: "weight",
    BUOYANCY: "buoyancy",
    SPRING: "springs of joints",
    DAMPER: "dampers of joints",
    STOP: "stops of joints",
}
"""What each is of."""


def check_rows(robot: "RobotDescription") -> None:
    """Raise ValueError at a load, pair or tendon whose row would mix with one of these.

    Added mass alone has no row of its own: it may be called added_mass.
    """
    for field, name in _named(robot):
        if name in OWN_ROWS:
            why = f'"{name}" is the row of {OWN_ROWS[name]} in results, which would mix with it. Choose another name.'
            raise wrong(field, why)


def _named(robot: "RobotDescription") -> Iterator[tuple[str, str]]:
    """Field and name of all that has a row of its own."""
    for part, limb in robot.parts.items():
        for name, load in limb.loads.items():
            if name != ADDED_MASS or not load.kind.endswith(ADDED_MASS):
                yield f"{robot.place_of(part)}.loads.{name}", name
    for what in ("pairs", "tendons"):
        yield from ((f"{what}.{name}", name) for name in getattr(robot, what))
