"""The pool swims (Figs. 9, 10): a hull drag calibrated on the old design, the new one predicted.

Neither motor speed nor hull drag is printed. The motor is run "at the maximum speed that can be reached": it is taken
to work on its torque-speed line, 0.89 N m at a standstill and 22 rad/s without load.
"""

import math

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from nectosome.description import RobotDescription, get_value, with_values

from .steady_swims import Swim, Swimmer

STALL, NO_LOAD = 0.89, 22.0  # N m, rad/s
_DRAG = "body.loads.hull_drag.drag_area.0"


def on_motor_line(description: RobotDescription, extra_drag_area: float = 0.0) -> tuple[float, Swim]:
    """Motor speed [rad/s] whose torque the motor can give, and the swim at it; extra drag area [m2] on the hull."""
    area = float(get_value(description, _DRAG)) + extra_drag_area
    swimmer = Swimmer(with_values(description, {_DRAG: area}))

    def surplus(rate: float) -> float:
        return STALL * (1 - rate / NO_LOAD) - swimmer.swim(rate).torque

    rate = float(np.asarray(brentq(surplus, 0.05 * NO_LOAD, NO_LOAD, xtol=1e-6)))
    return rate, swimmer.swim(rate)


def pool_swims(old: RobotDescription, new: RobotDescription, printed: dict[str, float]) -> xr.Dataset:
    """Old and new design in the pool: the drag area that makes the old one swim as fast as printed, and both swims."""
    target = printed["old"]

    def too_fast(log_area: float) -> float:
        return on_motor_line(old, math.exp(log_area))[1].speed - target

    area = math.exp(float(np.asarray(brentq(too_fast, math.log(1e-4), math.log(10.0), xtol=1e-6))))
    swims = [on_motor_line(design, area) for design in (old, new)]
    return xr.Dataset(
        {
            "ours": ("design", [swim.speed for _, swim in swims], {"units": "m/s"}),
            "rate": ("design", [rate for rate, _ in swims], {"units": "rad/s"}),
            "torque": ("design", [swim.torque for _, swim in swims], {"units": "N m"}),
            "printed_simulated": ("design", [printed["old"], printed["new"]], {"units": "m/s"}),
            "printed_measured": ("design", [printed["old_measured"], printed["new_measured"]], {"units": "m/s"}),
            "kind": ("design", ["calibration", "prediction"]),
        },
        coords={"design": ["old", "new"]},
        attrs={"hull_drag_area": area},
    )
