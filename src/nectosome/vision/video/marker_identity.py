"""Markers of a body in the pictures of several cameras: candidates by colour, identified by their distances.

Candidates are blobs of a marker's colour, with centroids to a fraction of a pixel.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations, islice, product

import numpy as np
from jaxtyping import Float, Int, UInt8

from nectosome.units import InputError
from nectosome.vision.cameras import Camera, triangulate

from .reasons import Reason
from .segments import ColourGroups, blobs, coverage
from .sheet import Colour

_TOUCH = 2  # px
_MOST = 20_000  # assignments tried in a frame
_CLEAR = 2.0  # factor by which the second best assignment must fit worse

Found = tuple[Int[np.ndarray, "cameras markers"], list[Reason]]
_Option = tuple[
    Int[np.ndarray, "cameras"], Float[np.ndarray, "3"]
]  # candidate of each camera, -1: none, and their position
_TOGETHER = 0.02  # [frame interval]: cameras within this are simultaneous


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


class MarkerBody:
    """Markers on a rigid body; finds them among candidates."""

    def __init__(
        self, at: Float[np.ndarray, "m 3"], groups: Sequence[int], misfit: float, tolerance: float, names: Sequence[str]
    ):
        self.at, self.groups, self.misfit, self.tolerance = at, list(groups), misfit, tolerance
        self.distances = _distances(at)
        self._refuse_twins(names)

    def _refuse_twins(self, names: Sequence[str]) -> None:
        """Raise InputError for two markers of one colour that can be exchanged unnoticed."""
        for a, b in combinations(range(len(self.at)), 2):
            if self.groups[a] != self.groups[b]:
                continue
            order = list(range(len(self.at)))
            order[a], order[b] = b, a
            off = np.abs(self.distances[np.ix_(order, order)] - self.distances).max()
            if off < 2 * self.tolerance:
                raise InputError(
                    f"cannot be distinguished from {names[b]}: they have one colour, and exchanging them changes "
                    f"distances by {1e3 * off:.2g} mm at most, with a tolerance of {1e3 * self.tolerance:.2g}"
                    " mm. Give them colours of their own, or move one.",
                    field=f"markers.{names[a]}",
                )

    def find(self, cameras: Sequence[Camera], seen: Sequence[Sequence[Sequence[Candidate]]]) -> Found:
        """Index of each marker's candidate by camera, -1 for none, and the reason if it has no position.

        `seen` has the candidates by camera and group. Positions are where the rays of two or more cameras meet within
        `misfit`. The assignment of positions to markers is the one with the body's distances, within `tolerance`, for
        as many markers as possible; if a second assignment fits as well, there is none.
        """
        m = len(self.at)
        picked = np.full((len(cameras), m), -1)
        reasons = [Reason.LOST] * m
        by_group = [self._matches(cameras, [groups[g] for groups in seen]) for g in range(max(self.groups) + 1)]
        options = [by_group[g] for g in self.groups]
        for count in range(m, 2, -1):
            assignments = [w for markers in combinations(range(m), count) for w in self._assignments(markers, options)]
            if not assignments:
                continue
            assignments.sort(key=lambda one: one[0])
            (off, best), *others = assignments
            if any(one != best and other < max(_CLEAR * off, 0.5 * self.tolerance) for other, one in others):
                return picked, [Reason.DOUBT if options[k] else Reason.LOST for k in range(m)]
            for marker, option in best.items():
                picked[:, marker] = options[marker][option][0]
                reasons[marker] = Reason.SEEN
            return picked, reasons
        for k in range(m):  # fewer than three: only a marker that cannot be another one gets a position
            alone = self.groups.count(self.groups[k]) == 1
            if alone and len(options[k]) == 1:
                picked[:, k], reasons[k] = options[k][0][0], Reason.SEEN
            elif options[k]:
                reasons[k] = Reason.DOUBT
        return picked, reasons

    def _matches(self, cameras: Sequence[Camera], seen: Sequence[Sequence[Candidate]]) -> list[_Option]:
        """Matching candidates of one group, those of most cameras first, and their positions."""
        rows = [row for row in product(*(range(-1, len(group)) for group in seen)) if sum(k >= 0 for k in row) > 1]
        if not rows:
            return []
        numbers = np.array(rows[:_MOST])
        pixels = np.full((len(cameras), len(numbers), 2), np.nan)
        for c, group in enumerate(seen):
            if group:
                table = np.array([candidate.pixel for candidate in group])
                there = numbers[:, c] >= 0
                pixels[c, there] = table[numbers[there, c]]
        places = triangulate(cameras, pixels, sd_px=1.0)
        good = (places.status == 0) & (places.residual < self.misfit)
        kept: list[_Option] = []
        for k in sorted(np.flatnonzero(good), key=lambda k: (-np.count_nonzero(numbers[k] >= 0), places.residual[k])):
            # skip part of a match of more cameras
            if not any(np.all((numbers[k] < 0) | (numbers[k] == row)) for row, _ in kept):
                kept.append((numbers[k], places.place[k]))
        return kept

    def _assignments(
        self, markers: tuple[int, ...],
        options: Sequence[Sequence[_Option]],
    ) -> list[tuple[float, dict[int, int]]]:  # fmt: skip
        """Assignments of positions to these markers, with the rms deviation of distances from the body's [m]."""
        assignments: list[tuple[float, dict[int, int]]] = []
        expected = self.distances[np.ix_(markers, markers)]
        pairs = np.triu_indices(len(markers), 1)
        for choice in islice(product(*(range(len(options[k])) for k in markers)), _MOST):
            rows = np.array([options[k][j][0] for k, j in zip(markers, choice, strict=True)])
            if self._shared(markers, rows):
                continue
            off = _distances(np.array([options[k][j][1] for k, j in zip(markers, choice, strict=True)])) - expected
            if np.abs(off).max() < self.tolerance:
                assignments.append((float(np.sqrt(np.mean(off[pairs] ** 2))), dict(zip(markers, choice, strict=True))))
        return assignments

    def _shared(self, markers: tuple[int, ...], rows: Int[np.ndarray, "k cameras"]) -> bool:
        """Whether two markers of a group take the same candidate."""
        return any(
            self.groups[markers[a]] == self.groups[markers[b]] and np.any((rows[a] == rows[b]) & (rows[a] >= 0))
            for a, b in combinations(range(len(markers)), 2)
        )


