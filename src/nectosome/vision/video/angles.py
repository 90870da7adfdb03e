"""Tracking of a chain of segments in a video: positions, directions and joint angles, with quality and reasons."""

import json
from collections.abc import Iterator, Sequence
from enum import IntEnum
from heapq import nsmallest
from itertools import groupby, pairwise, permutations, product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from nectosome.io import provenance

from .clip import Clip, Progress, clip_of, intervals
from .plane import MotionPlane, plane_of
from .reasons import Reason, loss_notes
from .segments import ColourGroups, SegmentPose, blobs, segment_pose
from .sheet import SegmentSheet

if TYPE_CHECKING:
    import xarray as xr

_ROUND = 1.25  # least ratio of length to width for a direction
_CLOSE = 1.5  # sums of gaps that differ by a smaller factor are ambiguous
_SCATTERS = 6.0  # accepted standard deviations
_DOUBTFUL = 0.1  # relative deviation from a given size that casts doubt on the scale


class SegmentField(IntEnum):
    """Measured values of a segment; lengths in the unit of the plane, direction in rad."""

    X = 0
    Y = 1
    DIRECTION = 2
    LENGTH = 3
    WIDTH = 4
    AREA = 5


class SegmentFinder:
    """Finds the segments of a sheet in pictures of one size."""

    def __init__(self, sheet: SegmentSheet, size: tuple[int, int]):
        self.sheet = sheet
        self.plane: MotionPlane = plane_of(sheet, size)
        segments = list(sheet.segments.values())
        self._groups = ColourGroups(segments)
        of = self._groups.of
        owners = [segments[of.index(k)] for k in range(self._groups.count)]
        self._across = [s.length is not None and s.width is not None and s.length < s.width for s in owners]
        self._alone = [of.count(k) == 1 for k in range(self._groups.count)]
        self._base = None
        if sheet.base is not None:
            u, v = (min(max(round(x), 0), n - 1) for x, n in zip(sheet.base, size, strict=True))
            self._base = self.plane.grid[v, u]

    def find(self, image: UInt8[np.ndarray, "height width 3"]) -> tuple[Float[np.ndarray, "segments 6"], list[Reason]]:
        """Segments in one picture (blue, green, red): values by SegmentField, NaN if the reason says so."""
        bits = self._groups.find(image)
        found = blobs(bits, self._alone, self.sheet.smallest)
        fit = self.sheet.fit
        poses = [
            [one for blob in of_colour if (one := segment_pose(blob, image, bits, self.plane, fit, across)).area > 0]
            for of_colour, across in zip(found, self._across, strict=True)
        ]
        row, reasons, directions = assign_segments(poses, self._groups.of, self._base)
        values = np.full((len(row), len(SegmentField)), np.nan)
        for s, (seen, direction) in enumerate(zip(row, directions, strict=True)):
            if seen is None:
                continue
            values[s] = (*seen.middle, np.nan, seen.length, seen.width, seen.area)
            if seen.cut:
                reasons[s] = Reason.EDGE
            elif direction is not None:
                values[s, SegmentField.DIRECTION] = direction
        return values, reasons


_SIZES = {  # least and most deviation (of the logarithm) that is accepted
    SegmentField.LENGTH: (0.04, 0.1),
    SegmentField.WIDTH: (0.15, 0.3),
    SegmentField.AREA: (0.06, 0.2),
}


def size_quality(values: Float[np.ndarray, "t s 6"], why: Int[np.ndarray, "t s"]) -> Float[np.ndarray, "t s"]:
    """Quality of each segment from 0 to 1; sets MERGED or COVERED in `why` for an unusual length, width or area.

    The usual size is the median over all frames; the accepted deviation follows from the scatter (median absolute
    deviation) of all frames, within limits. The quality is the product of the ratios of area and length to their usual
    values, each ratio at most 1.
    """
    quality = np.zeros(why.shape)
    for s in range(why.shape[1]):
        known = (why[:, s] != Reason.EDGE) & np.isfinite(values[:, s, SegmentField.AREA])
        if not known.any():
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            off = {k: np.log(values[:, s, k] / np.median(values[known, s, k])) for k in _SIZES}
        quality[known, s] = np.exp(-np.abs(off[SegmentField.AREA]) - np.abs(off[SegmentField.LENGTH]))[known]
        larger, smaller = np.zeros(len(why), bool), np.zeros(len(why), bool)
        for k, limits in _SIZES.items():
            more, less = unusual(off[k], known, *limits)
            larger, smaller = larger | more, smaller | less
        fresh = np.isin(why[:, s], (Reason.SEEN, Reason.DIRECTION, Reason.ROUND))
        why[fresh & larger, s] = Reason.MERGED
        why[fresh & smaller, s] = Reason.COVERED
    return quality


def unusual(
    off: Float[np.ndarray, "t"], known: Bool[np.ndarray, "t"], least: float, most: float
) -> tuple[Bool[np.ndarray, "t"], Bool[np.ndarray, "t"]]:
    """Masks of too large and too small sizes, from the logarithms of size over usual size and their scatter.

    The accepted deviation is at least `least` and at most `most`.
    """
    scatter = 1.4826 * float(np.median(np.abs(off[known])))
    allowed = min(max(_SCATTERS * scatter, least), most)
    return known & (off > allowed), known & ~(off >= -allowed)


