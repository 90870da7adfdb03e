"""Assignment of blobs to the segments of a chain, and the direction of each segment."""

from collections.abc import Sequence
from itertools import groupby, permutations, product

import numpy as np
from jaxtyping import Float

from .reasons import Reason
from .segments import SegmentPose

_ROUND = 1.25  # least ratio of length to width for a direction
_CLOSE = 1.5  # sums of gaps that differ by a smaller factor are ambiguous


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
    candidates: list[tuple[float, list[float | None], list[SegmentPose | None]]] = []
    for orders in product(*(permutations(poses[k]) for k in usable)):
        row: list[SegmentPose | None] = [None] * n
        for k, order in zip(usable, orders, strict=True):
            for s, pose in zip(places[k], order, strict=True):
                row[s] = pose
        candidates.append((*_directions(row, base), row))
    candidates.sort(key=lambda candidate: candidate[0])
    total, directions, row = candidates[0]
    second = candidates[1][0] if len(candidates) > 1 else np.inf
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
