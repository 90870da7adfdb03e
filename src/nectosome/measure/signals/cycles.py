"""A periodic signal by its phase: cut into cycles, and the mean of the cycles with its standard error and band."""

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float, Int

from .labels import CORRELATED, RecordedSignal, each, quantities, with_step
from .repeated_runs import average
from .requirements import positive, time_of
from .resample import Method, between, default_gap, unbroken


def regular_starts(recording: xr.Dataset, period: float, *, start: float | None = None) -> Float[np.ndarray, "k"]:
    """Times [s] at which cycles of a known `period` [s] start: from `start`, or the first sample, past the last one."""
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
    """Cut a recording into cycles from each start to the next, at the same phases: dimensions `cycle`, `phase` [rad].

    `starts` [s] are those of `regular_starts` for a known period, or for that of `find_period`, or the rising
    `crossings` of a trigger. The phase goes evenly in time from 0 at a start to 2 pi at the next one, which is the
    first of the next cycle; each cycle has its `start` and `duration` [s] as coordinates. Samples are interpolated as
    in `resample`.

    Cycles that are not within the recording, hold nan or a gap are left out, and those whose duration differs from
    the median one by more than the `tolerance` [-]; `attrs` count `cycles`, `cycles_incomplete` and `cycles_uneven`.
    What lies before the first and after the last start belongs to no cycle. Raises ValueError where no cycle is left.
    """
    time = time_of(recording, "split_cycles")
    starts = np.asarray(starts, float)
    if starts.ndim != 1 or len(starts) < 2 or not np.all(np.diff(starts) > 0):
        raise ValueError(f"split_cycles: two or more starts that increase are needed; there are {starts.size}.")
    if samples < 2:
        raise ValueError(f"split_cycles: samples is {samples}; it must be 2 or more.")
    positive(tolerance, "tolerance", "", "split_cycles")
    gap = default_gap(time) if gap is None else gap
    durations = np.diff(starts)
    even = np.abs(durations - np.median(durations)) <= tolerance * np.median(durations)
    at = starts[:-1, None] + durations[:, None] * np.arange(samples) / samples
    stretches = unbroken(time, _known(recording), gap)
    home = _home(time, stretches, at)
    kept = even & (home >= 0)
    if not kept.any():
        raise ValueError(
            f"split_cycles: none of {len(durations)} cycles is left: {np.count_nonzero(home < 0)} are not wholly "
            f"recorded (the recording lasts from {time[0]:.6g} s to {time[-1]:.6g} s), {np.count_nonzero(~even)} "
            f"differ from the median duration of {np.median(durations):.6g} s by more than {tolerance:.0%}."
        )
    phase = xr.DataArray(2 * np.pi * np.arange(samples) / samples, dims="phase", name="phase", attrs={"units": "rad"})
    cycle = xr.DataArray(np.flatnonzero(kept), dims="cycle", name="cycle")

    def cut(x: Float[np.ndarray, "*batch n"], method: Method) -> Float[np.ndarray, "*batch cycles samples"]:
        out = np.empty((*x.shape[:-1], *at.shape))
        for i in np.ndindex(x.shape[:-1]):
            for h in np.unique(home[kept]):
                s, mine = stretches[h], kept & (home == h)
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
        "cycles_incomplete": int(np.count_nonzero(home < 0)),
        "cycles_uneven": int(np.count_nonzero((home >= 0) & ~even)),
    }
    settings = {"samples": samples, "tolerance": tolerance, "method": method, "gap": gap}
    return with_step(cycles, "split_cycles", **settings, **counts, **CORRELATED).assign_attrs(counts)


def average_cycles(cycles: xr.Dataset, *, coverage: float = 0.95) -> xr.Dataset:
    """Mean over the cycles at each phase, with its standard error and band, and so of their `duration` (`average`).

    Raises ValueError for fewer than two cycles.
    """
    if "duration" in cycles.coords:
        cycles = cycles.reset_coords("duration")
    return average(cycles, "cycle", "average_cycles", coverage)


def _known(recording: xr.Dataset) -> Bool[np.ndarray, "n"]:
    """Samples at which every variable has a number."""
    known = np.ones(recording.sizes["time"], bool)
    for name in quantities(recording):
        x = recording[name].transpose("time", ...).values.astype(float)
        known &= np.isfinite(x.reshape(len(x), -1)).all(axis=1)
    return known


def _home(
    time: Float[np.ndarray, "n"], stretches: list[slice], at: Float[np.ndarray, "cycles samples"]
) -> Int[np.ndarray, "cycles"]:
    """Number of the stretch in which all of a cycle lies, -1 for none."""
    home, slack = np.full(len(at), -1), 1e-9 * (time[-1] - time[0])
    for h, s in enumerate(stretches):
        home[(at[:, 0] >= time[s][0] - slack) & (at[:, -1] <= time[s][-1] + slack)] = h
    return home