def track_segments(
    video: str | Path,
    sheet: SegmentSheet,
    progress: Progress = lambda what, share: None,
) -> "xr.Dataset":
    """Track a chain of segments through a video.

    The dataset has, over `time` [s]: `position` (segment, axis) of each segment's centre [m; px without a scale];
    `direction` [rad] from its start to its end, counter-clockwise from x, without jumps at +-180 deg: the usual one is
    within half a turn of that of the segment before, of the first one of x; `joint_angle` (joint) [rad], the direction
    relative to the segment before, likewise; `length` and `width`; `quality` of each segment from 0 to 1;
    `reason` (segment), one of `Reason`. Values with a reason are NaN, except position and size of a segment with only
    its direction unknown. Missing frames have no row; `gaps` lists them. Raises InputError.
    """
    advice = "Pixels of the sheet (points, origin, base, lens) would be wrong."
    clip = clip_of(video, sheet.rate, sheet.size, "the sheet is for", advice)
    finder = SegmentFinder(sheet, clip.size)
    frames = [(frame.time, *finder.find(frame.image)) for frame in clip.frames(progress)]
    time, values, why = zip(*frames, strict=True)
    return _dataset(clip, finder, np.array(time), np.array(values), np.array(why, np.int8))


def _dataset(
    clip: Clip,
    finder: SegmentFinder,
    time: Float[np.ndarray, "t"],
    values: Float[np.ndarray, "t s 6"],
    why: Int[np.ndarray, "t s"],
) -> "xr.Dataset":
    import xarray as xr

    sheet, unit = finder.sheet, finder.plane.unit
    names = list(sheet.segments)
    quality = size_quality(values, why)
    bad = why != Reason.SEEN
    values = values.copy()
    values[~np.isin(why, (Reason.SEEN, Reason.DIRECTION, Reason.ROUND))] = np.nan
    direction = np.where(bad, np.nan, values[..., SegmentField.DIRECTION])
    direction, turn = along_chain(direction)
    joints = [f"{a}-{b}" for a, b in pairwise(names)]
    gaps, odd = intervals(time, clip)
    attrs = {
        "title": sheet.about or clip.path.name,
        "reasons": json.dumps({int(reason): reason.reason for reason in Reason}),
        "gaps": json.dumps(gaps),
        "provenance": json.dumps(
            provenance({"sheet": sheet.model_dump(mode="json")})
            | {
                "file": str(clip.path),
                "reader": clip.description,
                "found": _found(finder.plane),
                "warnings": [*odd, *_sizes(sheet, values, bad), *loss_notes(names, why)],
            }
        ),
    }
    return xr.Dataset(
        {
            "position": (("time", "segment", "axis"), values[..., : SegmentField.DIRECTION], {"units": unit}),
            "direction": (("time", "segment"), direction, {"units": "rad"}),
            "joint_angle": (("time", "joint"), turn, {"units": "rad"}),
            "length": (("time", "segment"), values[..., SegmentField.LENGTH], {"units": unit}),
            "width": (("time", "segment"), values[..., SegmentField.WIDTH], {"units": unit}),
            "quality": (("time", "segment"), quality, {"units": "1"}),
            "reason": (("time", "segment"), why, {"units": "1"}),
        },
        coords={"time": ("time", time, {"units": "s"}), "segment": names, "joint": joints, "axis": ["x", "y"]},
        attrs=attrs,
    )


def _found(plane: MotionPlane) -> list[str]:
    notes = [f"a pixel is {1e3 * plane.pixel:.4g} mm"] if plane.unit == "m" else ["no scale: places are in pixels"]
    return notes + ([f"known points are {plane.residual:.2g} px off (rms)"] if plane.residual is not None else [])


def _sizes(sheet: SegmentSheet, values: Float[np.ndarray, "t s 6"], bad: np.ndarray) -> Iterator[str]:
    for s, (name, segment) in enumerate(sheet.segments.items()):
        seen = values[~bad[:, s], s]
        for k, what in ((SegmentField.LENGTH, "length"), (SegmentField.WIDTH, "width")):
            stated = getattr(segment, what)
            if stated is not None and len(seen):
                usual = float(np.median(seen[:, k]))
                if abs(usual / stated - 1) > _DOUBTFUL and (what == "length" or usual > 1.5 * stated):
                    sizes = f"{1e3 * usual:.3g} mm in the pictures and {1e3 * stated:.3g} mm in the sheet"
                    yield f"{name}: its {what} is {sizes}. Check the pixel size in the sheet."


