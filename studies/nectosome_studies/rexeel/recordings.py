r"""What the authors recorded of RExEel: tracks of its head from above, and the angles of its motors.

Robotic Exploration Lab, repository RoboticSwimmingWithUnifiedFluidRobot, folder data/rexeel_forward_swimming (MIT,
`recordings.LICENSE`; the files are in `data`, as they are there). At each of four amplitudes about twenty swims from
rest were filmed at 30 frames a second; of each amplitude there is one log of the motors.

Positions are of the middle of the head link, seen from above, from where it starts: x across the tank, y along it, the
way that the robot swims. The yaw is 0 at the start too, and turns from y towards x: clockwise.
"""

from importlib.resources import files
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from nectosome.measure.signals import smooth

AMPLITUDES = (10, 20, 30, 40)  # K of the motors [deg]
FREQUENCY, LAG, RAMP = 0.5, 0.7, 1.0  # [Hz], turns from head to tail, [s]
FRAME = 1 / 30  # [s]
_STEP, _WINDOW = 0.02, 0.2  # of angles as logged, evenly sampled [s]; encoders have steps of 0.088 deg


class RecordedSwims(NamedTuple):
    """Swims at one amplitude, and the motors' log; x, y and yaw from the start."""

    time: Float[np.ndarray, "frame"]  # [s]
    x: Float[np.ndarray, "swim frame"]  # across [m]
    y: Float[np.ndarray, "swim frame"]  # along [m]
    yaw: Float[np.ndarray, "swim frame"]  # [rad]
    log_time: Float[np.ndarray, "sample"]  # [s]
    target: Float[np.ndarray, "sample 5"]  # angles of the motors from head to tail [rad]
    actual: Float[np.ndarray, "sample 5"]  # [rad]


def recorded(amplitude: int) -> RecordedSwims:
    """All swims at one of the `AMPLITUDES`."""
    folder = files("nectosome_studies").joinpath("rexeel", "data")
    with folder.joinpath(f"{amplitude}deg_hardware_trajectories.csv").open(encoding="utf-8") as file:
        frames = pd.read_csv(file)
    with folder.joinpath(f"{amplitude}deg_hardware_motor_angles.csv").open(encoding="utf-8") as file:
        log = pd.read_csv(file, comment="#")
    across, along, yaw = (
        frames.pivot(index="video", columns="frame", values=name).to_numpy() for name in ("x_cm", "y_cm", "robot_yaw")
    )
    x, y, yaw = (values - values[:, :1] for values in (across / 100, along / 100, np.deg2rad(yaw)))
    target, actual = (np.deg2rad(log[[f"{kind}_{i}" for i in range(1, 6)]].to_numpy()) for kind in ("target", "actual"))
    return RecordedSwims(FRAME * np.arange(x.shape[1]), x, y, yaw, log["time_s"].to_numpy(), target, actual)


def commanded(amplitude: int, time: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 5"]:
    r"""Commanded angles [rad]: $K s(t) \sin(2\pi(f t - 0.7 i/5))$, s = 3 u^2 - 2 u^3 up to t = 1 s, u = t/1 s."""
    u = np.clip(time / RAMP, 0.0, 1.0)
    turns = FREQUENCY * time[:, None] - LAG * np.arange(1, 6) / 5
    return np.deg2rad(amplitude) * (u**2 * (3 - 2 * u))[:, None] * np.sin(2 * np.pi * turns)


def logged(swims: RecordedSwims, time: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 5"]:
    """Angles as logged [rad], smoothed so that they can be differentiated twice; before the log they stand still."""
    even = np.arange(0.0, swims.log_time[-1], _STEP)
    angles = np.stack([np.interp(even, swims.log_time, one) for one in swims.actual.T], axis=-1)
    smoothed = smooth(xr.Dataset({"angle": (("time", "joint"), angles)}, {"time": even}), _WINDOW)
    return CubicSpline(even, smoothed["angle"].transpose("time", "joint").to_numpy())(time)
