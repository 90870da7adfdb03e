"""The mean of what was measured several times, with its standard error and band."""

import numpy as np
import xarray as xr
from scipy.special import stdtrit

from .labels import CORRELATED, SE, quantities, with_step


def average(recording: xr.Dataset, dim: str, function: str, coverage: float) -> xr.Dataset:
    """Mean over a dimension, whose members count as independent measurements of the same.

    For each variable `force` along it: the mean `force`, the standard deviation of a single one `force_std`,
    `force_se` = std / sqrt(n), and `force_lower`, `force_upper` = mean -+ t se, with Student's t of n - 1 degrees of
    freedom: the band holds the true mean with probability `coverage`, at each point by itself. Standard errors of
    single samples are left aside, since what they stand for is in the scatter. nan where one member is nan. Raises
    ValueError for fewer than two.
    """
    n = recording.sizes.get(dim, 0)
    if n < 2:
        raise ValueError(
            f"{function}: there are {n} along the dimension {dim}, and two or more are needed for a spread."
        )
    if not 0 < coverage < 1:
        raise ValueError(f"{function}: coverage is {coverage:g}; it must lie between 0 and 1.")
    wide = float(stdtrit(n - 1, 0.5 + coverage / 2))
    new = {}
    for name in quantities(recording, dim):
        x = recording[name]
        mean, std = x.mean(dim, skipna=False), x.std(dim, ddof=1, skipna=False)
        se = std / np.sqrt(n)
        unit = {k: v for k, v in x.attrs.items() if k == "units"}
        new[name] = mean.drop_attrs().assign_attrs(x.attrs)
        for part, values in (("_std", std), (SE, se), ("_lower", mean - wide * se), ("_upper", mean + wide * se)):
            new[name + part] = values.drop_attrs(deep=False).assign_attrs(unit)
    averaged = recording.drop_dims(dim).assign(new).assign_attrs({f"{dim}s": n})
    return with_step(averaged, function, coverage=coverage, **{f"{dim}s": n}, **CORRELATED)
