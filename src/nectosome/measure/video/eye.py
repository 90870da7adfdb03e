"""What finds the segments of a sheet in pictures of one size."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, UInt8

from .chain import told_apart
from .colours import Groups
from .plane import Plane, plane_of
from .reasons import Reason
from .segments import blobs, pose
from .sheet import Segment, SegmentSheet


class Field(IntEnum):
    """What is known of a segment; lengths in the unit of the plane, direction in rad."""

    X = 0
    Y = 1
    DIRECTION = 2
    LENGTH = 3
    WIDTH = 4
    AREA = 5


@dataclass(frozen=True)
class Seen:
    """Segments of one picture."""

    values: Float[np.ndarray, "segments 6"]  # see Field; nan where there is a reason why not
    reasons: list[Reason]


class Eye:
    """What finds the segments of a sheet in pictures of one size."""

    def __init__(self, sheet: SegmentSheet, size: tuple[int, int]):
        self.sheet = sheet
        self.plane: Plane = plane_of(sheet, size)
        segments = list(sheet.segments.values())
        self._groups = Groups(segments)
        of = self._groups.of
        self._across = [_across(segments[of.index(k)]) for k in range(self._groups.count)]
        self._alone = [of.count(k) == 1 for k in range(self._groups.count)]
        self._base = None
        if sheet.base is not None:
            u, v = (min(max(round(x), 0), n - 1) for x, n in zip(sheet.base, size, strict=True))
            self._base = self.plane.grid[v, u]

    def look(self, image: UInt8[np.ndarray, "height width 3"]) -> Seen:
        """Segments in a picture (blue, green, red); each picture is looked at by itself."""
        bits = self._groups.look(image)
        found = blobs(bits, self._alone, self.sheet.smallest)
        poses = [
            [one for blob in of_colour if (one := pose(blob, image, bits, self.plane, self.sheet.fit, across)).area > 0]
            for of_colour, across in zip(found, self._across, strict=True)
        ]
        row, reasons, directions = told_apart(poses, self._groups.of, self._base)
        values = np.full((len(row), len(Field)), np.nan)
        for s, (seen, direction) in enumerate(zip(row, directions, strict=True)):
            if seen is None:
                continue
            values[s] = (*seen.middle, np.nan, seen.length, seen.width, seen.area)
            if seen.cut:
                reasons[s] = Reason.EDGE
            elif direction is not None:
                values[s, Field.DIRECTION] = direction
        return Seen(values, reasons)


def _across(segment: Segment) -> bool:
    return segment.length is not None and segment.width is not None and segment.length < segment.width
