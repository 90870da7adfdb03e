"""The drop of speed above 1.1 Hz (section 6.2) as an empirical layer, which is off unless a slope is given.

The model has no such drop: its thrust grows on, as that of the paper's model does. A factor on Cn that falls with the
frequency stands for whatever it was; one printed speed says how steeply. (One candidate: at 75 deg the servo would have
to turn faster than its 67 rev/min without load at 11.1 V, the battery's voltage, from 0.85 Hz on; XW540-T140.)
"""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from . import swim
from .swim import SPEEDS, straight_speed

_PEAK = 1.1  # Hz


def factor(frequency: float, slope: float = 0.0) -> float:
    """Factor on Cn at a frequency [Hz]: 1 up to 1.1 Hz, then less by `slope` [1/Hz] a hertz, never below 0."""
    return max(0.0, 1.0 - slope * max(0.0, frequency - _PEAK))


def calibrated_slope(drag_area: float) -> float:
    """Slope [1/Hz] at which the robot with three joints swims at the printed 0.142 m/s at 75 deg and 1.3 Hz."""
    joints, amplitude, frequency = row = (3, math.radians(75), 1.3)

    def surplus(cn: float) -> float:
        return straight_speed(joints, amplitude, frequency, drag_area, cn) - SPEEDS[row]

    cn = float(np.asarray(brentq(surplus, 0.02, 1.0, xtol=1e-6)))
    return (1 - cn) / (frequency - _PEAK)


def curves(drag_area: float, frequencies: Sequence[float]) -> xr.Dataset:
    """The curves of `swim` and, as `dropped`, that of three joints at 75 deg with the drop [m/s]."""
    slope = calibrated_slope(drag_area)
    dropped = [straight_speed(3, math.radians(75), f, drag_area, factor(f, slope)) for f in frequencies]
    found = swim.curves(drag_area, frequencies).assign(dropped=("frequency", dropped, {"units": "m/s"}))
    return found.assign_attrs(drop_slope=slope)
