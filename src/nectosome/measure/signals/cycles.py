"""Cycles of a periodic signal over phase: their mean with standard error and band, and the area of their loops."""

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from .metadata import CORRELATED, SE, RecordedSignal, each, history, product, quantities, units, with_step
from .repeated_runs import average
from .requirements import positive, time_of
from .resample import Method, between, default_gap, unbroken


def regular_starts(recording: xr.Dataset, period: float, *, start: float | None = None) -> Float[np.ndarray, "k"]:
    """Start times [s] of cycles of a known `period` [s]: from `start`, or the first sample, past the last one."""
    time = time_of(recording, "regular_starts")
    positive(period, "period", "s", "regular_starts")
    start = float(time[0]) if start is None else start
    return start + period * np.arange(int(np.floor((time[-1] - start) / period + 1e-9)) + 2)


def split_cycles(
    recording: xr.Dataset,
    starts: Float[np.ndarray, "k"] | xr.DataArray,
    *,
    samples: int = 100,
    tolerance: float = 0.1,
    method: Method = "linear",
    gap: float | None = None,
) -> xr.Dataset:
    """Split a recording into cycles between successive starts: dimensions `cycle`, `phase` [rad].

    `starts` [s] come from `regular_starts` (a known period, or that of `find_period`) or from the rising `crossings`
    of a trigger. The phase is linear in time from 0 at a start to 2 pi at the next start. Coordinates: `start` and
    `duration` [s] of each cycle. Samples are interpolated as in `resample`.

    Cycles are left out if they are partly outside the recording, contain NaN or a gap, or differ from the median
    duration by more than the `tolerance` [-]; `attrs` count `cycles`, `cycles_incomplete` and `cycles_uneven`. Samples
    before the first and after the last start belong to no cycle. Raises ValueError if no cycle remains.
    """
    time = time_of(recording, "split_cycles")
    starts = np.asarray(starts, float)
    if starts.ndim != 1 or len(starts) < 2 or not np.all(np.diff(starts) > 0):
        raise ValueError(f"split_cycles: two or more increasing starts are needed; there are {starts.size}.")
    if samples < 2:
        raise ValueError(f"split_cycles: samples is {samples}; it must be 2 or more.")
    positive(tolerance, "tolerance", "", "split_cycles")
    gap = default_gap(time) if gap is None else gap
    durations = np.diff(starts)
    even = np.abs(durations - np.median(durations)) <= tolerance * np.median(durations)
    at = starts[:-1, None] + durations[:, None] * np.arange(samples) / samples
    stretches = unbroken(time, _known(recording), gap)
    stretch_of, slack = np.full(len(at), -1), 1e-9 * (time[-1] - time[0])  # -1: no stretch has the whole cycle
    for h, s in enumerate(stretches):
        stretch_of[(at[:, 0] >= time[s][0] - slack) & (at[:, -1] <= time[s][-1] + slack)] = h
    kept = even & (stretch_of >= 0)
    if not kept.any():
        raise ValueError(
            f"split_cycles: no cycle of {len(durations)} is usable: {np.count_nonzero(stretch_of < 0)} are not wholly "
            f"recorded (the recording lasts from {time[0]:.6g} s to {time[-1]:.6g} s), {np.count_nonzero(~even)} "
            f"differ from the median duration of {np.median(durations):.6g} s by more than {tolerance:.0%}."
        )
    phase = xr.DataArray(2 * np.pi * np.arange(samples) / samples, dims="phase", name="phase", attrs={"units": "rad"})
    cycle = xr.DataArray(np.flatnonzero(kept), dims="cycle", name="cycle")

    def cut(x: Float[np.ndarray, "*batch n"], method: Method) -> Float[np.ndarray, "*batch cycles samples"]:
        out = np.empty((*x.shape[:-1], *at.shape))
        for i in np.ndindex(x.shape[:-1]):
            for h in np.unique(stretch_of[kept]):
                s, mine = stretches[h], kept & (stretch_of == h)
                out[i][mine] = between(time[s], x[i][s], at[mine].ravel(), method).reshape(-1, samples)
        return out[..., kept, :]

    def change(name: str, signal: RecordedSignal) -> RecordedSignal:
        se = None if signal.se is None else cut(signal.se, "linear")
        return signal._replace(values=cut(signal.values, method), se=se)

    cycles = each(recording, change, [cycle, phase]).assign_coords(
        start=("cycle", starts[:-1][kept], {"units": "s"}), duration=("cycle", durations[kept], {"units": "s"})
    )
    counts = {
        "cycles": int(np.count_nonzero(kept)),
        "cycles_incomplete": int(np.count_nonzero(stretch_of < 0)),
        "cycles_uneven": int(np.count_nonzero((stretch_of >= 0) & ~even)),
    }
    settings = {"samples": samples, "tolerance": tolerance, "method": method, "gap": gap}
    return with_step(cycles, "split_cycles", **settings, **counts, **CORRELATED).assign_attrs(counts)


def average_cycles(cycles: xr.Dataset, *, coverage: float = 0.95) -> xr.Dataset:
    """Mean over the cycles at each phase, and of their `duration`, with standard error and band (`average`).

    Raises ValueError for fewer than two cycles.
    """
    if "duration" in cycles.coords:
        cycles = cycles.reset_coords("duration")
    return average(cycles, "cycle", "average_cycles", coverage)


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
    loops = {"area": areas} | {name: part.assign_attrs(unit) for name, part in parts.items()}
    return with_step(xr.Dataset(loops, attrs=history(x)), "loop_area")


def _known(recording: xr.Dataset) -> Bool[np.ndarray, "n"]:
    """Mask of the samples at which every variable is finite."""
    known = np.ones(recording.sizes["time"], bool)
    for name in quantities(recording):
        x = recording[name].transpose("time", ...).values.astype(float)
        known &= np.isfinite(x.reshape(len(x), -1)).all(axis=1)
    return known
