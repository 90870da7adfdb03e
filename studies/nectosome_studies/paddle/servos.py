"""The rowing robot on its servos, as it ships: how the XW540-T140 at the battery's 11.1 V follows its strokes.

Torque and speed are its maker's (6.4 N m, 67 rpm). Assumptions: full voltage from an error of 12.5 deg on, and
0.003 kg m2 of rotor and gears at the output. Speeds are means over ten seconds from rest, as in the paper's pool. The
hull's drag area is fitted anew, on the same printed speed; as the robot ships, it is that of its shape.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from nectosome.core import Status
from nectosome.description import RobotDescription, get_value, with_values
from nectosome.model import build
from nectosome.robots import beetle
from nectosome.solve import simulate

from .swim import SPEEDS, Swim, drag_coefficient, on_a_slide, strokes

_SECONDS, _SAMPLES, _RTOL = 10.0, 201, 1e-5
_FITTED: Swim = (3, math.radians(75), 1.1)
READINGS = (1.2, 1.3)  # Hz: between them 30 deg gives the speeds that are printed for 0.3 Hz
SWIMS: tuple[Swim, ...] = (*SPEEDS, *((n, math.radians(30), f) for f in READINGS for n in (3, 1)))


def ten_seconds(robot: RobotDescription, amplitude: float, frequency: float, drag_area: float) -> xr.Dataset:
    """Ten seconds from rest of the robot on servos, on a slide. Raises RuntimeError where the simulation fails."""
    values = {"A": amplitude, "f": frequency, "drag_area": drag_area, "Cn": 4.0}
    run = simulate(build(with_values(robot, values)), _SECONDS, samples=_SAMPLES, rtol=_RTOL)
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"swim on servos, {robot.name}, {values}: {Status(int(run.status)).reason}")
    return run.to_dataset()


def mean_speed(run: xr.Dataset) -> float:
    """Way along the slide over the time [m/s]."""
    return float(run["q"][-1, 0] - run["q"][0, 0]) / float(run["time"][-1])


def fitted_drag_area() -> float:
    """Drag area of the hull along x [m2] at which the robot with three joints swims at the printed 0.323 m/s."""
    joints, amplitude, frequency = _FITTED
    robot = on_a_slide(beetle(joints))

    def surplus(area: float) -> float:
        return mean_speed(ten_seconds(robot, amplitude, frequency, area)) - SPEEDS[_FITTED]

    return float(np.asarray(brentq(surplus, 0.004, 0.03, xtol=1e-6)))


def swims_on_servos(area: float) -> xr.Dataset:
    """Speeds of Table 5, and of its 30 deg at 1.2 and 1.3 Hz, with largest errors [rad] and torques of a servo [N m].

    The hull's drag area [m2] is given; `coefficient` is that over its frontal area [-].
    """
    robots = {joints: on_a_slide(beetle(joints)) for joints in (1, 3)}
    runs = [ten_seconds(robots[n], amplitude, frequency, area) for n, amplitude, frequency in SWIMS]
    return xr.Dataset(
        {
            "speed": ("row", [*map(mean_speed, runs)], {"units": "m/s"}),
            "tracking_error": ("row", [float(np.abs(run["tracking_error"]).max()) for run in runs], {"units": "rad"}),
            "torque": ("row", [0.25 * float(np.abs(run["motor_torque"]).max()) for run in runs], {"units": "N m"}),
        },
        coords=strokes(SWIMS),
        attrs={"drag_area": area, "coefficient": drag_coefficient(area)},
    )


def as_shipped() -> dict[str, float]:
    """Speeds of the robots that ship, in the paper's fastest stroke, by scorecard row: nothing is fitted."""
    _, amplitude, frequency = _FITTED
    stroke = f"{math.degrees(amplitude):.0f}-{frequency}"
    return {
        f"paddle/shipped/fp{n}jp/{stroke}/speed": mean_speed(
            ten_seconds(on_a_slide(robot), amplitude, frequency, float(get_value(robot, "drag_area")))
        )
        for n, robot in ((n, beetle(n)) for n in (3, 1))
    }


def numbers(found: xr.Dataset) -> Mapping[str, float]:
    """By scorecard row: what is fitted, speeds of Table 5, and at which frequency 30 deg gives those printed there."""
    speed = dict(zip(SWIMS, found["speed"].values.tolist(), strict=True))
    rows = {f"paddle/servo/fp{n}jp/{math.degrees(a):.0f}-{f}/speed": speed[n, a, f] for n, a, f in SPEEDS}
    area, coefficient = (f"paddle/servo/drag-{what}" for what in ("area", "coefficient"))
    rows |= {area: found.attrs["drag_area"], coefficient: found.attrs["coefficient"]}
    for n in (1, 3):
        slow, fast = (speed[n, math.radians(30), f] for f in READINGS)
        share = (SPEEDS[n, math.radians(30), 0.3] - slow) / (fast - slow)
        rows[f"paddle/misprint/frequency-fp{n}jp"] = READINGS[0] + share * (READINGS[1] - READINGS[0])
    return rows
