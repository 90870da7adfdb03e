"""Recordings and noise made for the tests."""

import numpy as np
import xarray as xr


def recording(time, units: str = "N", **values) -> xr.Dataset:
    """A recording of `values` over time, all in the same unit."""
    return xr.Dataset(
        {name: ("time", np.asarray(x), {"units": units}) for name, x in values.items()},
        coords={"time": ("time", np.asarray(time), {"units": "s"})},
    )


def signal(time, values, units: str = "N") -> xr.DataArray:
    return recording(time, units, force=values)["force"]


def band_limited(seed: int, highest: float):
    """A function of time: noise of variance 1 with frequencies up to `highest` [Hz], known at every time."""
    rng = np.random.default_rng(seed)
    f, phase = rng.uniform(0, highest, 200), rng.uniform(0, 2 * np.pi, 200)
    return lambda t: np.sin(2 * np.pi * np.outer(t, f) + phase).sum(axis=1) / 10
