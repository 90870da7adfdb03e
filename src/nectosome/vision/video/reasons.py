"""Reasons of missing values in tracked data, and notes on them."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Int

from nectosome.units.errors import ReasonedStatus


class Reason(ReasonedStatus):
    """Reason of a missing value in a frame; 0: not missing."""

    SEEN = 0, "seen"
    LOST = 1, "not seen"
    PIECES = 2, "seen in too many pieces"
    MERGED = 3, "larger than usual: merged with something else"
    COVERED = 4, "smaller than usual: partly covered"
    EDGE = 5, "cut off by the edge of the picture"
    ROUND = 6, "as wide as long: it has no direction"
    DIRECTION = 7, "no visible neighbour gives its direction"
    DOUBT = 8, "two assignments are equally likely"


def loss_notes(names: Sequence[str], why: Int[np.ndarray, "t n"]) -> Iterator[str]:
    """Notes on frames without a value."""
    for k, name in enumerate(names):
        for reason in Reason:
            count = int(np.sum(why[:, k] == reason))
            if count and reason != Reason.SEEN:
                first = int(np.argmax(why[:, k] == reason)) + 1
                yield f"{name}: {reason.reason} in {count} of {len(why)} frames, the first is frame {first}"
