r"""A body that a thrust drives along a line through water: its added mass and drag, from recordings of both.

$$ (M + m_{as}) \dot v = -\Lambda v |v| + \tau $$

(Giorgio-Serchi et al. 2017, eq. 1), which is linear in $\alpha = -\Lambda/m$ and $\gamma = 1/m$ with m = M + m_as.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_coeffs, savgol_filter

from nectosome.measure.signals import find_period
from nectosome.units import InputError, did_you_mean

from ..fits.linear import (
    Estimate,
    Trial,
    finite_differences,
    follow_recording,
    instrumental_variables,
    integral_windows,
    output_error,
)

Method = Literal["output_error", "instrumental_variables", "integral_windows", "finite_differences"]
METHODS: tuple[Method, ...] = ("output_error", "instrumental_variables", "integral_windows", "finite_differences")
_ORDER = 3  # of the polynomials of the Savitzky-Golay filter
_FROM_ZERO = 3.0  # standard errors that gamma must be away from 0
_PART = 0.1  # of the shortest recording: a window where the thrust has no period

BIASED = (
    "bias expected: rectangles from sample to sample, and a filter on the speed alone, change both parameters; "
    "intervals are of no use either. Take output_error"
)
STATIC = (
    "the thrust was recorded apart, with the robot held: a swimming robot also has to bring the water that it takes in "
    "up to its speed, which is found as drag. The drag may come out too large, by far where that water is still; the "
    "mass is off where the robot's shape changes"
)


class SurgeRecording(NamedTuple):
    """Speed, and the thrust with times of its own that go from before to after it."""

    name: str
    time: Float[np.ndarray, "n"]  # [s] evenly spread
    speed: Float[np.ndarray, "n"]  # [m/s]
    thrust_time: Float[np.ndarray, "m"]  # [s]
    thrust: Float[np.ndarray, "m"]  # [N] along the speed
    static: bool = False  # whether the thrust was recorded apart, with the robot held
    notes: tuple[str, ...] = ()  # what was done to it
    file: str = ""  # with the speed

    @property
    def trial(self) -> Trial:
        """As `linear` takes it, with a cubic spline through the thrust."""
        return Trial(self.time, self.speed, _rate, (CubicSpline(self.thrust_time, self.thrust),))


class Surge(NamedTuple):
    """The model with the parameters that fit recordings."""

    method: Method
    mass: float  # M [kg]
    rate: Estimate  # alpha [1/m], gamma [1/kg]
    physical: Estimate  # m_as [kg], Lambda [kg/m], by the delta method
    warnings: tuple[str, ...]

    def speed(self, recording: SurgeRecording) -> Float[np.ndarray, "n"]:
        """Speed that the model has with the thrust of a recording, from the first one of least squares on [m/s]."""
        return follow_recording(recording.trial, self.rate.values)


def fit_surge(
    recordings: Sequence[SurgeRecording], mass: float, method: str = "output_error", smooth: float | None = None
) -> Surge:
    """Added mass and drag of a body of known mass [kg], one fit to all recordings.

    - `output_error`: least squares of the speed itself, unbiased by noise of samples; recommended.
    - `instrumental_variables`, `integral_windows`: differences of the speed over half and whole periods of the thrust.
    - `finite_differences`: differences of neighbouring samples, as published (eqs. 4 to 9).

    `smooth` [s] is the window of a Savitzky-Golay filter: on the speed alone for `finite_differences`, as published, on
    both signals for `integral_windows`; the others take none. Raises InputError where the speed goes against the
    thrust, nothing fits, or a window does not.
    """
    if method not in METHODS:
        raise InputError(f'"{method}" is no method.{did_you_mean(method, METHODS)}', field="method")
    if smooth is not None and method not in ("finite_differences", "integral_windows"):
        raise InputError(f"{method} takes recordings as they are: leave it out.", field="smooth")
    trials = [recording.trial for recording in recordings]
    warnings: list[str] = []
    try:
        found = _estimate(trials, method, smooth, warnings)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise InputError(f"nothing was found by {method}: {str(error).rstrip('.')}.", field="method") from None
    if not np.isfinite(found.covariance).all():
        raise InputError("no motion of the model fits the recordings.", field="method")
    gamma, error = found.values[1], found.errors[1]
    if -_FROM_ZERO * error < gamma <= 0:
        raise InputError("the speed does not follow the thrust: they are not of one motion, or noise hides it.")
    if gamma <= 0:
        turned = "the speed falls where the thrust pushes: one of them has the other sign"
        raise InputError(f"{turned}. Turn it in the campaign (sign: -1).", field="thrust")
    bodily = physical(found, mass)
    warnings += found.warnings
    added, drag = bodily.values
    if added < 0:
        robot = f"one of {mass + added:.3g} kg"
        warnings.append(f"the added mass is negative: the robot moves like {robot}. Check its mass")
    if drag < 0:
        warnings.append("the drag is negative: thrust or speed is not what it seems, or too short to tell")
    if gamma < _FROM_ZERO * error:
        warnings.append("the speed hardly follows the thrust: the added mass is unknown, and its interval too short")
    warnings += [BIASED] if method == "finite_differences" else []
    warnings += [STATIC] if any(recording.static for recording in recordings) else []
    return Surge(method, mass, found, bodily, tuple(warnings))


def physical(rate: Estimate, mass: float) -> Estimate:
    r"""Added mass $1/\gamma - M$ [kg] and drag $-\alpha/\gamma$ [kg/m] from those of alpha and gamma."""
    return rate.of(lambda theta: _bodily(theta, mass))


@jax.jit
def _bodily(theta: Array, mass: float) -> Array:
    return jnp.stack([1 / theta[1] - mass, -theta[0] / theta[1]])


def _estimate(trials: Sequence[Trial], method: str, smooth: float | None, warnings: list[str]) -> Estimate:
    """The parameters by a method; `warnings` takes what else there is to say."""
    if method == "finite_differences":
        return finite_differences([_smoothed(trial, smooth, 1)[0] for trial in trials] if smooth else trials)
    lengths, period = _lengths(trials)
    if period is None and method != "output_error":
        warnings.append(f"the thrust has no period: windows are of {lengths[0]:.3g} s and {lengths[1]:.3g} s")
    if method == "integral_windows" and smooth:
        filtered, kernels = zip(*(_smoothed(trial, smooth, 2) for trial in trials), strict=True)
        if len({len(kernel) for kernel in kernels}) > 1:
            raise ValueError("recordings of several rates cannot go through one filter: leave smooth out")
        return integral_windows(filtered, lengths, kernels[0])
    if method == "instrumental_variables":
        return instrumental_variables(trials, lengths)
    if method == "integral_windows":
        return integral_windows(trials, lengths)
    near = integral_windows(trials, lengths)
    alpha, gamma = near.values
    return output_error(trials, np.array([-abs(alpha), gamma if gamma > 0 else near.errors[1]]))  # noise turns signs


def _lengths(trials: Sequence[Trial]) -> tuple[tuple[float, float], float | None]:
    """Half and the whole of the thrust's longest period, which windows are as long as; the period if there is one."""
    periods = []
    for trial in trials:
        thrust = trial.inputs[0](trial.time)
        try:
            periods.append(find_period(xr.DataArray(thrust, {"time": trial.time}, ("time",))).period)
        except ValueError:
            length = _PART * min(trial.time[-1] - trial.time[0] for trial in trials)
            return (length, 2 * length), None
    return (max(periods) / 2, max(periods)), max(periods)


def _smoothed(trial: Trial, window: float, signals: int) -> tuple[Trial, Float[np.ndarray, "w"]]:
    """A trial with its state (1) or both its signals (2) behind a Savitzky-Golay filter, and the filter's kernel."""
    samples = 2 * round((window / float(np.mean(np.diff(trial.time))) - 1) / 2) + 1
    if not _ORDER + 2 <= samples <= len(trial.time):
        raise ValueError(f"a window of {window:g} s has {samples} samples; {_ORDER + 2} to {len(trial.time)} will do")
    inputs = trial.inputs
    if signals == 2:
        inputs = tuple(CubicSpline(trial.time, savgol_filter(u(trial.time), samples, _ORDER)) for u in trial.inputs)
    state = np.asarray(savgol_filter(trial.state, samples, _ORDER))
    return trial._replace(state=state, inputs=inputs), savgol_coeffs(samples, _ORDER)


def _rate(t: Array, v: Array, thrust: Array) -> Array:
    """H of eq. 2; v|v| for its v^2, which are the same forwards."""
    return jnp.stack([v * jnp.abs(v), thrust])
