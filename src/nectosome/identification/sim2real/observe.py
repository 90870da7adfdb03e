"""Experiments: recordings of a campaign averaged over cycles and repeats, with standard errors, without outliers."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import ndtri, stdtrit

from nectosome.measure.signals import lowpass as low_passed
from nectosome.measure.signals import mean as mean_of
from nectosome.measure.signals import regular_starts, split_cycles
from nectosome.units import InputError, did_you_mean, read_quantity, shorten, shown_unit
from nectosome.units.ranges import split_range

from ..recordings import conditions_of, file_of, unit_of
from .grids import GridTable

if TYPE_CHECKING:
    import xarray as xr

_FREQUENCY = "f"  # the condition that is the frequency of a cycle
_SAMPLES = 8  # of a cycle, at least: fewer give neither its mean nor its peak
_SLACK = 1e-3  # by which a count of samples or cycles may be short of a whole number: written times are rounded
_CONSTANT = np.geomspace(1e-3, 10, 41)  # of the largest mean: sizes below it scatter alike
_FAR = 6.0  # robust standard deviations: a repeat farther off is left out
_CONDITIONS = 3  # at least
_AGAINST = 0.5  # cosine between measured and simulated values: below minus this a sign is wrong


@dataclass(frozen=True)
class ParameterEstimate:
    """A parameter as estimated from each experiment; NaN where one does not determine it."""

    values: Float[np.ndarray, "m"]
    errors: Float[np.ndarray, "m"]  # standard errors
    apart: bool  # estimated from something else than the values that are corrected, such as peaks


@dataclass(frozen=True)
class Experiments:
    """One row for each conditions at which something was measured."""

    conditions: Float[np.ndarray, "m d"]
    values: Float[np.ndarray, "m"]
    errors: Float[np.ndarray, "m"]  # standard errors of the values
    estimate: ParameterEstimate | None = None

    def __post_init__(self) -> None:
        """Raise InputError where a number is NaN or infinite, an error negative, or conditions stand there twice."""
        rows = np.column_stack([self.conditions, self.values, self.errors])
        wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1) | (self.errors < 0))
        if wrong.size:
            raise InputError(f"experiment {wrong[0] + 1} is NaN or infinite, or has a negative standard error.")
        if len(np.unique(self.conditions, axis=0)) < len(self.conditions):
            raise InputError("two experiments have the same conditions. Average repeats first.")

    def take(self, rows: Int[np.ndarray, "k"] | Bool[np.ndarray, "m"]) -> Self:
        """Some of them."""
        e = self.estimate
        estimate = e and ParameterEstimate(e.values[rows], e.errors[rows], e.apart)
        return type(self)(self.conditions[rows], self.values[rows], self.errors[rows], estimate)


@dataclass(frozen=True)
class Observed:
    """What was measured at some conditions, in SI units; repeats are averaged."""

    conditions: Mapping[str, float]
    mean: float
    error: float  # standard error; of a single recording from the scatter within it, NaN where it is unknown
    peak: float  # largest magnitude of a cycle, mean over cycles and repeats
    peak_error: float  # NaN where it is unknown
    repeats: int
    files: tuple[str, ...]
    seconds: float  # recorded, with what was left out
    notes: tuple[str, ...]  # what was left out


def _recorded(recording: "xr.Dataset", simulated: "xr.DataArray", column: str, lowpass: float | None) -> Observed:
    """Numbers of a column of a recording at conditions of a simulated grid. Raises InputError that names the file."""
    about, file = json.loads(recording.attrs["provenance"]), file_of(recording)
    if column not in recording.data_vars:
        near = did_you_mean(column, map(str, recording.data_vars))
        raise InputError(f'has no column called "{column}".{near}', file=file)
    if "time" not in recording.dims:
        raise InputError("has no time, without which nothing is known of means over time.", file=file)
    signal = _within_window(recording, file)[column].compute()
    _same_unit(signal, simulated, file, column)
    conditions = _conditions(recording, simulated, file)
    given = recording.coords.get(_FREQUENCY)  # also where the grid has a single one
    cyclic = given is not None and given.ndim == 0 and float(given) > 0 and unit_of(given) == "Hz"
    time = signal["time"].values
    try:
        numbers = _numbers(signal, float(given) if given is not None and cyclic else None, lowpass, file)
    except ValueError as error:
        raise InputError(str(error), file=file, field=column) from None
    others = tuple(f"{name}: " for name in recording.data_vars if name != column)
    notes = [f"{file}: {note}" for note in (*about["repairs"], *about["warnings"]) if not note.startswith(others)]
    return Observed(conditions, *numbers[:-1], 1, (file,), float(time[-1] - time[0]), (*notes, *numbers[-1]))


def _within_window(recording: "xr.Dataset", file: str) -> "xr.Dataset":
    """What was recorded within its window, if it has one. Raises InputError for one without readings."""
    text = json.loads(recording.attrs.get("window", "null"))
    if text is None:
        return recording
    ends = split_range(text)
    if ends is None or ends.step or ends.log:
        why = f'"{shorten(text)}" is no window. Write two times, as in "1.5..11.5 s".'
        raise InputError(why, file=file, field="window")
    low, high = (read_quantity(end, "time", "window") for end in (ends.low, ends.high))
    time = recording["time"].values
    within = (time >= low - _SLACK) & (time <= high + _SLACK)
    if not within.any():
        why = f"{shorten(text)} has no readings, which go from {time[0]:.6g} to {time[-1]:.6g} s."
        raise InputError(why, file=file, field="window")
    return recording.isel(time=within)


def _same_unit(measured: "xr.DataArray", simulated: "xr.DataArray", file: str, name: str) -> None:
    ours, theirs = unit_of(measured) or "no unit", unit_of(simulated) or "no unit"
    if ours != theirs:
        raise InputError(f"is in {ours}, what is simulated in {theirs}: not of one kind.", file=file, field=name)


def _conditions(recording: "xr.Dataset", simulated: "xr.DataArray", file: str) -> dict[str, float]:
    """Conditions of a recording, in the order of the grid's dimensions. Raises InputError where they do not fit it."""
    given = conditions_of(recording)
    dims = [str(dim) for dim in simulated.dims]
    for name in [*dims, *given]:
        if name not in given:
            what = "is a dimension of the simulated grid, and no condition of the recording"
            raise InputError(f"{what}. Write it into the campaign.", file=file, field=name)
        if name not in simulated.coords:
            what = f"is no dimension of the simulated grid, which has {', '.join(dims)}"
            raise InputError(f"{what}. Simulate several values of it, or leave it out.", file=file, field=name)
        _same_unit(given[name], simulated[name], file, name)
        low, high, value = float(simulated[name].min()), float(simulated[name].max()), float(given[name])
        slack = 1e-9 * max(abs(low), abs(high))
        if not low - slack <= value <= high + slack:
            factor, unit = shown_unit(unit_of(simulated[name]))
            value, low, high = (f"{factor * x:.6g} {unit}".strip() for x in (value, low, high))
            what = f"{value} is outside of the simulated grid, which goes from {low} to {high}"
            raise InputError(f"{what}. Simulate a wider grid, or leave this recording out.", file=file, field=name)
    return {name: float(given[name]) for name in dims}


