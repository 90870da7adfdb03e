"""Tracking errors, and the numbers of a step response."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.io.tables import Label, Number

_SETTLED = 0.05  # of the step
_LAST = 0.1  # of the time, over which the steady error is averaged
_APPROACH = 0.02  # of the whole decrease of an error, in that time, from which it counts as decreasing


class StepResponse(NamedTuple):
    """Response to a step from the initial output to a constant reference; NaN for an event that did not occur."""

    rise: float  # from 10 to 90 % of the step [s]
    overshoot: float  # beyond the reference, as a share of the step
    settling: float  # time after which it stays within 5 % of the step about the reference [s]
    steady_error: float  # output less reference, mean over the last tenth of the time


def rms_error(output: Float[np.ndarray, "k"], reference: Float[np.ndarray, "k"]) -> float:
    """Root mean square of output less reference."""
    return float(np.sqrt(np.mean((output - reference) ** 2)))


def still_approaching(error: Float[np.ndarray, "k"]) -> bool:
    """Whether the error still decreases at the end: by more than 2 % of its whole decrease over the last tenth."""
    first, before, last = (abs(float(error[k])) for k in (0, -max(len(error) // 10, 2), -1))
    return before - last > max(_APPROACH * (first - last), 0.0)


def step_response(
    time: Float[np.ndarray, "k"], output: Float[np.ndarray, "k"], reference: Float[np.ndarray, "k"]
) -> StepResponse | None:
    """Numbers of a step response; None for a reference that changes, or that equals the initial output.

    The output is interpolated linearly between samples.
    """
    step = float(reference[-1] - output[0])
    if np.ptp(reference) > 0 or step == 0:
        return None
    share = (output - output[0]) / step
    rise = _first(time, share, 0.9) - _first(time, share, 0.1)
    outside = np.flatnonzero(np.abs(share - 1) > _SETTLED)
    settling = np.nan
    if not outside.size:
        settling = float(time[0])
    elif outside[-1] < time.size - 1:
        k = outside[-1]
        settling = _crossing(time, share, k, 1 + _SETTLED * np.sign(share[k] - 1))
    last = time >= time[-1] - _LAST * (time[-1] - time[0])
    return StepResponse(rise, float(max(share.max() - 1, 0.0)), settling, float(np.mean((output - reference)[last])))


def tracking_rows(
    time: Float[np.ndarray, "k"],
    output: Float[np.ndarray, "k"],
    reference: Float[np.ndarray, "k"],
    unit: str,
    show: Callable[[float], str],
) -> list[tuple[Label, Number]]:
    """Rise, overshoot and settling of a step, and errors of any reference, as rows; `show` writes a value of it."""
    answer, rms = step_response(time, output, reference), rms_error(output, reference)
    most = float(np.abs(output - reference).max())
    rows = list[tuple[str, str, float, str, str]]()
    if answer is not None:
        rows = [
            ("rise", "rise, 10 to 90 %", answer.rise, "s", f"{answer.rise:.4g} s"),
            ("overshoot", "overshoot", answer.overshoot, "", f"{100 * answer.overshoot:.4g} %"),
            ("settling", "settled within 5 %, from", answer.settling, "s", f"{answer.settling:.4g} s"),
            ("steady_error", "steady error", answer.steady_error, unit, show(answer.steady_error)),
        ]
    rows += [
        ("rms_error", "rms error", rms, unit, show(rms)),
        ("largest_error", "largest error", most, unit, show(most)),
    ]
    return [
        (Label(key, name), Number(float(value), of, shown=shown if np.isfinite(value) else "never"))
        for key, name, value, of, shown in rows
    ]


def _first(time: np.ndarray, share: np.ndarray, level: float) -> float:
    """Time at which a level is first reached; NaN where it is not."""
    reached = share >= level
    return _crossing(time, share, int(np.argmax(reached)) - 1, level) if reached.any() else np.nan


def _crossing(time: np.ndarray, share: np.ndarray, k: int, level: float) -> float:
    """Time between the samples k and k + 1 at which a level is crossed."""
    return float(time[k] + (level - share[k]) / (share[k + 1] - share[k]) * (time[k + 1] - time[k]))
