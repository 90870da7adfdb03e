"""Trials of section 6.2 with robots as they may have been made: ten seconds from rest, yaw by IMU, way made good."""

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.core import Status
from nectosome.description import RobotDescription, with_values
from nectosome.model import build
from nectosome.robots import beetle
from nectosome.solve import simulate

from .swim import SPEEDS, YAWS, Swim, hull_centre, strokes
from .tolerances import YAW_NOISE, made

_SECONDS, SAMPLE = 10.0, 0.1  # s
_RTOL = 1e-4  # moves yaw by 1e-6 rad and the way by 1e-6 m in ten seconds, compared with 1e-6


def measured_yaw(yaw: Float[np.ndarray, "n"], rng: np.random.Generator) -> Float[np.ndarray, "n"]:
    """What the IMU tells of the true yaw [rad]: with noise, and wrapped to -pi..pi."""
    noisy = yaw + YAW_NOISE * rng.normal(size=yaw.shape)
    return (noisy + np.pi) % (2 * np.pi) - np.pi


def trial(robot: RobotDescription, seed: int) -> dict[str, float]:
    """Means of one trial of the robot that is made with this seed: yaw_mean, yaw_max of |yaw| [rad], speed [m/s].

    The speed is the way made good along the heading at the start, by the hull's centre, over the time from rest.
    Raises RuntimeError where the simulation fails.
    """
    rng = np.random.default_rng(seed)
    robot = made(robot, rng)
    samples = round(_SECONDS / SAMPLE) + 1
    run = simulate(build(robot), _SECONDS, samples=samples, rtol=_RTOL, atol=1e-2 * _RTOL)
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"trial {seed}: {Status(int(run.status)).reason}")
    path = np.asarray(run.value.state.q)[:, :3]
    centre, _ = hull_centre(robot, path)
    seen = np.abs(measured_yaw(path[1:, 2], rng))
    return {"yaw_mean": seen.mean(), "yaw_max": seen.max(), "speed": (centre[-1] - centre[0]) / _SECONDS}


def trials(swims: Iterable[Swim], drag_area: float, count: int) -> xr.Dataset:
    """Trials of so many robots in each of these swims (row, trial), seeds 0, 1, ...; and what is printed (row)."""
    swims, found = list(swims), []
    for joints, amplitude, frequency in swims:
        robot = with_values(beetle(joints), {"A": amplitude, "f": frequency, "drag_area": drag_area})
        found.append([trial(robot, seed) for seed in range(count)])
    units = {"yaw_mean": "rad", "yaw_max": "rad", "speed": "m/s"}
    every = {
        name: (("row", "trial"), [[one[name] for one in row] for row in found], {"units": unit})
        for name, unit in units.items()
    }
    printed = {
        "printed_yaw": ("row", [math.radians(YAWS.get(swim, math.nan)) for swim in swims], {"units": "rad"}),
        "printed_speed": ("row", [SPEEDS[swim] for swim in swims], {"units": "m/s"}),
    }
    return xr.Dataset({**every, **printed}, coords=strokes(swims))
