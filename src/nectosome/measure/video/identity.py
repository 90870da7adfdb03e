"""Which candidates of several cameras are which markers of a body: those whose places have the body's distances."""

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
from jaxtyping import Float, Int

from nectosome.io.errors import InputError
from nectosome.measure.cameras import Camera, triangulate

from .candidates import Candidate
from .reasons import Reason

_MOST = 20_000  # ways to tell candidates apart that are looked at in a frame
_CLEAR = 2.0  # the next best way must fit worse by this factor

Found = tuple[Int[np.ndarray, "cameras markers"], list[Reason]]
_Option = tuple[Int[np.ndarray, "cameras"], Float[np.ndarray, "3"]]  # candidates by camera, -1: none, and their place


class Body:
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
