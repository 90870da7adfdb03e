"""Over which time of a run means are taken, everywhere alike, and whether its motion repeats itself by then."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.description import robot_of_run
from nectosome.description.period import beat_of
from nectosome.units import InputError, show_quantity

_SHARE = 0.1  # of a run: length of the means, about
ROUNDING = 1e-9
_STEADY = 1e-2  # change per beat below which a motion has settled


class MeanWindow(NamedTuple):
    """Time of means."""

    start: float  # [s]; the end is that of the run
    over: str  # its name: the cycle, the last beat with its length, ...
    beats: int = 0  # whole beats in it; 0 of a cycle, and without a beat


class Settling(NamedTuple):
    """How much a mean changes from the beat before to the last one, and what it would come to."""

    last: float  # mean over the last beat
    change: float  # relative to it; NaN where it is 0
    limit: float  # of a change that goes on shrinking as in the last three beats; NaN where it does not

    @property
    def settled(self) -> bool:
        """Whether it changes by less than 1 % a beat."""
        return not abs(self.change) > _STEADY


def beat_of_run(attributes: Mapping[str, Any]) -> float | None:
    """Period of the drives of a run's robot [s]; None where they have none, and for a robot that is not known."""
    try:
        return beat_of(robot_of_run(str(attributes["robot"])))
    except (InputError, KeyError):  # of another program, or of an older version
        return None


def mean_window(time: Float[np.ndarray, "n"], attributes: Mapping[str, Any]) -> MeanWindow:
    """A cycle as a whole; of other runs the last whole beats, about a tenth of the run; without a beat that tenth."""
    end, whole = float(time[-1]), float(time[-1] - time[0])
    if "period" in attributes:
        return MeanWindow(float(time[0]), "the cycle")
    beat = beat_of_run(attributes)
    if beat is None or beat > whole * (1 + ROUNDING):
        return MeanWindow(end - _SHARE * whole, f"the last {show_quantity(_SHARE * whole, 'time')}")
    beats = max(int(_SHARE * whole / beat + ROUNDING), 1)
    words = "beat" if beats == 1 else f"{beats} beats"
    return MeanWindow(end - beats * beat, f"the last {words}, {show_quantity(beats * beat, 'time')}", beats)


def mean_weights(time: Float[np.ndarray, "n"], start: float, end: float) -> Float[np.ndarray, "n"]:
    """Weights of samples in the mean from `start` to `end` [s] of a piecewise linear signal."""
    if time.size < 2:
        return np.ones(1)
    found = np.zeros(time.size)
    for sign, bound in ((1.0, end), (-1.0, start)):
        # integral from the first time to the bound, by the samples at both ends of each interval
        step = np.diff(time)
        share = np.clip((bound - time[:-1]) / np.where(step > 0, step, 1.0), 0.0, 1.0)
        later = 0.5 * step * share**2
        found[1:] += sign * later
        found[:-1] += sign * (step * share - later)
    return found / found.sum()


def mean_of(values: Any, attributes: Mapping[str, Any], name: str) -> Float[np.ndarray, "*rest"]:
    """Mean of a quantity of a run, arrays or a dataset, by the steps of the solver where known, else by its samples."""
    if f"{name}_mean" in values:
        return np.asarray(values[f"{name}_mean"])
    time = np.asarray(values["time"], dtype=float)
    start = mean_window(time, attributes).start if time.size > 1 else float(time[0])
    weights = mean_weights(time, start, float(time[-1]))
    kept = weights > 0
    return np.tensordot(weights[kept], np.asarray(values[name])[kept], axes=1)


def beats_of_samples(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n *rest"], beat: float
) -> Float[np.ndarray, "k *rest"]:
    """Means over the last three whole beats [s] of a run, the last one first, of what is straight between samples."""
    ends = float(time[-1]) - beat * np.arange(4)
    known = int(np.sum(ends >= time[0] - ROUNDING * beat)) - 1
    means = [np.tensordot(mean_weights(time, end - beat, end), values, axes=1) for end in ends[: max(known, 0)]]
    return np.array(means).reshape(len(means), *values.shape[1:])


def settling(means: Float[np.ndarray, "k"]) -> Settling | None:
    """Change of the mean over a beat from one beat to the next, of the last ones first; None of less than two."""
    if len(means) < 2:
        return None
    last, change = float(means[0]), float(means[0] - means[1])
    limit = np.nan
    if len(means) > 2:
        before = means[1] - means[2]
        ratio = change / before if before else np.nan
        limit = last + change * ratio / (1 - ratio) if 0 < ratio < 1 else np.nan
    return Settling(last, change / last if last else np.nan, float(limit))
