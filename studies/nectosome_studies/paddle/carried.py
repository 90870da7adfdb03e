r"""Water that the plates carry along, which the paper leaves out: do three joints still swim faster than one?

In potential flow a plate of width w carries $\rho \pi w^2/4$ a length across itself: 0.13 kg a paddle, which has a mass
of 0.03 kg itself; one that is 2.6 times as long as wide carries about 0.8 of that (DNV-RP-H103, Table A-2). A share of
0 is the paper's model. Drag areas of the hull are those fitted without it: with all of it no drag area of 20 cm2 or
more brings the robot with three joints and ideal drives to its printed speed.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from nectosome.description import RobotDescription
from nectosome.description.loads import AddedMassLoad
from nectosome.robots import beetle

from .servos import mean_speed, ten_seconds
from .swim import on_a_slide, slide_speed, with_ideal_drives

SHARES = (0.0, 0.2, 0.5, 1.0)
_STROKE = math.radians(75), 1.1  # rad, Hz: where both robots were fastest
_JOINTS = (1, 3)


def carrying(robot: RobotDescription, share: float) -> RobotDescription:
    """The robot whose plates carry this share of the water of potential flow."""
    water = AddedMassLoad(kind="added_mass", normal=share)
    limbs = {
        name: limb.model_copy(update={"loads": {**limb.loads, "water": water}}) if "segment" in name else limb
        for name, limb in robot.limbs.items()
    }
    return robot.model_copy(update={"limbs": limbs})


def carried(ideal_area: float, servo_area: float, shares: Sequence[float] = SHARES) -> xr.Dataset:
    """Speed [m/s] over `drive` (ideal, servo), `joints` and `share`, with the hull's drag area [m2] of each drive."""
    speed = np.empty((2, len(_JOINTS), len(shares)))
    for i, joints in enumerate(_JOINTS):
        for k, share in enumerate(shares):
            robot = on_a_slide(carrying(beetle(joints), share))
            speed[0, i, k] = slide_speed(with_ideal_drives(robot), *_STROKE, ideal_area)
            speed[1, i, k] = mean_speed(ten_seconds(robot, *_STROKE, servo_area))
    return xr.Dataset(
        {"speed": (("drive", "joints", "share"), speed, {"units": "m/s"})},
        coords={"drive": ["ideal", "servo"], "joints": list(_JOINTS), "share": list(shares)},
    )


def numbers(found: xr.Dataset) -> Mapping[str, float]:
    """By scorecard row: speed of three joints over that of one, and both speeds with all of the water."""
    speed = found["speed"]
    ratio = speed.sel(joints=3) / speed.sel(joints=1)
    rows = {
        f"paddle/added-mass/{drive}/{name}/order": float(ratio.sel(drive=drive, share=share))
        for drive in ("ideal", "servo")
        for name, share in (("none", 0.0), ("all", 1.0))
    }
    return rows | {
        f"paddle/added-mass/{drive}/all/fp{n}jp/speed": float(speed.sel(drive=drive, share=1.0, joints=n))
        for drive in ("ideal", "servo")
        for n in (3, 1)
    }
