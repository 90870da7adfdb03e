"""A sensor's gain and zero, from readings and the true quantity."""

import numpy as np
import xarray as xr


def calibrate(reading: xr.DataArray, quantity: xr.DataArray) -> xr.Dataset:
    r"""Fit quantity = gain * (reading - zero) by least squares.

    Returns `gain` and `zero` with standard errors `_se` (independent residuals; that of the zero by linear
    propagation), and `residual_rms`, `residual_max` [unit of the quantity]. Raises ValueError for fewer than three
    pairs without NaN and for equal readings.
    """
    x, y = np.asarray(reading, dtype=float).ravel(), np.asarray(quantity, dtype=float).ravel()
    if x.shape != y.shape:
        raise ValueError(f"calibrate: {x.size} readings and {y.size} values of the quantity; their number must agree.")
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if x.size < 3 or np.ptp(x) == 0:
        raise ValueError(
            f"calibrate: {x.size} pairs with {np.unique(x).size} different readings; three pairs and two different "
            "readings are needed."
        )
    mx, my = x.mean(), y.mean()
    sxx = float(np.sum((x - mx) ** 2))
    gain = float(np.sum((x - mx) * (y - my))) / sxx
    residual = y - my - gain * (x - mx)
    variance = float(np.sum(residual**2)) / (x.size - 2)
    gain_se = np.sqrt(variance / sxx)
    zero = mx - my / gain if gain else np.nan
    zero_se = np.sqrt(variance / x.size + (my / gain * gain_se) ** 2) / abs(gain) if gain else np.nan
    u, v = (str(a.attrs.get("units", "")) or "1" for a in (reading, quantity))
    per = {"units": f"{v}/({u})"}
    return xr.Dataset(
        {
            "gain": ((), gain, per),
            "gain_se": ((), float(gain_se), per),
            "zero": ((), zero, {"units": u}),
            "zero_se": ((), float(zero_se), {"units": u}),
            "residual_rms": ((), float(np.sqrt(np.mean(residual**2))), {"units": v}),
            "residual_max": ((), float(np.max(np.abs(residual))), {"units": v}),
        }
    )
