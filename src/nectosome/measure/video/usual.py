"""What is not as large as it usually is: merged with something, or covered in part."""

import numpy as np
from jaxtyping import Bool, Float, Int

from .eye import Field
from .reasons import Reason

_SIZES = {Field.LENGTH: (0.04, 0.1), Field.WIDTH: (0.15, 0.3), Field.AREA: (0.06, 0.2)}  # least and most let pass
_SCATTERS = 6.0  # standard deviations that are let pass


def judged(values: Float[np.ndarray, "t s 6"], why: Int[np.ndarray, "t s"]) -> Float[np.ndarray, "t s"]:
    """Quality of each segment from 0 to 1; `why` gets MERGED or COVERED where length, width or area is not the usual.

    The usual size is the median over all frames; how far one may be off is told by the scatter of all frames (the
    median deviation), within limits. The quality is the ratio of area and usual area, times that of length and usual
    length, each the smaller one to the larger one: 1 where a segment is as always.
    """
    quality = np.zeros(why.shape)
    for s in range(why.shape[1]):
        known = (why[:, s] != Reason.EDGE) & np.isfinite(values[:, s, Field.AREA])
        if not known.any():
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            off = {k: np.log(values[:, s, k] / np.median(values[known, s, k])) for k in _SIZES}
        quality[known, s] = np.exp(-np.abs(off[Field.AREA]) - np.abs(off[Field.LENGTH]))[known]
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
    """Where logarithms of sizes over the usual one are too large, and too small, for the scatter of those known.

    From `least` to `most` is let pass, whatever the scatter.
    """
    scatter = 1.4826 * float(np.median(np.abs(off[known])))
    allowed = min(max(_SCATTERS * scatter, least), most)
    return known & (off > allowed), known & ~(off >= -allowed)