def _numbers(
    signal: "xr.DataArray", frequency: float | None, lowpass: float | None, file: str
) -> tuple[float, float, float, float, tuple[str, ...]]:
    """Mean and peak with their standard errors, and what was left out. Raises ValueError where nothing is left.

    For the low pass a straight line stands where values are missing.
    """
    time, known, top = signal["time"].values, np.isfinite(signal.values), signal
    if known.sum() < 2:
        raise ValueError(f"has {known.sum()} samples with a value.")
    if lowpass is not None:
        filled = np.interp(time, time[known], signal.values[known])
        top = low_passed(signal.copy(data=filled), lowpass).where(known)
    if frequency is None:
        value, se = mean_of(signal[known])
        left = () if known.all() else (f"{file}: {np.sum(~known)} missing values left out",)
        return value, se, float(np.nanmax(np.abs(top))), np.nan, left
    step = float(np.median(np.diff(time)))
    samples, whole = (int(x + _SLACK) for x in (1 / (frequency * step), (time[-1] - time[0] + step) * frequency))
    if whole < 1:
        raise ValueError(f"lasts {time[-1] - time[0]:.4g} s, less than a cycle of {1 / frequency:.4g} s.")
    if samples < _SAMPLES:
        raise ValueError(f"has {samples} samples a cycle; at least {_SAMPLES} are needed.")
    both = signal.to_dataset(name="signal").assign(top=top)
    cycles = split_cycles(both, regular_starts(both, 1 / frequency), samples=samples)
    n = cycles.sizes["cycle"]
    notes = [f"{file}: {whole - n} of {whole} cycles left out, which are not wholly there"] if n < whole else []
    if n >= 3 and int(cycles["cycle"][0]) == 0:
        cycles = cycles.isel(cycle=slice(1, None))
        notes.append("the first cycle of recordings with three or more is left out, as start-up")
    means, peaks = cycles["signal"].mean("phase").values, abs(cycles["top"]).max("phase").values
    return *_mean(means), *_mean(peaks), tuple(notes)


