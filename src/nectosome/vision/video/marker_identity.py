"""Which candidates of several cameras are which markers of a body: those whose places have the body's distances."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from jaxtyping import Float, Int

from nectosome.units import InputError
from nectosome.vision.cameras import Camera, triangulate

from .marker_candidates import Candidate, Sightings
from .reasons import Reason

_MOST = 20_000  # ways to tell candidates apart that are looked at in a frame
_CLEAR = 2.0  # the next best way must fit worse by this factor

Found = tuple[Int[np.ndarray, "cameras markers"], list[Reason]]
_Option = tuple[Int[np.ndarray, "cameras"], Float[np.ndarray, "3"]]  # candidates by camera, -1: none, and their place
_TOGETHER = 0.02  # of the time between frames: cameras that differ by less see the same moment


class MarkerBody:
    """Markers on a rigid body, and the way to find them among candidates."""

    def __init__(
        self, at: Float[np.ndarray, "m 3"], groups: Sequence[int], misfit: float, tolerance: float, names: Sequence[str]
    ):
        self.at, self.groups, self.misfit, self.tolerance = at, list(groups), misfit, tolerance
        self.distances = _distances(at)
        self._refuse_twins(names)

    def _refuse_twins(self, names: Sequence[str]) -> None:
        """Raise InputError where two markers of one colour could be exchanged and nothing would show it."""
        for a, b in combinations(range(len(self.at)), 2):
            if self.groups[a] != self.groups[b]:
                continue
            order = list(range(len(self.at)))
            order[a], order[b] = b, a
            off = np.abs(self.distances[np.ix_(order, order)] - self.distances).max()
            if off < 2 * self.tolerance:
                raise InputError(
                    f"cannot be told from {names[b]}: they are of one colour, and exchanged the distances of all "
                    f"markers are the same within {1e3 * off:.2g} mm, where the tolerance is {1e3 * self.tolerance:.2g}"
                    " mm. Give them colours of their own, or move one.",
                    field=f"markers.{names[a]}",
                )

    def find(self, cameras: Sequence[Camera], seen: Sequence[Sequence[Sequence[Candidate]]]) -> Found:
        """Number of each marker's candidate by camera, -1 where there is none; and the reason where it has no place.

        `seen` has the candidates by camera and group. Places are where the rays of two or more cameras meet within
        `misfit`; of all ways to give markers places the one is taken whose distances are those of the body, within
        `tolerance`, for as many markers as possible. Where a second way does as well there is none.
        """
        m = len(self.at)
        picked = np.full((len(cameras), m), -1)
        reasons = [Reason.LOST] * m
        by_group = [self._meet(cameras, [groups[g] for groups in seen]) for g in range(max(self.groups) + 1)]
        options = [by_group[g] for g in self.groups]
        for count in range(m, 2, -1):
            ways = [w for markers in combinations(range(m), count) for w in self._ways(markers, options)]
            if not ways:
                continue
            ways.sort(key=lambda way: way[0])
            best = ways[0]
            if any(_other(best, way) and way[0] < max(_CLEAR * best[0], 0.5 * self.tolerance) for way in ways[1:]):
                return picked, [Reason.DOUBT if options[k] else Reason.LOST for k in range(m)]
            for marker, option in best[1].items():
                picked[:, marker] = options[marker][option][0]
                reasons[marker] = Reason.SEEN
            return picked, reasons
        for k in range(m):  # fewer than three: a place of its own for a marker that cannot be another one
            alone = self.groups.count(self.groups[k]) == 1
            if alone and len(options[k]) == 1:
                picked[:, k], reasons[k] = options[k][0][0], Reason.SEEN
            elif options[k]:
                reasons[k] = Reason.DOUBT
        return picked, reasons

    def _meet(self, cameras: Sequence[Camera], seen: Sequence[Sequence[Candidate]]) -> list[_Option]:
        """Candidates of one group that belong together, by the most cameras, and their places."""
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
            # what is a part of a match of more cameras is that match
            if not any(np.all((numbers[k] < 0) | (numbers[k] == row)) for row, _ in kept):
                kept.append((numbers[k], places.place[k]))
        return kept

    def _ways(
        self, markers: tuple[int, ...],
        options: Sequence[Sequence[_Option]],
    ) -> list[tuple[float, dict[int, int]]]:  # fmt: skip
        """Ways to give these markers places, with the rms by which distances differ from the body's [m]."""
        ways: list[tuple[float, dict[int, int]]] = []
        wanted = self.distances[np.ix_(markers, markers)]
        pairs = np.triu_indices(len(markers), 1)
        for looked, choice in enumerate(product(*(range(len(options[k])) for k in markers))):
            if looked >= _MOST:
                break
            rows = np.array([options[k][j][0] for k, j in zip(markers, choice, strict=True)])
            if self._shared(markers, rows):
                continue
            off = _distances(np.array([options[k][j][1] for k, j in zip(markers, choice, strict=True)])) - wanted
            if np.abs(off).max() < self.tolerance:
                ways.append((float(np.sqrt(np.mean(off[pairs] ** 2))), dict(zip(markers, choice, strict=True))))
        return ways

    def _shared(self, markers: tuple[int, ...], rows: Int[np.ndarray, "k cameras"]) -> bool:
        """Whether two markers of a group take the same candidate."""
        return any(
            self.groups[markers[a]] == self.groups[markers[b]] and np.any((rows[a] == rows[b]) & (rows[a] >= 0))
            for a, b in combinations(range(len(markers)), 2)
        )


