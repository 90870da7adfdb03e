r"""How far the resolution of a valve is known: chi2 goes in steps as it changes.

With another resolution the valve's steps have another height, and come at other times: where one comes a sample earlier
or later chi2 jumps, and in between it hardly changes. So derivatives say nothing of the interval. It reaches to where
the best that can be done is worse by `stepwise_threshold`, all else fitted to first order.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from ..fits.identifiability import Interval
from ..fits.intervals import stepwise_threshold

_APART = np.geomspace(1e-6, 1.0, 73)  # relative, of values by which an end is looked for
_TURNS = 6  # in which they are tried, the nearest ones first


def stepwise_interval(
    chi2: Callable[[Float[np.ndarray, "m"]], Float[np.ndarray, "m"]], best: float, bounds: tuple[float, float]
) -> Interval:
    """95 % interval of a parameter from its best value on, by chi2 at several values.

    Values are tried outwards until those of a whole decade fit worse. An end is the one after the last that fits, or a
    bound where there is none.
    """
    least, ends = float(chi2(np.array([best]))[0]), list[float]()
    for sign, bound in zip((-1.0, 1.0), bounds, strict=True):
        end, tried = bound, np.zeros((2, 0))
        for apart in np.array_split(_APART, _TURNS):
            values = np.clip(best * (1 + sign * apart), *bounds)
            tried = np.concatenate([tried, np.stack([values, chi2(values)])], axis=1)
            least = min(least, float(tried[1].min()))
            if np.all(tried[1, -apart.size :] > least + stepwise_threshold()):
                break
        within = np.flatnonzero(tried[1] <= least + stepwise_threshold())
        last = int(within[-1]) + 1 if within.size else 0
        if last < tried.shape[1]:
            end = float(tried[0, last])
        ends.append(end)
    return Interval(ends[0], ends[1], ends[0] > bounds[0], ends[1] < bounds[1])
