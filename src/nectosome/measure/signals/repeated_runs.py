"""Repeats of an experiment as one recording, means over repeats or cycles, and linear rescaling, with errors."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.special import stdtrit

from .metadata import CORRELATED, SE, processing, quantities, units, with_step
from .requirements import time_of
from .resample import Method, resample


def average(recording: xr.Dataset, dim: str, function: str, coverage: float) -> xr.Dataset:
    """Mean over a dimension of independent measurements of the same quantity.

    For each variable `force` along it: the mean `force`, the standard deviation of a single member `force_std`,
    `force_se` = std / sqrt(n), and `force_lower`, `force_upper` = mean -+ t se, with Student's t of n - 1 degrees of
    freedom: the pointwise band of probability `coverage` for the true mean. Standard errors of single samples are not
    used, since the scatter includes them. NaN if one member is NaN. Raises ValueError for fewer than two members.
    """
    n = recording.sizes.get(dim, 0)
    if n < 2:
        raise ValueError(f"{function}: the dimension {dim} has {n} members; two or more are needed for a spread.")
    if not 0 < coverage < 1:
        raise ValueError(f"{function}: coverage is {coverage:g}; it must lie between 0 and 1.")
    student = float(stdtrit(n - 1, 0.5 + coverage / 2))
    new = {}
    for name in quantities(recording, dim):
        x = recording[name]
        mean, std = x.mean(dim, skipna=False), x.std(dim, ddof=1, skipna=False)
        se = std / np.sqrt(n)
        unit = {k: v for k, v in x.attrs.items() if k == "units"}
        new[name] = mean.drop_attrs().assign_attrs(x.attrs)
        for part, values in (("_std", std), (SE, se), ("_lower", mean - student * se), ("_upper", mean + student * se)):
            new[name + part] = values.drop_attrs(deep=False).assign_attrs(unit)
    averaged = recording.drop_dims(dim).assign(new).assign_attrs({f"{dim}s": n})
    return with_step(averaged, function, coverage=coverage, **{f"{dim}s": n}, **CORRELATED)


def combine(
    recordings: Sequence[xr.Dataset],
    times: Float[np.ndarray, "m"] | None = None,
    *,
    method: Method = "linear",
    gap: float | None = None,
) -> xr.Dataset:
    """Resample recordings at common times, with `repeat` as the first dimension.

    The default `times` [s] are those of the first recording that lie within all recordings. Values are those of
    `resample`; the clocks must agree (`align`). Raises ValueError for different quantities or units, and no common
    time.
    """
    if not recordings:
        raise ValueError("combine: there are no recordings.")
    first = recordings[0]
    spans = [time_of(recording, "combine")[[0, -1]] for recording in recordings]
    for i, recording in enumerate(recordings):
        _check_alike(first, recording, i)
    if times is None:
        start, end = max(a for a, _ in spans), min(b for _, b in spans)
        old = first["time"].values
        times = old[(old >= start) & (old <= end)]
        if len(times) < 2:
            raise ValueError(
                f"combine: the recordings share no time: the last one starts at {start:.6g} s and the first one ends "
                f"at {end:.6g} s. Align them first."
            )
    parts = [resample(recording, times=times, method=method, gap=gap) for recording in recordings]
    together = xr.concat(
        parts,
        dim="repeat",
        data_vars="all",
        coords="minimal",
        compat="override",
        join="exact",
        combine_attrs="override",
    )
    common = {k: v for k, v in parts[0].attrs.items() if all(part.attrs.get(k) == v for part in parts)}
    together.attrs = common
    histories = {} if "processing" in common else {"recordings": [processing(part) for part in parts]}
    return with_step(together, "combine", repeats=len(parts), **histories, **CORRELATED)


def average_repeats(repeats: xr.Dataset, *, coverage: float = 0.95) -> xr.Dataset:
    """Mean over the dimension `repeat` at each time, with standard error and band (`average`).

    Deviations of a repeat last over neighbouring samples, so their errors are correlated. Raises ValueError for fewer
    than two repeats.
    """
    return average(repeats, "repeat", "average_repeats", coverage)


def propagate(
    recording: xr.Dataset, name: str, *, factor: float = 1.0, offset: float = 0.0, units: str | None = None
) -> xr.Dataset:
    """Replace a variable x by factor x + offset (in new `units`, if given), and its standard error by |factor| se.

    The factor and the offset are exact. Raises ValueError for an unknown variable, and a factor or offset that is not
    finite.
    """
    if name not in recording.data_vars:
        raise ValueError(f"propagate: there is no {name}; there are {', '.join(map(str, recording.data_vars))}.")
    if not (np.isfinite(factor) and np.isfinite(offset)):
        raise ValueError(f"propagate: factor is {factor:g} and offset is {offset:g}; both must be finite.")
    unit = {} if units is None else {"units": units}
    x = recording[name]
    new = {name: (factor * x + offset).assign_attrs(x.attrs | unit)}
    if name + SE in recording:
        se = recording[name + SE]
        new[name + SE] = (abs(factor) * se).assign_attrs(se.attrs | unit)
    return with_step(recording.assign(new), "propagate", name=name, factor=factor, offset=offset)


def _check_alike(first: xr.Dataset, other: xr.Dataset, number: int) -> None:
    ours, theirs = set(first.data_vars), set(other.data_vars)
    if ours != theirs:
        raise ValueError(
            f"combine: recording {number} differs from the first in having or lacking "
            f"{', '.join(sorted(map(str, ours ^ theirs)))}: take the quantities that all have."
        )
    for name in quantities(first):
        if units(first[name]) != units(other[name]):
            raise ValueError(
                f"combine: {name} is in {units(other[name])} in recording {number}, and in {units(first[name])} in "
                "the first: propagate turns one into the other."
            )
