"""Which blob is which segment of a chain, and which way each one points."""

from collections.abc import Sequence
from itertools import permutations, product

import numpy as np
from jaxtyping import Float

from .reasons import Reason
from .segments import SegmentPose

_ROUND = 1.25  # a segment must be longer than wide by this, to have a direction
_CLOSE = 1.5  # sums of gaps that differ by less than this factor are a doubt


def told_apart(
    poses: Sequence[Sequence[SegmentPose]], colours: Sequence[int], base: Float[np.ndarray, "2"] | None
) -> tuple[list[SegmentPose | None], list[Reason], list[float | None]]:
    """Pose, reason and direction [rad] of each segment, whose colour is `colours[segment]`.

    `poses` are by colour. Segments of one colour are told apart, and the directions of all, by the way through all seen
    ones in which the gaps from end to start, the first of them from `base`, are smallest in sum.
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
        total, directions = _directed(row, base)
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


def _directed(
    row: Sequence[SegmentPose | None], base: Float[np.ndarray, "2"] | None
) -> tuple[float, list[float | None]]:
    """Least sum of gaps, and the directions that have it; None where no neighbour is seen."""
    directions: list[float | None] = [None] * len(row)
    total = 0.0
    run: list[int] = []
    for s in [*range(len(row)), None]:
        if s is not None and row[s] is not None:
            run.append(s)
            continue
        start = base if run and run[0] == 0 else None
        if len(run) > 1 or (run and start is not None):
            gaps, found = _run([row[k] for k in run], start)
            total += gaps
            directions[run[0] : run[-1] + 1] = found
        run = []
    return total, directions


def _run(poses: Sequence[SegmentPose | None], start: Float[np.ndarray, "2"] | None) -> tuple[float, list[float | None]]:
    """Shortest way through segments that follow each other, by dynamic programming over their two directions."""
    ends = None  # where the one before ends, for each of its directions
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
            came.append([int(np.argmin(way)) for way in gaps])
            cost = gaps.min(axis=1)
        ends = [pose.middle + half, pose.middle - half]
    way = int(np.argmin(cost))
    total = float(cost[way])
    found: list[float | None] = []
    for pose, back in zip(reversed(poses), reversed(came), strict=True):
        assert pose is not None
        found.append(pose.axis + np.pi * way)
        way = back[way]
    return total, found[::-1]
