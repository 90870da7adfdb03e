"""Steering by strokes of unequal size: how fast and how tightly the rowing robot turns when one side rows less."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from nectosome.core import Status
from nectosome.description import RobotDescription, get_value, with_values
from nectosome.model import build
from nectosome.solve import periodic

from .swim import hull_centre


class Turn(NamedTuple):
    """A motion along a circle, cycle by cycle."""

    rate: float  # of the heading [rad/s], positive to the left
    radius: float  # of the hull centre's path from cycle to cycle [m]; inf where it goes straight
    speed: float  # along it [m/s]
    multiplier: float  # of the disturbance that dies out last, in each cycle; above 1 it grows


def turn(robot: RobotDescription, left: float, right: float) -> Turn:
    r"""Cycle that the planar robot keeps with these amplitudes [rad] on its sides.

    It moves the hull's centre by d and turns it by $\psi$, along a circle of radius $|d| / 2 |\sin(\psi/2)|$. Raises
    RuntimeError where no cycle is found.
    """
    frequency = float(get_value(robot, "f"))
    found = periodic(build(with_values(robot, {"A_left": left, "A_right": right})), 1 / frequency)
    if found.status not in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE):
        raise RuntimeError(f"turn with {left:.3f}, {right:.3f} rad: {Status(int(found.status)).reason}")
    ends = np.asarray(found.value.state.q)[[0, -1], :3]
    psi = float(ends[1, 2] - ends[0, 2])
    way = float(np.hypot(*np.diff(hull_centre(robot, ends))).item())
    curved = 2 * abs(float(np.sin(0.5 * psi)))
    radius = way / curved if curved > _STRAIGHT else np.inf
    return Turn(psi * frequency, radius, way * frequency, float(found.stats["multiplier"]))


_STRAIGHT = 1e-9


def turns(robot: RobotDescription, left: Sequence[float]) -> xr.Dataset:
    """Turns with these amplitudes [rad] on the left side, and on the right that of the robot."""
    full = float(get_value(robot, "A_right"))
    found = [turn(robot, amplitude, full) for amplitude in left]
    units = {"rate": "rad/s", "radius": "m", "speed": "m/s", "multiplier": "1"}
    return xr.Dataset(
        {name: ("left", [getattr(t, name) for t in found], {"units": unit}) for name, unit in units.items()},
        coords={"left": ("left", [*map(float, left)], {"units": "rad"})},
        attrs={"right": full},
    )