def _distances(places: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "m m"]:
    return np.linalg.norm(places[:, None] - places[None], axis=2)


@dataclass(frozen=True)
class Tracks:
    """Markers in the pictures: NaN if not visible in a camera, with the reason if too few cameras see it."""

    time: Float[np.ndarray, "t"]  # [s], of the first camera's frames in the common time
    pixels: Float[np.ndarray, "c t m 2"]
    areas: Float[np.ndarray, "c t m"]  # [px]
    reasons: Int[np.ndarray, "t m"]
    late: float  # largest time difference of matched frames [s]; 0: simultaneous


def identify_markers(cameras: Sequence[Camera], seen: Sequence[Sightings], body: MarkerBody) -> Tracks:
    """Identify a body's markers in all frames; raises InputError if the videos have no common time.

    Frames nearest in time are matched. If cameras are not simultaneous, pixels of the other cameras are interpolated
    linearly, between consecutive frames, at the times of the first one.
    """
    clocks = [np.array(own.time) for own in seen]
    begin, end = max(clock[0] for clock in clocks), min(clock[-1] for clock in clocks)
    usual = max(float(np.median(np.diff(clock))) if len(clock) > 1 else np.inf for clock in clocks)
    first = np.flatnonzero((clocks[0] >= begin - 0.5 * usual) & (clocks[0] <= end + 0.5 * usual))
    if not first.size:
        raise InputError(
            f"the videos have no common time: one begins at {begin:.4g} s, another ends at {end:.4g} s. Check the "
            "offsets of the cameras.",
            field="cameras",
        )
    time = clocks[0][first]
    count, m = len(cameras), len(body.at)
    pixels = np.full((count, len(time), m, 2), np.nan)
    areas = np.full((count, len(time), m), np.nan)
    frames = np.array([_nearest(clock, time) for clock in clocks])
    why = np.zeros((len(time), m), np.int8)
    for t in range(len(time)):
        now = [seen[c].groups[frames[c, t]] for c in range(count)]
        picked, why[t] = body.find(cameras, now)
        for c in range(count):
            for k in np.flatnonzero(picked[c] >= 0):
                candidate = now[c][body.groups[k]][picked[c, k]]
                pixels[c, t, k], areas[c, t, k] = candidate.pixel, candidate.area
    late = 0.0
    for c in range(1, count):
        off = float(np.max(np.abs(clocks[c][frames[c]] - time)))
        if off > _TOGETHER * usual:
            late = max(late, off)
            pixels[c] = _at(time, clocks[c][frames[c]], pixels[c], 1.5 * usual)
    return Tracks(time, pixels, areas, why, late)


def _nearest(clock: Float[np.ndarray, "n"], time: Float[np.ndarray, "t"]) -> Int[np.ndarray, "t"]:
    after = np.clip(np.searchsorted(clock, time), 1, max(len(clock) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(clock) - 1)
    return np.where(np.abs(clock[before] - time) <= np.abs(clock[after] - time), before, after)


def _at(
    time: Float[np.ndarray, "t"], own: Float[np.ndarray, "t"], pixels: Float[np.ndarray, "t m 2"], gap: float
) -> Float[np.ndarray, "t m 2"]:
    """Pixels at the first camera's times, by linear interpolation between consecutive frames of this camera."""
    out = np.full_like(pixels, np.nan)
    for k in range(pixels.shape[1]):
        known = np.flatnonzero(np.isfinite(pixels[:, k, 0]))
        known = known[np.concatenate([[True], np.diff(own[known]) > 0])] if known.size else known
        if known.size < 2:
            continue
        clock = own[known]
        after = np.clip(np.searchsorted(clock, time), 1, len(clock) - 1)
        low, high = clock[after - 1], clock[after]
        use = np.isin(time, clock) | ((low < time) & (time <= high) & (high - low <= gap))
        for d in range(2):
            out[use, k, d] = np.interp(time[use], clock, pixels[known, k, d])
    return out
