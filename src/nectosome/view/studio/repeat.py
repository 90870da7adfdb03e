"""A run that repeats itself, over several of its periods."""

from typing import TYPE_CHECKING

import numpy as np

from .course import Course

if TYPE_CHECKING:
    import xarray as xr


def repeated(run: "xr.Dataset", period: float, seconds: float) -> "xr.Dataset":
    """Where the stations of a run of one period [s] are as it goes on for so long [s], at least one period.

    Each period begins where the last one ended. What else the run tells is left out.
    """
    import xarray as xr

    course, count = Course(run, period), max(int(np.ceil(seconds / period - 1e-9)), 1)
    one = run[["position", "rotation", "half_width", "station_x"]]
    pieces = []
    for n in range(count):
        R, d = course.after(n)
        moved = one.assign(
            position=one["position"].copy(data=one["position"].values @ R.T + d),
            rotation=one["rotation"].copy(data=R @ one["rotation"].values),
        )
        last = n == count - 1
        pieces.append(moved.assign_coords(time=course.time + n * period).isel(time=slice(None, None if last else -1)))
    whole = pieces[0].drop_dims("time").assign_coords(part=run["part"])
    return xr.concat([piece[["position", "rotation"]] for piece in pieces], "time").merge(whole).assign_attrs(run.attrs)
