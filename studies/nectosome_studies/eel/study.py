"""The study of the eel: burst and efficient swimming from their curvatures; nothing is fitted."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from nectosome.core import Wave
from nectosome.description import with_values
from nectosome.model import build
from nectosome.robots import describe

from ..study import Progress, StudyPart, printed
from ..undulation import Swims, swims, with_plate_friction

NAME = "eel"
_GAITS = ("burst", "efficient")
_STILL = 3300.0  # Reynolds number of the swim with the friction of a plate
_KNOTS = 21  # of the envelope in the robot's file


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows; there is nothing to shorten."""
    del quick
    progress("swimming", 0.0)
    found = swum()
    burst, efficient = found.speed
    numbers: dict[str, float | None] = {
        f"{NAME}/burst/speed": burst,
        f"{NAME}/efficient/speed": efficient,
        f"{NAME}/burst/gain": 100 * (burst / efficient - 1),
    }
    progress("friction of a plate", 1 / 3)
    numbers[f"{NAME}/change/friction"] = 100 * (swum(plate=_STILL).speed[0] / burst - 1)
    progress("no drag across", 2 / 3)
    without = swum(settings=("body.loads.cross.normal=0",))
    numbers[f"{NAME}/change/cross"] = 100 * (without.speed[0] / burst - 1)
    return StudyPart(numbers)


def swum(plate: float | None = None, settings: tuple[str, ...] = ()) -> Swims:
    """Burst and efficient swimming of the robot `kern_eel`, with the friction of a plate at a Reynolds number."""
    description = describe("kern_eel", settings)
    description = description if plate is None else with_plate_friction(description, plate)
    book, found = printed(NAME), []
    for gait in _GAITS:
        robot = build(with_values(description, _bending(book[f"{NAME}/{gait}/speed"])))
        wave: Wave = robot.tree.parts[0].strain_signals[0]  # pyright: ignore[reportAssignmentType]
        found.append(swims(robot, [wave], np.array([float(robot.water.viscosity)])))
    return Swims(*map(np.concatenate, zip(*found, strict=True)))


def _bending(entry: dict[str, Any]) -> dict[str, float]:
    """Numbers of the robot's wave by path: the natural spline through K at 0, 1/3, 2/3, 1, and a wave of 1/turns L."""
    K = CubicSpline(np.linspace(0, 1, 4), entry["spline"], bc_type="natural")(np.linspace(0, 1, _KNOTS))
    wave = "body.motion.bending_z"
    lengths = dict.fromkeys((f"{wave}.wavelength", "body.loads.water.wavelength"), 1 / float(entry["turns"]))
    return {f"{wave}.envelope.{k}": float(x) for k, x in enumerate(K)} | lengths
