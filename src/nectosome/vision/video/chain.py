"""Assignment of blobs to the segments of a chain, and the direction of each segment."""

from collections.abc import Sequence
from itertools import permutations, product

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
    best: tuple[float, list[SegmentPose | None], list[float | None]] | None = None
    second = np.inf
    for orders in product(*(permutations(poses[k]) for k in usable)):
        row: list[SegmentPose | None] = [None] * n
        for k, order in zip(usable, orders, strict=True):
            for s, pose in zip(places[k], order, strict=True):
                row[s] = pose
        total, directions = _directions(row, base)
        if best is None or total < best[0]:
            second = best[0] if best is not None else np.inf
            best = (total, row, directions)
        else:
            second = min(second, total)
    assert best is not None
    total, row, directions = best
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
    run: list[int] = []
    for s in [*range(len(row)), None]:
        if s is not None and row[s] is not None:
            run.append(s)
            continue
        start = base if run and run[0] == 0 else None
        if len(run) > 1 or (run and start is not None):
            gaps, found = _shortest_chain([row[k] for k in run], start)
            total += gaps
            directions[run[0] : run[-1] + 1] = found
        run = []
    return total, directions


def _shortest_chain(
    poses: Sequence[SegmentPose | None], start: Float[np.ndarray, "2"] | None
) -> tuple[float, list[float | None]]:
    """Shortest chain of successive segments, by dynamic programming over their two directions."""
    ends = None  # end of the segment before, for each of its directions
    cost = np.zeros(2)
    came: list[list[int]] = []
    for pose in poses:
        assert pose is not None
        half = 0.5 * pose.length * np.array([np.cos(pose.axis), np.sin(pose.axis)])
        starts = [pose.middle - half, pose.middle + half]
        if ends is None:
            cost = np.array([0.0 if start is None else float(np.linalg.norm(p - start)) for p in starts])
            came.append([0, 0])
        else:
            gaps = np.array(
                [[c + float(np.linalg.norm(p - e)) for e, c in zip(ends, cost, strict=True)] for p in starts]
            )
            came.append([int(np.argmin(row)) for row in gaps])
            cost = gaps.min(axis=1)
        ends = [pose.middle + half, pose.middle - half]
    turned = int(np.argmin(cost))
    total = float(cost[turned])
    found: list[float | None] = []
    for pose, back in zip(reversed(poses), reversed(came), strict=True):
        assert pose is not None
        found.append(pose.axis + np.pi * turned)
        turned = back[turned]
    return total, found[::-1]
