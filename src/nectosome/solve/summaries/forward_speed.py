"""Which way a robot swims: its forward speed, and a note where it goes backwards."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nectosome.description import DIRECTIONS
from nectosome.io.tables import number
from nectosome.units.zero import counts_as_zero

from ..transport import direction

_BACKWARDS = 0.1  # of the speed: a robot that drifts sideways swims neither way


def forward_speeds(
    arrays: Mapping[str, np.ndarray],
    attributes: Mapping[str, Any],
    weights: np.ndarray,
    mean: np.ndarray,
    end: np.ndarray,
) -> tuple[float, float]:
    """Return a `mean` velocity along the mean of the body's forward axis, and one at the `end` along it there [m/s].

    `weights` are those of the samples in the mean, where the steps of the solver are not known. NaN of a file of an
    older version, which names no forward axis.
    """
    if "forward" not in attributes:
        return math.nan, math.nan
    axis = np.array(DIRECTIONS[attributes["forward"]])
    rotation, ahead = arrays["rotation"][:, 0], arrays.get("ahead_mean")
    if ahead is None:
        ahead, points = direction(axis, rotation, weights)
        ahead = ahead if points else np.full(3, math.nan)
    return float(mean @ ahead), float(end @ rotation[-1] @ axis)


def backwards(forward: Any, speed: Any, fastest: Any) -> Any:
    """Return whether a robot goes clearly backwards: not sideways, and by more than what counts as zero."""
    return (forward < -_BACKWARDS * speed) & (counts_as_zero(forward, 0.0, fastest) == 0)


def tail_first(forward: float, speed: float, fastest: float, part: str, attributes: Mapping[str, Any]) -> list[str]:
    """Return a note where a robot goes clearly backwards; `fastest` is the largest speed of its part [m/s]."""
    if not backwards(forward, speed, fastest):
        return []
    axis = attributes.get("forward", "x")
    why = f"forward is the {axis} axis of {part}, by the field forward of its file"
    return [f"it swims tail first: forward speed {number(forward)} m/s; {why}"]
