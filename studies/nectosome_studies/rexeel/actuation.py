r"""Gain and lag of RExEel's five motors, from their logs: of one amplitude, held against those of the others.

$$ \theta(t) = g\, \theta_c(t - \tau) $$

with the commanded angle $\theta_c$ and the angle $\theta$ of the encoder. At 0.5 Hz a dead time and a time
constant as short as these look the same: only their sum, the lag, is identifiable.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from nectosome.identification import fit

from .recordings import AMPLITUDES, RecordedSwims, commanded

FITTED = AMPLITUDES[0]  # [deg]: the least load on the motors
_RANGES = {"gain": (0.8, 1.2), "lag": (0.0, 0.1)}


class IdentifiedMotors(NamedTuple):
    """Numbers of the motors from head to tail; intervals are of 95 %, `low` and `high` in the last axis."""

    gain: Float[np.ndarray, "5"]
    gain_interval: Float[np.ndarray, "5 2"]
    lag: Float[np.ndarray, "5"]  # [s]
    lag_interval: Float[np.ndarray, "5 2"]  # [s]


def identified(swims: RecordedSwims) -> IdentifiedMotors:
    """Least squares over one log, motor by motor."""
    time, found = swims.log_time, []
    for target, actual in zip(swims.target.T, swims.actual.T, strict=True):
        command = CubicSpline(time, target)

        def angle(t: Float[np.ndarray, "n"], gain: float, lag: float, command: CubicSpline = command) -> np.ndarray:
            return gain * command(np.maximum(t - lag, 0.0))  # targets begin at 0 deg

        found.append(fit(angle, time, actual, _RANGES))

    def of(name: str) -> tuple[np.ndarray, np.ndarray]:
        ends = [(one.intervals[name].low, one.intervals[name].high) for one in found]
        return np.array([one.values[name] for one in found]), np.array(ends)

    return IdentifiedMotors(*of("gain"), *of("lag"))


def through(motors: IdentifiedMotors, amplitude: int, time: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 5"]:
    """Commanded angles [rad] at one of the amplitudes, through the motors."""
    late = [commanded(amplitude, time - lag)[:, i] for i, lag in enumerate(motors.lag)]
    return motors.gain * np.stack(late, axis=-1)


def to_dataset(motors: IdentifiedMotors, measured: Sequence[RecordedSwims]) -> xr.Dataset:
    """Numbers by `motor`, and rms errors (amplitude, motor) of the logs as commanded and through the motors."""
    as_commanded, as_identified = (
        [np.sqrt(np.mean((one.actual - angles) ** 2, axis=0)) for one, angles in zip(measured, every, strict=True)]
        for every in (
            [one.target for one in measured],
            [through(motors, k, one.log_time) for k, one in zip(AMPLITUDES, measured, strict=True)],
        )
    )
    over, ends = ("amplitude", "motor"), ("motor", "end")
    return xr.Dataset(
        {
            "gain": ("motor", motors.gain),
            "gain_interval": (ends, motors.gain_interval),
            "lag": ("motor", motors.lag, {"units": "s"}),
            "lag_interval": (ends, motors.lag_interval, {"units": "s"}),
            "error_commanded": (over, np.rad2deg(as_commanded), {"units": "deg"}),
            "error": (over, np.rad2deg(as_identified), {"units": "deg"}),
        },
        coords={"motor": np.arange(1, 6), "amplitude": [*AMPLITUDES], "end": ["low", "high"]},
    )
