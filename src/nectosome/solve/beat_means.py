"""What a simulation comes to over its last whole beats, as the numbers that a cycle has: stroke, power, transport."""

from collections.abc import Mapping
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from nectosome.core.programs.remember import remembered
from nectosome.description import parse_robot
from nectosome.description.period import ramps_end
from nectosome.mechanism import Diagnosis, Robot

from .cycle_means import OF_A_CYCLE, means_of
from .mean_window import LEAST_SAMPLES, ROUNDING, mean_window
from .results import Data

_LEAST_BEATS = 3  # of a run after its ramps
_SAMPLES = 129  # of a beat, between those of the run


def beat_means(robot: Robot, time: Float[np.ndarray, "n"], d: Diagnosis, attributes: Mapping[str, Any]) -> Data:
    """Numbers of a cycle (`CycleMeans`) that are single ones, over the last whole beats of a run diagnosed as d.

    Each is the mean of those of the beats of its `mean_window`, taken by `means_of` from the run between its samples,
    which count as straight. Nothing where the drives have no period, of a run of less than three beats after its ramps,
    and of one with less than `LEAST_SAMPLES` a beat.
    """
    window = mean_window(time, attributes) if time.size > 1 else None
    if window is None or not window.beats:
        return {}
    end = float(time[-1])
    beat = (end - window.start) / window.beats
    begins = ramps_end(parse_robot(str(attributes["robot"])))
    in_beat = np.count_nonzero(time > window.start) / window.beats
    if end - max(begins, float(time[0])) < (_LEAST_BEATS - ROUNDING) * beat or in_beat < LEAST_SAMPLES:
        return {}
    d, grid = jax.tree.map(np.asarray, d), np.linspace(0.0, beat, _SAMPLES)
    each = [
        remembered(means_of, robot, grid, _between(d, time, window.start + k * beat + grid))
        for k in range(window.beats)
    ]
    single = {name: unit for name, (dims, unit) in OF_A_CYCLE.items() if not dims}
    return {name: ((), np.asarray(np.mean([getattr(x, name) for x in each])), unit) for name, unit in single.items()}


def _between(d: Diagnosis, time: Float[np.ndarray, "n"], at: Float[np.ndarray, "m"]) -> Diagnosis:
    """Diagnosis at times between those of a run, straight from one to the next."""
    k = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
    share = np.clip((at - time[k]) / (time[k + 1] - time[k]), 0.0, 1.0)

    def leaf(x: np.ndarray) -> np.ndarray:
        s = share.reshape(-1, *[1] * (x.ndim - 1))
        return (1 - s) * x[k] + s * x[k + 1]

    return jax.tree.map(leaf, d)
