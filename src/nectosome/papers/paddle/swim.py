"""Straight swimming of the rowing robot (section 6.2): the drag area that one printed speed asks for, and all others.

In straight swimming all four paddles do the same, so that one with the mass, stiffness and drag of four on a hull that
slides along x swims as the robot does.
"""

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.optimize import brentq

from nectosome.core import Status
from nectosome.description import PrismaticJoint, RobotDescription, get_value, numeric_paths, with_values
from nectosome.model import build
from nectosome.robots import beetle
from nectosome.robots.beetle import PADDLES
from nectosome.solve import periodic

from ..study import printed

Swim = tuple[int, float, float]  # joints a paddle, amplitude [rad], frequency [Hz]


def _table5(unit: str) -> dict[Swim, float]:
    """What Table 5 prints in this unit."""
    return {
        (swim["joints"], math.radians(swim["amplitude"]), swim["frequency"]): entry["printed"]
        for entry in printed("paddle").values()
        if entry["unit"] == unit and (swim := entry.get("swim"))
    }


SPEEDS = _table5("m/s")
YAWS = _table5("deg")  # averages; none where the table repeats that of another robot
_FOUR = ("mass", "drag.normal", "flexure.young", "lower.stiffness", "lower.damping")


def on_a_slide(robot: RobotDescription) -> RobotDescription:
    """The robot's hull on a slide along x, with its first paddle four times as heavy, stiff and wide as it is."""
    first = PADDLES[0]
    limbs = {name: limb for name, limb in robot.limbs.items() if name.startswith(first)}
    aliases = {
        name: tuple(path for path in paths if path.startswith(("body.", f"limbs.{first}_")))
        for name, paths in robot.aliases.items()
    }
    body = robot.parts["body"].model_copy(update={"joint": PrismaticJoint(kind="prismatic", axis=(1.0, 0.0, 0.0))})
    one = robot.model_copy(
        update={"body": body, "limbs": limbs, "aliases": {name: paths for name, paths in aliases.items() if paths}}
    )
    fourfold = [path for path in numeric_paths(one) if path.startswith("limbs.") and path.endswith(_FOUR)]
    return with_values(one, {path: 4 * get_value(one, path) for path in fourfold})


def hull_centre(robot: RobotDescription, q: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "2 n"]:
    """Place [m] of the centre of the planar robot's hull, whose joint is at its stern: x, y, yaw in, x, y out."""
    x, y, yaw = q.T
    return np.stack([x, y]) + 0.5 * float(get_value(robot, "body.length")) * np.stack([np.cos(yaw), np.sin(yaw)])


def straight_speed(joints: int, amplitude: float, frequency: float, drag_area: float, cn: float = 1.0) -> float:
    """Mean speed over a cycle [m/s]: joints a paddle, stroke [rad, Hz], the hull's drag area [m2], the blades' Cn.

    Raises RuntimeError where no cycle is found.
    """
    values = {"A": amplitude, "f": frequency, "drag_area": drag_area, "Cn": 4 * cn}
    found = periodic(build(with_values(on_a_slide(beetle(joints)), values)), 1 / frequency)
    status = Status(int(found.status))
    if status not in (Status.SOLVED, Status.SETTLED):
        raise RuntimeError(f"straight swim, {joints} joints, {values}: {status.reason}")
    first, *_, last = np.asarray(found.value.state.q)[:, 0]
    return float(last - first) * frequency


def calibrated_drag_area() -> float:
    """Drag area of the hull along x [m2] at which the robot with three joints swims at the printed 0.323 m/s."""
    (joints, amplitude, frequency), target = next(iter(SPEEDS.items()))
    found = brentq(lambda area: straight_speed(joints, amplitude, frequency, area) - target, 0.01, 0.03, xtol=1e-7)
    return float(np.asarray(found))


def table5(drag_area: float) -> xr.Dataset:
    """Speeds of Table 5, printed and ours [m/s]: the first row is the calibration, the others are predictions."""
    ours = [straight_speed(*row, drag_area) for row in SPEEDS]
    speeds = [*SPEEDS.values()]
    return xr.Dataset(
        {
            "ours": ("row", ours, {"units": "m/s"}),
            "printed": ("row", speeds, {"units": "m/s"}),
            "error": ("row", 100 * (np.divide(ours, speeds) - 1), {"units": "percent"}),
            "kind": ("row", ["calibration"] + ["prediction"] * (len(ours) - 1)),
        },
        coords=strokes(SPEEDS),
        attrs={"drag_area": drag_area},
    )


def strokes(swims: Iterable[Swim]) -> dict[str, tuple]:
    """Coordinates of swims, one a row."""
    joints, amplitude, frequency = (list(x) for x in zip(*swims, strict=True))
    return {
        "joints": ("row", joints),
        "amplitude": ("row", amplitude, {"units": "rad"}),
        "frequency": ("row", frequency, {"units": "Hz"}),
    }


def curves(drag_area: float, frequencies: Iterable[float] = np.linspace(0.3, 1.3, 11)) -> xr.Dataset:
    """Speed against frequency for one and three joints, at 30 and 75 deg (Fig. 10b) [m/s]."""
    joints, amplitudes, frequencies = [1, 3], np.radians([30.0, 75.0]), list(frequencies)
    speed = [[[straight_speed(n, a, f, drag_area) for f in frequencies] for a in amplitudes] for n in joints]
    return xr.Dataset(
        {"speed": (("joints", "amplitude", "frequency"), speed, {"units": "m/s"})},
        coords={
            "joints": joints,
            "amplitude": ("amplitude", amplitudes, {"units": "rad"}),
            "frequency": ("frequency", frequencies, {"units": "Hz"}),
        },
    )
