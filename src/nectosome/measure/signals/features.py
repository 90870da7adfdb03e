"""Features of a signal in a window, each with its standard error."""

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, get_args

import numpy as np
import xarray as xr

from .correlation import find_period
from .cycles import regular_starts, split_cycles
from .events import StrokeWindow
from .metadata import SE, history, product, units, with_step
from .noise import correlation_time
from .requirements import is_even, mean_step, single, time_of
from .spectra import ValueWithError, sine

_PERIODS = 3  # of a signal, from which on its mean is one over them
Feature = Literal["mean", "rms", "slope", "amplitude", "frequency", "phase"]


def mean(signal: xr.DataArray) -> ValueWithError:
    """Mean over time; of an evenly sampled signal that repeats itself three times or more, over its whole periods.

    The standard error is then by the scatter of their means: a beat is no noise. Else it counts one independent sample
    per correlation time (`mean_of_samples`). Raises ValueError for NaN.
    """
    time, x = single(signal, "mean")
    means = _means_of_periods(signal, time)
    if means is None:
        return mean_of_samples(time, x)
    return mean_of_samples(np.arange(float(len(means))), means)


def rms(signal: xr.DataArray) -> ValueWithError:
    """Root mean square over time, as `mean`; A / sqrt(2) of a sine over whole periods. Raises ValueError for NaN."""
    time, x = single(signal, "rms")
    square = mean_of_samples(time, x**2)
    root = float(np.sqrt(square.value))
    return ValueWithError(root, square.se / (2 * root) if root > 0 else 0.0)


def slope(signal: xr.DataArray) -> ValueWithError:
    """Slope of the least-squares line [unit/s]: the mean speed, for a position.

    The standard error allows for correlated residuals (`correlation_time`). Raises ValueError for NaN and fewer than
    three samples.
    """
    time, x = single(signal, "slope", least=3)
    t = time - time.mean()
    value = float(t @ (x - x.mean()) / (t @ t))
    residuals = x - x.mean() - value * t
    variance = residuals @ residuals / (len(t) - 2) * correlation_time(residuals) / (t @ t)
    return ValueWithError(value, float(np.sqrt(variance)))


def features(
    recording: xr.Dataset, window: tuple[float, float] | StrokeWindow, names: Mapping[str, Sequence[Feature]]
) -> xr.Dataset:
    """Features of a recording between two times [s], for instance `{"force": ["mean", "amplitude"], "x": ["slope"]}`.

    Returns `force_mean`, `force_mean_se`, `force_amplitude`, ... of `mean`, `rms`, `slope` and `sine`; dimensions other
    than time remain. Raises ValueError for an unknown variable or feature, and a window of fewer than 8 samples.
    """
    time_of(recording, "features")
    start, end = window[:2]
    inside = recording.sel(time=slice(start, end))
    if inside.sizes["time"] < 8:
        raise ValueError(
            f"features: the window from {start:g} s to {end:g} s has {inside.sizes['time']} samples, and 8 are "
            f"needed; the recording lasts from {float(recording.time[0]):g} s to {float(recording.time[-1]):g} s."
        )
    new = {}
    for name, chosen in names.items():
        if name not in recording.data_vars:
            raise ValueError(f"features: there is no {name}; there are {', '.join(map(str, recording.data_vars))}.")
        x = inside[name].transpose(..., "time")
        for feature in chosen:
            if feature not in get_args(Feature):
                raise ValueError(f'features: "{feature}" is not one of {", ".join(get_args(Feature))}.')
        for feature, (value, se) in _of_each(x, chosen).items():
            unit = _unit(feature, units(x))
            for key, values in ((f"{name}_{feature}", value), (f"{name}_{feature}{SE}", se)):
                new[key] = xr.DataArray(values, dims=x.dims[:-1], attrs=unit)
    coords = {k: v for k, v in inside.coords.items() if "time" not in v.dims}
    settings = {"window": [float(start), float(end)], "names": {k: list(v) for k, v in names.items()}}
    return with_step(xr.Dataset(new, coords, history(recording)), "features", **settings)


def _of_each(x: xr.DataArray, chosen: Sequence[Feature]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The features of every signal along time and their standard errors, as arrays over the other dimensions."""
    simple: dict[str, Callable[[xr.DataArray], ValueWithError]] = {"mean": mean, "rms": rms, "slope": slope}
    values = {feature: (np.empty(x.shape[:-1]), np.empty(x.shape[:-1])) for feature in chosen}
    for i in np.ndindex(x.shape[:-1]):
        one = x[i]
        fit = sine(one) if set(chosen) - set(simple) else None
        for feature, (value, se) in values.items():
            value[i], se[i] = simple[feature](one) if feature in simple else getattr(fit, feature)
    return values


def _unit(feature: str, unit: str | None) -> dict[str, str]:
    if feature == "slope" and unit is not None:
        unit = product((unit, 1), ("s", -1))
    unit = {"frequency": "Hz", "phase": "rad"}.get(feature, unit)
    return {} if unit is None else {"units": unit}


def _means_of_periods(signal: xr.DataArray, time: np.ndarray) -> np.ndarray | None:
    """Mean of each whole period of a signal; None where it has no period, or fewer than three."""
    if not is_even(time):
        return None
    try:
        period = find_period(signal).period
    except ValueError:
        return None
    alone = signal.drop_vars([name for name in signal.coords if name != "time"]).to_dataset(name="x")
    if time[-1] - time[0] < _PERIODS * period:
        return None
    samples = max(round(period / mean_step(time)), 2)
    cycles = split_cycles(alone, regular_starts(alone, period), samples=samples)
    return cycles["x"].mean("phase").values if cycles.sizes["cycle"] >= _PERIODS else None


def mean_of_samples(time: np.ndarray, x: np.ndarray) -> ValueWithError:
    """Mean by the trapezoidal rule, with the standard error of one independent sample per correlation time."""
    steps = np.diff(time)
    weights = np.concatenate([steps[:1], (steps[1:] + steps[:-1]) / 2, steps[-1:]])
    weights = weights / weights.sum()
    value = float(weights @ x)
    residuals = x - value
    variance = residuals @ residuals / (len(x) - 1) * (weights @ weights) * correlation_time(residuals)
    return ValueWithError(value, float(np.sqrt(variance)))
