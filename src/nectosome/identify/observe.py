"""Recordings of a campaign as experiments: repeats averaged, with standard errors and without outliers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nectosome.io import InputError

from .experiments import Experiments, Told
from .recorded import Recorded, recorded
from .table import Table

if TYPE_CHECKING:
    import xarray as xr

_LEAST = 0.01  # of the largest mean: scatter is relative to no less
_FAR = 6.0  # robust standard deviations: a repeat farther off is left out
_CONDITIONS = 3  # at least


@dataclass(frozen=True)
class Observed:
    """What was measured at some conditions, in SI units; repeats are averaged."""

    conditions: Mapping[str, float]
    mean: float
    error: float  # standard error
    peak: float  # largest magnitude of a cycle, mean over cycles and repeats
    peak_error: float  # NaN where nothing tells it
    repeats: int
    files: tuple[str, ...]
    seconds: float  # recorded, with what was left out
    notes: tuple[str, ...]  # what was left out


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

    The scatter of repeats is a share of their mean, $\sigma^2 = \sum_{ki} (x_{ki}/\bar x_k - 1)^2 / \sum_k (n_k - 1)$,
    pooled over all conditions k. Without any repeats it is that of cycles, or of samples, as far as they are
    independent (`signals.mean`). Of three repeats and more those are left out that are 6 robust standard deviations,
    pooled too, from the median. Raises InputError that names the file, and for fewer than three conditions.
    """
    grid = simulated if parameter is None else simulated.isel({parameter: 0}, drop=True)
    groups: dict[tuple[float, ...], list[Recorded]] = {}
    for recording in recordings:
        run = recorded(recording, grid, column, lowpass)
        same = tuple(float(f"{x:.9g}") for x in run.conditions.values())  # 30 deg and 0.523598776 rad
        groups.setdefault(same, []).append(run)
    if len(groups) < _CONDITIONS:
        few = f"{len(groups)} different conditions were measured, too few: at least {_CONDITIONS} are needed"
        raise InputError(f"{few}.", field="recordings")
    every = [*groups.values()]
    kept = _without_outliers(every)
    means, peaks = (_errors([[getattr(run, what) for run in runs] for runs in kept]) for what in ("mean", "peak"))
    return [_averaged(*row) for row in zip(every, kept, means, peaks, strict=True)]


def experiments_of(observed: Sequence[Observed], table: Table, peaks: Table | None = None) -> Experiments:
    """Experiments at the conditions of a table; with a table of simulated peaks the measured ones tell its parameter.

    Without it, and where nothing tells the errors of peaks, the values tell it. Raises InputError for conditions
    outside of the grid.
    """
    points = np.array([[row.conditions[name] for name in table.names] for row in observed])
    values, errors, tops, top_errors = np.array([[r.mean, r.error, r.peak, r.peak_error] for r in observed]).T
    told = None
    if peaks is not None and peaks.parameter.size > 1 and np.isfinite(top_errors).any():
        told = Told(*peaks.matching(points, tops, top_errors), apart=True)
    return Experiments(points, values, errors, told)


def _without_outliers(groups: Sequence[list[Recorded]]) -> list[list[Recorded]]:
    least = _LEAST * max(abs(run.mean) for runs in groups for run in runs)
    off = []
    for runs in groups:
        means = np.array([run.mean for run in runs])
        middle = float(np.median(means))
        off.append(np.abs(means - middle) / max(abs(middle), least, 1e-300))
    # the least deviation of a group tells nothing: it is 0, or that of two repeats is the same
    pooled = [np.sort(x)[1:] * np.sqrt(len(x) / (len(x) - 1)) for x in off if len(x) > 1]
    far = max(_FAR * 1.4826 * float(np.median(np.concatenate(pooled))), 1e-9) if pooled else np.inf
    return [
        [run for run, x in zip(runs, deviations, strict=True) if x <= far or len(runs) < 3]
        for runs, deviations in zip(groups, off, strict=True)
    ]


def _errors(groups: Sequence[Sequence[float]]) -> list[float]:
    """Standard error of the mean of each group, by the pooled scatter; NaN where there are no repeats."""
    means = [float(np.mean(x)) for x in groups]
    least = max(_LEAST * max(map(abs, means)), 1e-300)
    sizes = [max(abs(mean), least) for mean in means]
    free = sum(len(x) - 1 for x in groups)
    squares = sum(np.sum((np.array(x) - m) ** 2) / s**2 for x, m, s in zip(groups, means, sizes, strict=True))
    scatter = float(np.sqrt(squares / free)) if free else np.nan
    return [scatter * size / float(np.sqrt(len(x))) for size, x in zip(sizes, groups, strict=True)]


def _averaged(every: Sequence[Recorded], kept: Sequence[Recorded], error: float, peak_error: float) -> Observed:
    """One row. Raises InputError where nothing tells its standard error."""
    if np.isnan(error):  # no repeats of any conditions
        error, peak_error = kept[0].error, kept[0].peak_error
    if np.isnan(error):
        raise InputError(
            "holds a single cycle, and no conditions were measured twice: nothing tells how much means scatter. "
            "Repeat some conditions, or record longer.",
            file=kept[0].file,
        )
    notes = [note for run in every for note in run.notes]
    notes += [f"{run.file}: left out, far from the other repeats" for run in every if run not in kept]
    mean, peak = (float(np.mean([getattr(run, what) for run in kept])) for what in ("mean", "peak"))
    files, seconds = tuple(run.file for run in every), sum(run.seconds for run in every)
    return Observed(
        kept[0].conditions, mean, error, peak, peak_error, len(kept), files, seconds, tuple(dict.fromkeys(notes))
    )
