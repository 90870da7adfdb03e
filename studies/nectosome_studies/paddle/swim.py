"""Straight swimming of the rowing robot (section 6.2): the drag area that one printed speed asks for, and all others.

In straight swimming all four paddles do the same, so that one with the mass, stiffness and drag of four on a hull that
slides along x swims as the robot does. Its drives are ideal here, as in the paper's model; `servos.py` has the robot on
the servos that it ships with.

The printed speed drops above 1.1 Hz (section 6.2). The model has no such drop: its thrust grows on, as that of the
paper's model does. A factor on Cn that falls with the frequency, an empirical layer that is off unless a slope is
given, stands for whatever it was; one printed speed says how steeply. (One candidate: at 75 deg the servo would have to
turn faster than its 67 rev/min without load at 11.1 V, the battery's voltage, from 0.85 Hz on; XW540-T140.)
"""

import math
from collections.abc import Iterable, Sequence

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
    """Numbers of Table 5 in this unit."""
    return {
        (swim["joints"], math.radians(swim["amplitude"]), swim["frequency"]): entry["printed"]
        for entry in printed("paddle").values()
        if entry["unit"] == unit and (swim := entry.get("swim"))
    }


SPEEDS = _table5("m/s")
YAWS = _table5("deg")  # averages; none where the table repeats that of another robot
_PEAK = 1.1  # Hz
_FOUR = (
    *("mass", "drag.normal", "water.normal", "flexure.young", "lower.stiffness", "lower.damping"),
    *(f"servo.{what}" for what in ("stall_torque", "stall_current", "inertia")),
)


def with_ideal_drives(robot: RobotDescription) -> RobotDescription:
    """The robot without its servos: its arms take their strokes, whatever torque and speed that needs."""
    limbs = {
        name: limb.model_copy(update={"joint": limb.joint.model_copy(update={"servo": None})})
        if getattr(limb.joint, "servo", None) is not None
        else limb
        for name, limb in robot.limbs.items()
    }
    return robot.model_copy(update={"limbs": limbs, "batteries": {}})


def on_a_slide(robot: RobotDescription) -> RobotDescription:
    """The robot's hull on a slide along x, with a first paddle of the mass, stiffness, width and servo of four."""
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
    return slide_speed(on_a_slide(with_ideal_drives(beetle(joints))), amplitude, frequency, drag_area, cn)


def slide_speed(
    robot: RobotDescription, amplitude: float, frequency: float, drag_area: float, cn: float = 1.0
) -> float:
    """The same of a robot `on_a_slide`."""
    values = {"A": amplitude, "f": frequency, "drag_area": drag_area, "Cn": 4 * cn}
    found = periodic(build(with_values(robot, values)), 1 / frequency)
    status = Status(int(found.status))
    if status not in (Status.SOLVED, Status.SETTLED):
        raise RuntimeError(f"straight swim, {robot.name}, {values}: {status.reason}")
    first, *_, last = np.asarray(found.value.state.q)[:, 0]
    return float(last - first) * frequency


def calibrated_drag_area() -> float:
    """Drag area of the hull along x [m2] at which the robot with three joints swims at the printed 0.323 m/s."""
    (joints, amplitude, frequency), target = next(iter(SPEEDS.items()))
    found = brentq(lambda area: straight_speed(joints, amplitude, frequency, area) - target, 0.01, 0.03, xtol=1e-7)
    return float(np.asarray(found))


def table5(drag_area: float) -> xr.Dataset:
    """Speeds of Table 5, printed and ours [m/s]: the first row is the calibration, the others are predictions.

    Attributes: `drag_area` [m2], its `coefficient` [-] on the hull's frontal area, `drop_slope` [1/Hz].
    """
    ours = [straight_speed(*row, drag_area) for row in SPEEDS]
    speeds = [*SPEEDS.values()]
    fitted = {"drag_area": drag_area, "coefficient": drag_coefficient(drag_area)}
    return xr.Dataset(
        {
            "ours": ("row", ours, {"units": "m/s"}),
            "printed": ("row", speeds, {"units": "m/s"}),
            "error": ("row", 100 * (np.divide(ours, speeds) - 1), {"units": "percent"}),
            "kind": ("row", ["calibration"] + ["prediction"] * (len(ours) - 1)),
        },
        coords=strokes(SPEEDS),
        attrs=fitted | {"drop_slope": calibrated_slope(drag_area)},
    )


def drag_coefficient(drag_area: float) -> float:
    """A drag area of the hull along x [m2] over its frontal area."""
    return drag_area / (math.pi * float(get_value(beetle(3), "body.radius")) ** 2)


def strokes(swims: Iterable[Swim]) -> dict[str, tuple]:
    """Coordinates of swims, one a row."""
    joints, amplitude, frequency = (list(x) for x in zip(*swims, strict=True))
    return {
        "joints": ("row", joints),
        "amplitude": ("row", amplitude, {"units": "rad"}),
        "frequency": ("row", frequency, {"units": "Hz"}),
    }


def drop_factor(frequency: float, slope: float = 0.0) -> float:
    """Factor on Cn at a frequency [Hz]: 1 up to 1.1 Hz, then less by `slope` [1/Hz] a hertz, never below 0."""
    return max(0.0, 1.0 - slope * max(0.0, frequency - _PEAK))


def calibrated_slope(drag_area: float) -> float:
    """Slope [1/Hz] at which the robot with three joints swims at the printed 0.142 m/s at 75 deg and 1.3 Hz."""
    joints, amplitude, frequency = row = (3, math.radians(75), 1.3)

    def surplus(cn: float) -> float:
        return straight_speed(joints, amplitude, frequency, drag_area, cn) - SPEEDS[row]

    cn = float(np.asarray(brentq(surplus, 0.02, 1.0, xtol=1e-6)))
    return (1 - cn) / (frequency - _PEAK)


def curves(drag_area: float, slope: float, frequencies: Sequence[float]) -> xr.Dataset:
    """Speed [m/s] against frequency for one and three joints, at 30 and 75 deg (Fig. 10b).

    `dropped` is that of three joints at 75 deg with a drop of this slope [1/Hz].
    """
    joints, amplitudes = [1, 3], np.radians([30.0, 75.0])
    dropped = [straight_speed(3, math.radians(75), f, drag_area, drop_factor(f, slope)) for f in frequencies]
    speed = [[[straight_speed(n, a, f, drag_area) for f in frequencies] for a in amplitudes] for n in joints]
    return xr.Dataset(
        {
            "speed": (("joints", "amplitude", "frequency"), speed, {"units": "m/s"}),
            "dropped": ("frequency", dropped, {"units": "m/s"}),
        },
        coords={
            "joints": joints,
            "amplitude": ("amplitude", amplitudes, {"units": "rad"}),
            "frequency": ("frequency", frequencies, {"units": "Hz"}),
        },
        attrs={"drop_slope": slope},
    )