def _mean(values: Float[np.ndarray, "c"]) -> tuple[float, float]:
    """Mean over cycles and its standard error, as of correlated cycles; NaN for a single one."""
    if len(values) < 2:
        return float(values[0]), np.nan
    import xarray as xr

    return mean_of(xr.DataArray(values, {"time": np.arange(float(len(values)))}, "time"))


def observe(
    recordings: "Iterable[xr.Dataset]",
    simulated: "xr.DataArray",
    column: str,
    parameter: str | None = None,
    *,
    lowpass: float | None = None,
) -> list[Observed]:
    r"""Mean and peak of a column at each of the conditions, the dimensions of a simulated grid but its parameter.

    Where `f` [Hz] is a condition recordings are cut into cycles: the first of three or more is left out, as start-up,
    and so are those with missing values. The peak of a cycle is the largest magnitude in it, after a zero-phase low
    pass [Hz] where one is given.

    Repeats scatter by a constant and by a share of their mean, $\sigma_k = s \sqrt{r^2 + \bar x_k^2}$ with r of most
    likelihood and $s^2 = \sum_{ki} (x_{ki} - \bar x_k)^2 / (r^2 + \bar x_k^2) / \sum_k (n_k - 1)$, pooled over all
    conditions k. No error is less than that by the scatter of cycles, or of samples, as far as they are independent
    (`signals.mean`); it counts alone where nothing was repeated. Of three repeats and more those are left out that are
    6 robust standard deviations, pooled too, from the median. Raises InputError that names the file, and for fewer
    than three conditions.
    """
    grid = simulated if parameter is None else simulated.isel({parameter: 0}, drop=True)
    groups: dict[tuple[float, ...], list[Observed]] = {}
    for recording in recordings:
        run = _recorded(recording, grid, column, lowpass)
        same = tuple(float(f"{x:.9g}") for x in run.conditions.values())  # 30 deg and 0.523598776 rad
        groups.setdefault(same, []).append(run)
    if len(groups) < _CONDITIONS:
        few = f"{len(groups)} different conditions were measured, too few: at least {_CONDITIONS} are needed."
        raise InputError(few, field="recordings")
    every = [*groups.values()]
    kept = _without_outliers(every)
    if not any(run.mean for runs in kept for run in runs):
        raise InputError(f"{column} is 0 throughout: nothing was measured.", field="recordings")
    means, peaks = (_errors([[getattr(run, what) for run in runs] for runs in kept]) for what in ("mean", "peak"))
    return [_averaged(*row) for row in zip(every, kept, means, peaks, strict=True)]


def experiments_of(observed: Sequence[Observed], table: GridTable, peaks: GridTable | None = None) -> Experiments:
    """Experiments at the conditions of a table; with a table of simulated peaks its parameter is estimated from
    measured ones.

    Without it, and where the errors of peaks are unknown, it is estimated from the values. Raises InputError for
    conditions outside of the grid, and where what is measured has the other sign.
    """
    points = np.array([[row.conditions[name] for name in table.names] for row in observed])
    values, errors, tops, top_errors = np.array([[r.mean, r.error, r.peak, r.peak_error] for r in observed]).T
    there = table.simulated(points)[0]
    if there @ values < -_AGAINST * np.linalg.norm(there) * np.linalg.norm(values):
        against = "goes against what is simulated nearly everywhere: one of them has the other sign"
        raise InputError(f"{against}. Turn it in the campaign (sign: -1) or in the quantity.", field="campaign")
    estimate = None
    if peaks is not None and peaks.parameter.size > 1 and np.isfinite(top_errors).any():
        estimate = ParameterEstimate(*peaks.matching(points, tops, top_errors), apart=True)
    return Experiments(points, values, errors, estimate)


