r"""Scatter of repeats, pooled over conditions: of a few repeats each, all together say how far one mean is off.

Repeats scatter by a constant and by a share of their mean, $\sigma_k = s \sqrt{r^2 + \bar x_k^2}$ with r of most
likelihood and $s^2 = \sum_{ki} (x_{ki} - \bar x_k)^2 / (r^2 + \bar x_k^2) / \sum_k (n_k - 1)$ over all conditions k.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

_CONSTANT = np.geomspace(1e-3, 10, 41)  # of the largest mean: sizes below it scatter alike
_FAR = 6.0  # robust standard deviations: a repeat farther off is left out
_FEW = 6  # deviations, below which two that agree by chance would make any third one far


def pooled_errors(groups: Sequence[Sequence[float]]) -> tuple[Float[np.ndarray, "k"], int]:
    """Standard error of the mean of each group by the pooled scatter, NaN without repeats; its degrees of freedom."""
    counts = np.array([len(x) for x in groups])
    means = np.array([np.mean(x) for x in groups])
    off = [np.array(x) - mean if len(x) > 1 else np.zeros(0) for x, mean in zip(groups, means, strict=True)]
    free = int(np.sum(counts - 1))
    if not free:
        return np.full(len(counts), np.nan), 0
    size = _sizes(off, np.abs(means), 1 - 1 / counts, 2)
    squares = sum(np.sum((d / x) ** 2) for d, x in zip(off, size, strict=True))
    return np.sqrt(squares / free / counts) * size, free


def near_the_others(groups: Sequence[Sequence[float]]) -> list[Bool[np.ndarray, "_"]]:
    """Which repeats of each group are not far off: of three and more, within 6 pooled robust standard deviations.

    All are near where fewer than six deviations are known.
    """
    means = [np.array(x) for x in groups]
    at = np.array([abs(np.median(x)) for x in means])
    off = [np.abs(x - np.median(x)) for x in means]
    # the least deviation of a group has no information: it is 0, or that of two repeats is the same
    others = [np.sort(d)[1:] * np.sqrt(len(d) / (len(d) - 1)) if len(d) > 1 else d[:0] for d in off]
    if sum(map(len, others)) < _FEW:
        return [np.ones(len(d), bool) for d in off]
    size = _sizes(others, at, np.ones(len(at)), 1)
    z = np.concatenate([d / x for d, x in zip(others, size, strict=True)])
    far = _FAR * 1.4826 * np.sort(z)[(len(z) - 1) // 2] * size + 1e-9 * at.max()
    return [(d <= most) | (len(d) < 3) for d, most in zip(off, far, strict=True)]


def _sizes(
    off: Sequence[Float[np.ndarray, "_"]], at: Float[np.ndarray, "k"], weight: Float[np.ndarray, "k"], power: int
) -> Float[np.ndarray, "k"]:
    r"""Sizes $\sqrt{r^2 + x_k^2}$ that deviations are in proportion to, with the likeliest of some r.

    The least, which makes it a share, where no other's log-likelihood is higher by more than 1 (Akaike 1974). As of
    normal deviations for the power 2, and of Laplace's, which outliers change less, for 1.
    """
    k = np.repeat(np.arange(len(at)), [len(d) for d in off])
    z, w = np.abs(np.concatenate(off)), weight[k]
    candidates = []
    for r in _CONSTANT * max(at.max(), 1e-300):
        size = np.hypot(r, at)
        scale = (np.sum((z / size[k]) ** power) / w.sum()) ** (1 / power)
        candidates.append((float(w @ (np.log(max(scale, 1e-300)) + np.log(size[k]))), r))
    best = min(candidates)
    return np.hypot(best[1] if best[0] < candidates[0][0] - 1 else candidates[0][1], at)