def along_chain(
    direction: Float[np.ndarray, "t s"],
) -> tuple[Float[np.ndarray, "t s"], Float[np.ndarray, "t joints"]]:
    """Directions and angles of joints [rad] without jumps by whole turns; directions are in (-pi, pi], NaN where lost.

    From the segment that is lost least on, each direction is that of the one beside it and the angle of the joint
    between: also where a segment was lost while the chain went round.
    """
    turn, direction = _continuous(np.diff(direction, axis=1)), _continuous(direction)
    first, last = int(np.isfinite(direction).sum(axis=0).argmax()), turn.shape[1]
    for k, known in [*((k + 1, k) for k in range(first, last)), *((k, k + 1) for k in reversed(range(first)))]:
        between = turn[:, min(k, known)] * (k - known)
        off = np.round((direction[:, k] - direction[:, known] - between) / (2 * np.pi))
        seen = np.flatnonzero(np.isfinite(off))
        if seen.size:  # elsewhere as at the last time that both were seen
            before = np.searchsorted(seen, np.arange(len(off)), side="right") - 1
            direction[:, k] -= 2 * np.pi * off[seen[np.maximum(before, 0)]]
    return direction, turn


def _continuous(angle: Float[np.ndarray, "t k"]) -> Float[np.ndarray, "t k"]:
    """Angles without jumps by whole turns; the median of each column is between -pi and pi."""
    out = angle.copy()
    for column in out.T:
        if (known := np.isfinite(column)).any():
            column[known] = np.unwrap(column[known])
            column -= 2 * np.pi * np.round(np.median(column[known]) / (2 * np.pi))
    return out


def assign_segments(
    poses: Sequence[Sequence[SegmentPose]], colours: Sequence[int], base: Float[np.ndarray, "2"] | None
) -> tuple[list[SegmentPose | None], list[Reason], list[float | None]]:
    """Pose, reason and direction [rad] of each segment, whose colour is `colours[segment]`.

    `poses` are by colour. The order of segments of one colour, and all directions, are those with the smallest sum of
    gaps along the chain from the end of a segment to the start of the next one; the first gap is from `base`.
    """
    n = len(colours)
    reasons = [Reason.SEEN] * n
    places: list[list[int]] = [[s for s in range(n) if colours[s] == k] for k in range(len(poses))]
    for k, found in enumerate(poses):
        if len(found) != len(places[k]):
            short = Reason.LOST if not found or len(places[k]) == 1 else Reason.MERGED
            for s in places[k]:
                reasons[s] = short if len(found) < len(places[k]) else Reason.PIECES
    usable = [k for k, found in enumerate(poses) if len(found) == len(places[k])]

    def candidates() -> Iterator[tuple[float, list[float | None], list[SegmentPose | None]]]:
        for orders in product(*(permutations(poses[k]) for k in usable)):
            row: list[SegmentPose | None] = [None] * n
            for k, order in zip(usable, orders, strict=True):
                for s, pose in zip(places[k], order, strict=True):
                    row[s] = pose
            yield (*_directions(row, base), row)

    (total, directions, row), *others = nsmallest(2, candidates(), key=lambda candidate: candidate[0])
    second = others[0][0] if others else np.inf
    several = [s for k in usable if len(places[k]) > 1 for s in places[k]]
    if several and second < _CLOSE * total:
        for s in several:
            row[s], directions[s], reasons[s] = None, None, Reason.DOUBT
    for s, pose in enumerate(row):
        if pose is not None and pose.length < _ROUND * pose.width and directions[s] is not None:
            directions[s], reasons[s] = None, Reason.ROUND
        elif pose is not None and directions[s] is None:
            reasons[s] = Reason.DIRECTION
    return row, reasons, directions


def _directions(
    row: Sequence[SegmentPose | None], base: Float[np.ndarray, "2"] | None
) -> tuple[float, list[float | None]]:
    """Least sum of gaps, and its directions; None for a segment without visible neighbours."""
    directions: list[float | None] = [None] * len(row)
    total = 0.0
    for _, group in groupby(enumerate(row), key=lambda item: item[1] is None):
        run = [(s, pose) for s, pose in group if pose is not None]
        start = base if run and run[0][0] == 0 else None
        if len(run) > 1 or start is not None:
            gaps, found = _shortest_chain([pose for _, pose in run], start)
            total += gaps
            directions[run[0][0] : run[-1][0] + 1] = found
    return total, directions


def _shortest_chain(
    poses: Sequence[SegmentPose], start: Float[np.ndarray, "2"] | None
) -> tuple[float, list[float | None]]:
    """Shortest chain of successive segments, by dynamic programming over their two directions."""
    ends = [] if start is None else [start]  # of the segment before, for each of its directions
    cost = np.zeros(len(ends))
    came: list[list[int]] = []
    for pose in poses:
        half = 0.5 * pose.length * np.array([np.cos(pose.axis), np.sin(pose.axis)])
        starts = [pose.middle - half, pose.middle + half]
        gaps = [[c + float(np.linalg.norm(p - e)) for e, c in zip(ends, cost, strict=True)] or [0.0] for p in starts]
        came.append(np.argmin(gaps, axis=1).tolist())
        cost = np.min(gaps, axis=1)
        ends = [pose.middle + half, pose.middle - half]
    turned = int(np.argmin(cost))
    total = float(cost[turned])
    found: list[float | None] = []
    for pose, back in zip(reversed(poses), reversed(came), strict=True):
        found.append(pose.axis + np.pi * turned)
        turned = back[turned]
    return total, found[::-1]
