"""When a computed number counts as zero."""

import math
from typing import Any

ROUNDING = 1e-9  # [largest number of the kind]: solvers leave residuals of 1e-10, sums of doubles less
CLOSED = 1e-5  # [largest magnitude over time] of a mean: cycles close to 1e-6 a step, those with contacts less closely


def counts_as_zero(value: Any, largest: Any, peak: Any = 0.0, closed: float = CLOSED) -> Any:
    """Return whether a computed number, or each of an array, cannot be told from zero.

    - `largest`: the largest magnitude of the same kind beside it. At most 1e-9 of it is rounding: -9.7e-10 W of one
      load beside 7 W of another.
    - `peak`: of a mean, the largest magnitude that the same quantity takes over time. At most 1e-5 of it is how well
      solvers cancel it: a spring that gives and takes 0.1 W and 2e-9 W on the mean. `closed` is another share where a
      solver is less exact.

    Both are steps of many powers of ten below what four digits show. Nothing is zero by its size alone: 1e-13 W is the
    power of a small swimmer. Nothing is zero beside an infinite one, which has overflowed.
    """
    beside = (abs(value) <= ROUNDING * largest) & (largest < math.inf)
    return beside | ((abs(value) <= closed * peak) & (peak < math.inf))
