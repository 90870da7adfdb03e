"""Loops of one signal against another: the area is the work, or the hysteresis, of a cycle."""

import numpy as np
import xarray as xr

from .metadata import SE, history, units, with_step
from .unit_text import product


def loop_area(x: xr.DataArray, y: xr.DataArray) -> xr.Dataset:
    """Signed area of the closed polygon of each cycle, positive counterclockwise in the (x, y) plane [unit x unit].

    $$ A = \\tfrac12 \\sum_k (x_k y_{k+1} - x_{k+1} y_k) = \\oint x\\, dy $$

    `loop_area(force, displacement)` is the work of the force in a cycle. The signals run along `phase` (or `time`) for
    one turn. With a dimension `cycle`, `area` has one value per cycle, `area_mean` with `area_mean_se` and `area_std`
    their mean and spread. n points of an ellipse, even in phase, give sin(2 pi / n) / (2 pi / n) of its area. Raises
    ValueError for NaN and signals with different dimensions.
    """
    along = next((dim for dim in ("phase", "time") if dim in x.dims), None)
    if along is None or x.sizes != y.sizes or x.sizes[along] < 3:
        raise ValueError(
            "loop_area: both signals need the same dimensions with three or more points along phase or time; they "
            f"have {dict(x.sizes)} and {dict(y.sizes)}."
        )
    y = y.transpose(*x.dims)
    axis = x.get_axis_num(along)
    u, v = x.values.astype(float), y.values.astype(float)
    if not (np.isfinite(u).all() and np.isfinite(v).all()):
        raise ValueError("loop_area: a loop with NaN has no area; leave out such cycles, as split_cycles does.")
    u, v = u - u.mean(axis, keepdims=True), v - v.mean(axis, keepdims=True)  # against rounding far from the origin
    area = 0.5 * np.sum(u * np.roll(v, -1, axis) - np.roll(u, -1, axis) * v, axis)
    ux, uy = units(x), units(y)
    unit = {"units": product((ux, 1), (uy, 1))} if ux is not None and uy is not None else {}
    coords = {k: c for k, c in x.coords.items() if along not in c.dims}
    areas = xr.DataArray(area, coords, [dim for dim in x.dims if dim != along], attrs=unit)
    if "cycle" not in areas.dims:
        return with_step(xr.Dataset({"area": areas}, attrs=history(x)), "loop_area")
    n = areas.sizes["cycle"]
    std = areas.std("cycle", ddof=1) if n > 1 else xr.full_like(areas.isel(cycle=0, drop=True), np.nan)
    parts = {"area_mean": areas.mean("cycle"), "area_mean" + SE: std / np.sqrt(n), "area_std": std}
    found = {"area": areas} | {name: part.assign_attrs(unit) for name, part in parts.items()}
    return with_step(xr.Dataset(found, attrs=history(x)), "loop_area")
