"""Maps that take points nearest to others that belong to them: a rotation with a shift, alone or despite outliers."""

from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

_TRIALS = 500  # subsets that are tried where there are more
_SIGMAS = 2.5  # of the scatter: what lies farther off is an outlier


class RigidMap(NamedTuple):
    """x -> rotation x + translation."""

    rotation: Float[np.ndarray, "d d"]
    translation: Float[np.ndarray, "d"]

    def __call__(self, points: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
        """The points moved."""
        return points @ self.rotation.T + self.translation


def align_points(points: Float[np.ndarray, "n d"], targets: Float[np.ndarray, "n d"]) -> RigidMap:
    r"""Rotation R and translation T with the least $\sum_k |e_k - (R s_k + T)|^2$, points s to targets e.

    With centred points $H = \sum_k s_k e_k^T = U \Lambda V^T$ (Arun et al. 1987)

    $$ R = V \mathrm{diag}(1, \dots, 1, \det V U^T) U^T, \quad T = \bar e - R \bar s $$

    where the last sign makes a rotation of what would be a reflection (Umeyama 1991; Hu et al. 2024, algorithm 1, gives
    up there). Points of fewer than d - 1 dimensions do not determine R: of all it takes one. All axes count alike:
    scale them first. Raises ValueError without points.
    """
    if len(points) == 0:
        raise ValueError("align_points: no points; at least one is needed.")
    s, e = points.mean(axis=0), targets.mean(axis=0)
    U, _, Vt = np.linalg.svd((points - s).T @ (targets - e))
    signs = np.ones(len(s))
    signs[-1] = np.sign(np.linalg.det(Vt.T @ U.T))
    R = Vt.T @ np.diag(signs) @ U.T
    return RigidMap(R, e - R @ s)


def align_inliers(
    points: Float[np.ndarray, "n d"], targets: Float[np.ndarray, "n d"]
) -> tuple[RigidMap, Bool[np.ndarray, "n"]]:
    r"""`align_points` without outliers, and which points were kept.

    Of the maps that d points each determine, all of them or 500 drawn at random, the one with the least median of
    squares (Rousseeuw 1984), a RANSAC that needs no threshold. Its scatter $1.4826 (1 + 5/(n - d)) \sqrt{\mathrm{med}}$
    is that of normal errors; what is at most 2.5 times as far off is aligned. With fewer than 2 d points all are kept.
    """
    n, d = points.shape
    if n < 2 * d:
        return align_points(points, targets), np.ones(n, bool)
    if comb(n, d) <= _TRIALS:
        subsets = [list(s) for s in combinations(range(n), d)]
    else:
        rng = np.random.default_rng(0)
        subsets = [rng.choice(n, d, replace=False) for _ in range(_TRIALS)]
    far = [np.linalg.norm(targets - align_points(points[k], targets[k])(points), axis=1) for k in subsets]
    best = min(far, key=np.median)
    scatter = 1.4826 * (1 + 5 / (n - d)) * float(np.median(best))
    kept = best <= max(_SIGMAS * scatter, 1e-12 * float(np.abs(targets).max()))
    return align_points(points[kept], targets[kept]), kept
