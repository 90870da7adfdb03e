"""Why there is no number: the reasons of gaps in what was tracked."""

from collections.abc import Iterator, Sequence
from enum import IntEnum

import numpy as np
from jaxtyping import Int


class Reason(IntEnum):
    """Why a frame has no value; 0: it has one."""

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
        """What is told to people."""
        return _WORDS[self]


_WORDS = {
    Reason.SEEN: "seen",
    Reason.LOST: "not seen",
    Reason.PIECES: "seen in more pieces than there are",
    Reason.MERGED: "larger than usual: merged with something else",
    Reason.COVERED: "smaller than usual: covered in part",
    Reason.EDGE: "cut off by the edge of the picture",
    Reason.ROUND: "as wide as long: it has no direction",
    Reason.DIRECTION: "no neighbour tells which of its ends is which",
    Reason.DOUBT: "two ways to tell it apart are as likely",
}


def lost(names: Sequence[str], why: Int[np.ndarray, "t n"]) -> Iterator[str]:
    """What was not tracked, in words."""
    for k, name in enumerate(names):
        for reason in Reason:
            count = int(np.sum(why[:, k] == reason))
            if count and reason != Reason.SEEN:
                first = int(np.argmax(why[:, k] == reason)) + 1
                yield f"{name}: {reason.words} in {count} of {len(why)} frames, the first is frame {first}"
