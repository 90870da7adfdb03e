"""The best printed design in water by published laws, beside that of the paper: one piece exchanged, then all.

The hull is a flat-faced cylinder along the flow, about as long as wide: 0.90 of its frontal area (White, Fluid
Mechanics, table 7.3; Hoerner 1965, ch. 3), where the toolbox's example has 2.5. Added mass of a round section is that
of potential flow, 1 (the toolbox: 0.6): the filament turns about its axis as one shape, bent by less than one wave over
its length, which is 30 diameters and more, so that a `wavelength` would take away less than 2 %. A round section has no
lift across (the toolbox: -0.1). Friction along hook and filament is laminar, thinned by the flow across.
"""

import math

from nectosome.description import RobotDescription, apply_settings, get_value, with_values
from nectosome.robots import describe

from .steady_swims import Swimmer

_PARTS = ("hook", "filament")
_ALONG = 0.9  # drag of the hull over its frontal area


def numbers() -> dict[str, float]:
    """Steady speed by scorecard row, and the torque in both waters."""
    robot, rows = describe("flagellum"), {}
    swims = {name: Swimmer(_in_water(robot, (name,))).swim() for name in _PIECES}
    swims = {"paper": Swimmer(robot).swim(), **swims, "all": Swimmer(_in_water(robot, tuple(_PIECES))).swim()}
    for name, swim in swims.items():
        rows[f"flagellum/better-water/{name}/speed"] = swim.speed
    return rows | {f"flagellum/better-water/{name}/torque": swims[name].torque for name in ("paper", "all")}


def _hull(robot: RobotDescription) -> RobotDescription:
    area = _ALONG * math.pi * get_value(robot, "body.radius") ** 2
    return with_values(robot, {"body.loads.hull_drag.drag_area.0": area})


def _added_mass(robot: RobotDescription) -> RobotDescription:
    return apply_settings(robot, [f"limbs.{part}.loads.added_mass.normal=1" for part in _PARTS])


def _no_lift(robot: RobotDescription) -> RobotDescription:
    return apply_settings(robot, [f"limbs.{part}.loads.drag.lift=0" for part in _PARTS])


def _friction(robot: RobotDescription) -> RobotDescription:
    return apply_settings(robot, [f"limbs.{part}.loads.skin={{kind: skin_friction}}" for part in _PARTS])


_PIECES = {"hull": _hull, "added-mass": _added_mass, "no-lift": _no_lift, "friction": _friction}


def _in_water(robot: RobotDescription, pieces: tuple[str, ...]) -> RobotDescription:
    for name in pieces:
        robot = _PIECES[name](robot)
    return robot
