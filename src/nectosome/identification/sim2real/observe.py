"""Experiments: recordings of a campaign averaged over cycles and repeats, with standard errors, without outliers."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import ndtri, stdtrit

from nectosome.measure.labels import conditions_of, file_of, unit_of
from nectosome.measure.pooled_scatter import near_the_others, pooled_errors
from nectosome.measure.signals import lowpass as low_passed
from nectosome.measure.signals import mean as mean_of
from nectosome.measure.whole_cycles import frequency_of, over_cycles, whole_cycles, within_window
from nectosome.units import InputError, did_you_mean, shown_unit

from .grids import GridTable

if TYPE_CHECKING:
    import xarray as xr

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
    signal = within_window(recording, file)[column].compute()
    _same_unit(signal, simulated, file, column)
    conditions = _conditions(recording, simulated, file)
    time = signal["time"].values
    try:
        numbers = _numbers(signal, frequency_of(recording), lowpass, file)
    except ValueError as error:
        raise InputError(str(error), file=file, field=column) from None
    others = tuple(f"{name}: " for name in recording.data_vars if name != column)
    notes = [f"{file}: {note}" for note in (*about["repairs"], *about["warnings"]) if not note.startswith(others)]
    return Observed(conditions, *numbers[:-1], 1, (file,), float(time[-1] - time[0]), (*notes, *numbers[-1]))


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
    cycles, notes = whole_cycles(signal.to_dataset(name="signal").assign(top=top), frequency, file)
    means, peaks = cycles["signal"].mean("phase").values, abs(cycles["top"]).max("phase").values
    return *over_cycles(means), *over_cycles(peaks), tuple(notes)


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

    The scatter of repeats is pooled over all conditions (`pooled_scatter`). No error is less than that by the scatter
    of cycles, or of samples, as far as they are independent (`signals.mean`); it counts alone where nothing was
    repeated. Of three repeats and more those are left out that are far off (`near_the_others`). Raises InputError that
    names the file, and for fewer than three conditions.
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
    near = near_the_others([[run.mean for run in runs] for runs in groups])
    return [[run for run, good in zip(runs, own, strict=True) if good] for runs, own in zip(groups, near, strict=True)]


def _errors(groups: Sequence[Sequence[float]]) -> Float[np.ndarray, "k"]:
    """Standard error of the mean of each group, by the pooled scatter; NaN where there are no repeats.

    Wider by what Student's t has on the normal distribution at 95 %, since the scatter of few repeats is uncertain.
    """
    errors, free = pooled_errors(groups)
    return errors * (stdtrit(free, 0.975) / ndtri(0.975)) if free else errors


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
