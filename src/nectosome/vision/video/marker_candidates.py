"""Marker candidates in a picture: blobs of a marker's colour, with centroids to a fraction of a pixel."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, UInt8

from .segments import ColourGroups, blobs, coverage
from .sheet import Colour

_TOUCH = 2  # px


@dataclass(frozen=True)
class Candidate:
    """A blob: its centroid [px], weighted by the coverage of each pixel, and its area [px].

    The area is 0 if another colour touches the blob, which may then be partly covered.
    """

    pixel: tuple[float, float]
    area: float


class MarkerFinder:
    """Finds candidates in pictures; markers of one colour form a group."""

    def __init__(self, colours: Sequence[Colour], smallest: int):
        self.groups = ColourGroups(colours)
        self._smallest = smallest

    def find(self, image: UInt8[np.ndarray, "height width 3"]) -> list[list[Candidate]]:
        """Candidates of each group in a picture (blue, green, red), the largest first, without those at its edge."""
        bits = self.groups.find(image)
        found: list[list[Candidate]] = []
        for of_colour in blobs(bits, [False] * self.groups.count, self._smallest):
            group = []
            for blob in of_colour:
                if blob.cut:
                    continue
                (rows, columns), share = coverage(blob, image, bits)
                total = float(share.sum())
                if not total:  # no contrast
                    continue
                u = columns.start + float(share.sum(0) @ np.arange(share.shape[1])) / total
                v = rows.start + float(share.sum(1) @ np.arange(share.shape[0])) / total
                top, left = max(blob.top - _TOUCH, 0), max(blob.left - _TOUCH, 0)
                about = bits[top : blob.top + blob.height + _TOUCH, left : blob.left + blob.width + _TOUCH]
                touched = bool(np.any(about & ~np.uint8(1 << blob.colour)))
                group.append(Candidate((u, v), 0.0 if touched else total))
            found.append(group)
        return found


@dataclass
class Sightings:
    """All candidates of one camera, frame by frame."""

    time: list[float] = field(default_factory=list)
    groups: list[list[list[Candidate]]] = field(default_factory=list)  # of each frame


def without_lamps(groups: list[list[Candidate]], lamps: Float[np.ndarray, "n 2"], near: float) -> list[list[Candidate]]:
    """Candidates that are not within `near` [px] of a lamp."""
    return [[c for c in group if np.min(np.hypot(*(lamps - c.pixel).T)) > near] for group in groups]
