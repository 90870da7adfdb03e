"""Why there is no place or pose, or which of its numbers mean nothing."""

from enum import IntEnum


class Status(IntEnum):
    """What became of a place or a pose; 0: it holds."""

    GOOD = 0
    FEW_CAMERAS = 1
    PARALLEL = 2
    BEHIND = 3
    UNSETTLED = 4
    FEW_MARKERS = 5
    LINE = 6
    GIMBAL = 7

    @property
    def words(self) -> str:
        """What is told to people."""
        return _WORDS[self]


_WORDS = {
    Status.GOOD: "good",
    Status.FEW_CAMERAS: "seen by fewer than two cameras",
    Status.PARALLEL: "seen along rays that are nearly parallel",
    Status.BEHIND: "its rays meet behind a camera",
    Status.UNSETTLED: "its rays do not come near each other",
    Status.FEW_MARKERS: "fewer than three markers have a place",
    Status.LINE: "the markers that have a place lie on a line",
    Status.GIMBAL: "pitch is near 90 deg: roll and yaw are not told apart, its rotation holds",
}