def _other(a: tuple[float, dict[int, int]], b: tuple[float, dict[int, int]]) -> bool:
    return a[1] != b[1]


def _distances(places: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "m m"]:
    return np.linalg.norm(places[:, None] - places[None], axis=2)


@dataclass(frozen=True)
class Tracks:
    """Markers in the pictures: nan where a camera does not see one, and the reason where too few cameras do."""

    time: Float[np.ndarray, "t"]  # [s], of the first camera's frames that all of them cover
    pixels: Float[np.ndarray, "c t m 2"]
    areas: Float[np.ndarray, "c t m"]  # [px]
    reasons: Int[np.ndarray, "t m"]
    late: float  # most that frames taken together differ in time [s]; 0: the same moments


def followed(cameras: Sequence[Camera], seen: Sequence[Sightings], body: MarkerBody) -> Tracks:
    """Follow a body's markers through all frames; raises InputError where the videos have no time together.

    Frames are taken together that are nearest in time. Where cameras do not see the same moments, pixels of the others
    are taken at the first one's, straight between two frames that are next to each other.
    """
    clocks = [np.array(own.time) for own in seen]
    begin, end = max(clock[0] for clock in clocks), min(clock[-1] for clock in clocks)
    usual = max(float(np.median(np.diff(clock))) if len(clock) > 1 else np.inf for clock in clocks)
    first = np.flatnonzero((clocks[0] >= begin - 0.5 * usual) & (clocks[0] <= end + 0.5 * usual))
    if not first.size:
        raise InputError(
            f"the videos have no time together: one begins at {begin:.4g} s, another ends at {end:.4g} s. Look at the "
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
    """Pixels at the first camera's times, straight between frames of this one that are next to each other."""
    out = np.full_like(pixels, np.nan)
    for k in range(pixels.shape[1]):
        known = np.flatnonzero(np.isfinite(pixels[:, k, 0]))
        known = known[np.concatenate([[True], np.diff(own[known]) > 0])] if known.size else known
        if known.size < 2:
            continue
        clock = own[known]
        after = np.searchsorted(clock, time)
        inside = (after > 0) & (after < len(clock))
        low, high = clock[np.clip(after - 1, 0, len(clock) - 1)], clock[np.clip(after, 0, len(clock) - 1)]
        exact = np.isin(time, clock)
        use = exact | (inside & (high - low <= gap))
        for d in range(2):
            out[use, k, d] = np.interp(time[use], clock, pixels[known, k, d])
    return out
