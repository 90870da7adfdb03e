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
from nectosome.description import RobotDescription, get_value, with_values
from nectosome.description.drives import AngularServo
from nectosome.model import build
from nectosome.robots import beetle
from nectosome.robots.beetle import PADDLES
from nectosome.solve import simulate

from .swim import SPEEDS, Swim, on_a_slide, strokes

_SECONDS, _SAMPLES, _RTOL = 10.0, 201, 1e-5
_FITTED: Swim = (3, math.radians(75), 1.1)
_VOLTAGE, _STALL, _NO_LOAD = 11.1, 6.4, 67 * math.tau / 60  # V, N m, rad/s
_FULL_AT, _ROTOR = math.radians(12.5), 0.003  # rad, kg m2: assumptions
READINGS = (1.2, 1.3)  # Hz: what the printed 0.3 Hz may have been
SWIMS: tuple[Swim, ...] = (*SPEEDS, *((n, math.radians(30), f) for f in READINGS for n in (3, 1)))


def on_servos(joints: int) -> RobotDescription:
    """The robot on a slide, whose one paddle is four times as heavy, and its servo four times as strong."""
    robot = on_a_slide(beetle(joints))
    arm = f"{PADDLES[0]}_arm"
    servo = AngularServo(
        rated_voltage=_VOLTAGE,
        stall_torque=4 * _STALL,
        no_load_speed=_NO_LOAD,
        inertia=4 * _ROTOR,
        supply=_VOLTAGE,
        full_voltage_at=_FULL_AT,
    )
    return robot.with_part(arm, joint=robot.limbs[arm].joint.model_copy(update={"servo": servo, "limits": None}))


def ten_seconds(swim: Swim, drag_area: float) -> xr.Dataset:
    """Ten seconds from rest. Raises RuntimeError where the simulation fails."""
    joints, amplitude, frequency = swim
    values = {"A": amplitude, "f": frequency, "drag_area": drag_area, "Cn": 4.0}
    run = simulate(build(with_values(on_servos(joints), values)), _SECONDS, samples=_SAMPLES, rtol=_RTOL)
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"swim on servos, {joints} joints, {values}: {Status(int(run.status)).reason}")
    return run.to_dataset()


def mean_speed(run: xr.Dataset) -> float:
    """Way along the slide over the time [m/s]."""
    return float(run["q"][-1, 0] - run["q"][0, 0]) / float(run["time"][-1])


def fitted_drag_area() -> float:
    """Drag area of the hull along x [m2] at which the robot with three joints swims at the printed 0.323 m/s."""

    def surplus(area: float) -> float:
        return mean_speed(ten_seconds(_FITTED, area)) - SPEEDS[_FITTED]

    return float(np.asarray(brentq(surplus, 0.004, 0.03, xtol=1e-6)))


def swims_on_servos() -> xr.Dataset:
    """Speeds of Table 5, and of its 30 deg at 1.2 and 1.3 Hz, with largest errors [rad] and torques of a servo [N m].

    `coefficient` is the drag area over the hull's frontal area [-].
    """
    area = fitted_drag_area()
    runs = [ten_seconds(swim, area) for swim in SWIMS]
    front = math.pi * float(get_value(beetle(3), "body.radius")) ** 2
    return xr.Dataset(
        {
            "speed": ("row", [*map(mean_speed, runs)], {"units": "m/s"}),
            "tracking_error": ("row", [float(np.abs(run["tracking_error"]).max()) for run in runs], {"units": "rad"}),
            "torque": ("row", [0.25 * float(np.abs(run["motor_torque"]).max()) for run in runs], {"units": "N m"}),
        },
        coords=strokes(SWIMS),
        attrs={"drag_area": area, "coefficient": area / front},
    )


def numbers(found: xr.Dataset) -> Mapping[str, float]:
    """By scorecard row."""
    rows = [f"paddle/servo/fp{n}jp/{math.degrees(a):.0f}-{f}/speed" for n, a, f in SWIMS]
    area, coefficient = (f"paddle/servo/drag-{what}" for what in ("area", "coefficient"))
    fitted = {area: found.attrs["drag_area"], coefficient: found.attrs["coefficient"]}
    return fitted | dict(zip(rows, found["speed"].values.tolist(), strict=True))
