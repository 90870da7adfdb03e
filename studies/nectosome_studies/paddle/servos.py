"""The rowing robot on its servos: how the XW540-T140 at the battery's 11.1 V follows its strokes.

Torque and speed are its maker's (6.4 N m, 67 rpm). Assumptions: full voltage from an error of 12.5 deg on, and
0.003 kg m2 of rotor and gears at the output. Speeds are means over ten seconds from rest, as in the paper's pool. The
hull's drag area is fitted anew, on the same printed speed.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from nectosome.core import Status
from nectosome.description import RobotDescription, with_values
from nectosome.description.drives import AngularServo
from nectosome.model import build
from nectosome.robots import beetle
from nectosome.robots.beetle import PADDLES
from nectosome.solve import simulate

from .swim import SPEEDS, Swim, drag_coefficient, on_a_slide, strokes

_SECONDS, _SAMPLES, _RTOL = 10.0, 201, 1e-5
_FITTED: Swim = (3, math.radians(75), 1.1)
_VOLTAGE, _STALL, _NO_LOAD = 11.1, 6.4, 67 * math.tau / 60  # V, N m, rad/s
_FULL_AT, _ROTOR = math.radians(12.5), 0.003  # rad, kg m2: assumptions
READINGS = (1.2, 1.3)  # Hz: between them 30 deg gives the speeds that are printed for 0.3 Hz
SWIMS: tuple[Swim, ...] = (*SPEEDS, *((n, math.radians(30), f) for f in READINGS for n in (3, 1)))


def servo(count: float = 1.0) -> AngularServo:
    """A servo with the torque and the rotor of so many."""
    return AngularServo(
        rated_voltage=_VOLTAGE,
        stall_torque=count * _STALL,
        no_load_speed=_NO_LOAD,
        inertia=count * _ROTOR,
        supply=_VOLTAGE,
        full_voltage_at=_FULL_AT,
    )


def on_servos(robot: RobotDescription, count: float = 4.0) -> RobotDescription:
    """The robot whose paddles are moved by a servo each; on a slide its one paddle is as heavy as four."""
    drive = {"servo": servo(count), "limits": None}
    for name in (f"{place}_arm" for place in PADDLES if f"{place}_arm" in robot.limbs):
        robot = robot.with_part(name, joint=robot.limbs[name].joint.model_copy(update=drive))
    return robot


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
    robot = on_servos(on_a_slide(beetle(joints)))

    def surplus(area: float) -> float:
        return mean_speed(ten_seconds(robot, amplitude, frequency, area)) - SPEEDS[_FITTED]

    return float(np.asarray(brentq(surplus, 0.004, 0.03, xtol=1e-6)))


def swims_on_servos(area: float) -> xr.Dataset:
    """Speeds of Table 5, and of its 30 deg at 1.2 and 1.3 Hz, with largest errors [rad] and torques of a servo [N m].

    The hull's drag area [m2] is given; `coefficient` is that over its frontal area [-].
    """
    robots = {joints: on_servos(on_a_slide(beetle(joints))) for joints in (1, 3)}
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
