"""Reasons of missing values in tracked data, and the table (.csv) of tracked data."""

from collections.abc import Iterator, Sequence
from enum import IntEnum

import numpy as np
from jaxtyping import Int


class Reason(IntEnum):
    """Reason of a missing value in a frame; 0: not missing."""

    SEEN = 0
    LOST = 1
    PIECES = 2
    MERGED = 3
    COVERED = 4
    EDGE = 5
    ROUND = 6
    DIRECTION = 7
    DOUBT = 8

    @property
    def words(self) -> str:
        """Description for messages."""
        return _WORDS[self]


_WORDS = {
    Reason.SEEN: "seen",
    Reason.LOST: "not seen",
    Reason.PIECES: "seen in too many pieces",
    Reason.MERGED: "larger than usual: merged with something else",
    Reason.COVERED: "smaller than usual: partly covered",
    Reason.EDGE: "cut off by the edge of the picture",
    Reason.ROUND: "as wide as long: it has no direction",
    Reason.DIRECTION: "no visible neighbour gives its direction",
    Reason.DOUBT: "two assignments are equally likely",
}


def loss_notes(names: Sequence[str], why: Int[np.ndarray, "t n"]) -> Iterator[str]:
    """Notes on frames without a value."""
    for k, name in enumerate(names):
        for reason in Reason:
            count = int(np.sum(why[:, k] == reason))
            if count and reason != Reason.SEEN:
                first = int(np.argmax(why[:, k] == reason)) + 1
                yield f"{name}: {reason.words} in {count} of {len(why)} frames, the first is frame {first}"