def _without_outliers(groups: Sequence[list[Observed]]) -> list[list[Observed]]:
    means = [np.array([run.mean for run in runs]) for runs in groups]
    at = np.array([abs(np.median(x)) for x in means])
    off = [np.abs(x - np.median(x)) for x in means]
    # the least deviation of a group has no information: it is 0, or that of two repeats is the same
    others = [np.sort(d)[1:] * np.sqrt(len(d) / (len(d) - 1)) if len(d) > 1 else d[:0] for d in off]
    if not sum(map(len, others)):
        return [*groups]
    size = _sizes(others, at, np.ones(len(at)), 1)
    z = np.concatenate([d / x for d, x in zip(others, size, strict=True)])
    far = _FAR * 1.4826 * np.sort(z)[(len(z) - 1) // 2] * size + 1e-9 * at.max()
    return [
        [run for run, d in zip(runs, deviations, strict=True) if d <= most or len(runs) < 3]
        for runs, deviations, most in zip(groups, off, far, strict=True)
    ]


def _errors(groups: Sequence[Sequence[float]]) -> Float[np.ndarray, "k"]:
    """Standard error of the mean of each group, by the pooled scatter; NaN where there are no repeats.

    Wider by what Student's t has on the normal distribution at 95 %, since the scatter of few repeats is uncertain.
    """
    counts = np.array([len(x) for x in groups])
    means = np.array([np.mean(x) for x in groups])
    off = [np.array(x) - mean if len(x) > 1 else np.zeros(0) for x, mean in zip(groups, means, strict=True)]
    free = int(np.sum(counts - 1))
    if not free:
        return np.full(len(counts), np.nan)
    size = _sizes(off, np.abs(means), 1 - 1 / counts, 2)
    squares = sum(np.sum((d / x) ** 2) for d, x in zip(off, size, strict=True))
    wider = stdtrit(free, 0.975) / ndtri(0.975)
    return wider * np.sqrt(squares / free / counts) * size


def _sizes(
    off: Sequence[Float[np.ndarray, "_"]], at: Float[np.ndarray, "k"], weight: Float[np.ndarray, "k"], power: int
) -> Float[np.ndarray, "k"]:
    r"""Sizes $\sqrt{r^2 + x_k^2}$ that deviations are in proportion to, with the likeliest of some r.

    The least, which makes it a share, where no other's log-likelihood is higher by more than 1 (Akaike 1974). As of
    normal deviations for the power 2, and of Laplace's, which outliers change less, for 1.
    """
    k = np.repeat(np.arange(len(at)), [len(d) for d in off])
    z, w = np.abs(np.concatenate(off)), weight[k]
    candidates = []
    for r in _CONSTANT * max(at.max(), 1e-300):
        size = np.hypot(r, at)
        scale = (np.sum((z / size[k]) ** power) / w.sum()) ** (1 / power)
        candidates.append((float(w @ (np.log(max(scale, 1e-300)) + np.log(size[k]))), r))
    best = min(candidates)
    return np.hypot(best[1] if best[0] < candidates[0][0] - 1 else candidates[0][1], at)


def _averaged(every: Sequence[Observed], kept: Sequence[Observed], error: float, peak_error: float) -> Observed:
    """One row. Raises InputError where its standard error is unknown."""
    # where few conditions were repeated cycles may scatter more than these repeats do by chance
    error, peak_error = np.fmax(
        [error, peak_error],
        [np.sqrt(np.sum([getattr(run, name) ** 2 for run in kept])) / len(kept) for name in ("error", "peak_error")],
    )
    if np.isnan(error):
        raise InputError(
            "holds a single cycle, and no conditions were measured twice: the scatter of means is unknown. "
            "Repeat some conditions, or record longer.",
            file=kept[0].files[0],
        )
    notes = [note for run in every for note in run.notes]
    notes += [f"{run.files[0]}: left out, far from the other repeats" for run in every if run not in kept]
    mean, peak = (float(np.mean([getattr(run, what) for run in kept])) for what in ("mean", "peak"))
    files, seconds = tuple(run.files[0] for run in every), sum(run.seconds for run in every)
    numbers = mean, float(error), peak, float(peak_error)
    return Observed(kept[0].conditions, *numbers, len(kept), files, seconds, tuple(dict.fromkeys(notes)))
