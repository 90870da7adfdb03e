r"""The table a lab wants: what a column is at each of the conditions of a campaign, and how sure.

Of each recording, within its window and over whole cycles of the condition f:

- the mean; the amplitude of its first harmonic $c = \frac{2}{T} \int x e^{-i \omega t} dt$,
- beside another column y: the phase by which it is ahead of y, $\arg c_x/c_y$, the area of the loop $\oint x\,dy$,
  which is the work of a force x over a way y in a cycle, and its power, $f \oint x\,dy$.

Repeats are averaged. Two standard errors are told apart: `by_cycles`, by the scatter of cycles (of samples where
nothing goes to and fro), which says what noise does within a run; and `by_repeats`, by the scatter of runs pooled over
all conditions (`pooled_scatter`), which holds what differs from one run to the next, drift of a sensor among it. The
95 % interval is that of the larger one, by Student's t; without repeats it is of the cycles alone.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import stdtrit

from nectosome.units import InputError, did_you_mean

from .labels import conditions_of, file_of, unit_of
from .pooled_scatter import near_the_others, pooled_errors
from .signals import loop_area, mean
from .whole_cycles import frequency_of, over_cycles, whole_cycles, within_window

if TYPE_CHECKING:
    import xarray as xr

_COVERAGE = 0.975  # of the upper end of a 95 % interval
NUMBERS = ("mean", "amplitude", "phase", "loop_area", "power")
"""What the table has, in its order; the last three beside another column."""
_WORK = {("N", "m"): "J", ("N m", "rad"): "J", ("Pa", "m3"): "J"}


class RunNumbers(NamedTuple):
    """What one recording says."""

    conditions: Mapping[str, tuple[float, str]]  # value and unit
    file: str
    cycles: int  # 0 where nothing goes to and fro
    numbers: Mapping[str, tuple[float, float]]  # value and standard error, NaN where it is unknown
    units: Mapping[str, str]
    notes: tuple[str, ...]


def condition_means(recordings: "Iterable[xr.Dataset]", column: str, against: str | None = None) -> "xr.Dataset":
    """Numbers of a column at each of the conditions, over `condition`, in the order of the recordings.

    - `mean`, `amplitude`, and `phase`, `loop_area`, `power` against another column; of each `_by_cycles`,
      `_by_repeats`, `_low` and `_high`, its standard errors and the 95 % interval. `runs` and `cycles` that count.
    - the conditions by their names; attributes: `column`, `against`, the names of the `conditions`, and `notes`, what
      was left out, by lines.

    Raises InputError that names the file: for a missing column, other conditions or units than the first recording's,
    less than a cycle, missing time.
    """
    import xarray as xr

    runs = [_numbers_of(recording, column, against) for recording in recordings]
    if not runs:
        raise InputError("there are no recordings.", field="recordings")
    _check_alike(runs)
    taken = [name for name in runs[0].conditions if name in (*NUMBERS, "runs", "cycles", "simulated")]
    if taken:
        raise InputError(f"is a number of the table too: give the condition {taken[0]} another name.", field=taken[0])
    groups: dict[tuple[float, ...], list[RunNumbers]] = {}
    for run in runs:
        same = tuple(float(f"{x:.9g}") for x, _ in run.conditions.values())  # 30 deg and 0.523598776 rad
        groups.setdefault(same, []).append(run)
    every = [*groups.values()]
    near = near_the_others([[run.numbers["mean"][0] for run in own] for own in every])
    kept = [[run for run, good in zip(own, mask, strict=True) if good] for own, mask in zip(every, near, strict=True)]
    notes = dict.fromkeys(note for run in runs for note in run.notes)
    far = [
        run.file for own, mask in zip(every, near, strict=True) for run, good in zip(own, mask, strict=True) if not good
    ]
    notes |= {f"{file}: left out, far from the other repeats": None for file in far}
    data: dict[str, tuple[str, np.ndarray, dict[str, str]]] = {
        name: ("condition", np.array([own[0].conditions[name][0] for own in kept]), {"units": unit or "1"})
        for name, (_, unit) in runs[0].conditions.items()
    }
    names, units = "\n".join(data), runs[0].units
    cycles = np.array([sum(run.cycles for run in own) for own in kept])
    for name in (name for name in NUMBERS if name in units):
        for key, values in _averaged(name, kept, cycles).items():
            data[key] = ("condition", values, {"units": units[name]})
    data["runs"] = ("condition", np.array([len(own) for own in kept]), {"units": "1"})
    data["cycles"] = ("condition", cycles, {"units": "1"})
    attrs = {"title": f"{column} by conditions", "column": column, "against": against or "", "conditions": names}
    return xr.Dataset(data, attrs=attrs | {"notes": "\n".join(notes)})


def _numbers_of(recording: "xr.Dataset", column: str, against: str | None) -> RunNumbers:
    file = file_of(recording)
    for name in filter(None, (column, against)):
        if name not in recording.data_vars:
            near = did_you_mean(name, map(str, recording.data_vars))
            raise InputError(f'has no column called "{name}".{near}', file=file)
    if "time" not in recording.dims:
        raise InputError("has no time, without which nothing is known of means over time.", file=file)
    told = {name: (float(x), unit_of(x)) for name, x in conditions_of(recording).items()}
    both = within_window(recording, file)[[name for name in (column, against) if name]].compute()
    frequency, unit = frequency_of(recording), unit_of(recording[column])
    try:
        if frequency is None:
            if against:
                raise ValueError("has no condition f, the frequency of its cycles. Write it into the campaign.")
            known = both[column][np.isfinite(both[column].values)]
            return RunNumbers(told, file, 0, {"mean": mean(known)}, {"mean": unit}, ())
        cycles, notes = whole_cycles(both, frequency, file)
    except ValueError as error:
        raise InputError(str(error), file=file, field=column) from None
    x = cycles[column].transpose("cycle", "phase").values
    harmonic = _harmonic(x)
    numbers = {"mean": over_cycles(x.mean(axis=1)), "amplitude": _along(harmonic)}
    units = {"mean": unit, "amplitude": unit}
    if against:
        y, other = cycles[against], unit_of(recording[against])
        area = loop_area(cycles[column], y)["area"].values
        numbers["phase"] = _turned(harmonic * np.conj(_harmonic(y.transpose("cycle", "phase").values)))
        numbers["loop_area"], numbers["power"] = over_cycles(area), over_cycles(frequency * area)
        work = _WORK.get((unit, other), " ".join(filter(None, (unit, other))))
        units |= {"phase": "rad", "loop_area": work, "power": "W" if work == "J" else f"{work}/s".lstrip("/")}
    return RunNumbers(told, file, cycles.sizes["cycle"], numbers, units, tuple(notes))


def _harmonic(x: Float[np.ndarray, "c p"]) -> np.ndarray:
    """First harmonic of each cycle, complex."""
    n = x.shape[1]
    return 2 / n * (x @ np.exp(-2j * np.pi * np.arange(n) / n))


def _along(harmonic: np.ndarray) -> tuple[float, float]:
    """Size of the mean harmonic, and its error by what cycles have along it: sizes of each are larger by noise."""
    middle = harmonic.mean()
    return over_cycles((harmonic * np.exp(-1j * np.angle(middle))).real)


def _turned(ratio: np.ndarray) -> tuple[float, float]:
    """Angle of the mean ratio [rad], and its error by the angles of cycles from it."""
    middle = ratio.mean()
    off, error = over_cycles(np.angle(ratio * np.conj(middle)))
    return float(np.angle(middle)) + off, error


def _check_alike(runs: Sequence[RunNumbers]) -> None:
    """Raise InputError for a recording with other conditions or units than the first."""
    first = runs[0]
    told: dict[str, Callable[[RunNumbers], Mapping[str, str]]] = {
        "conditions": lambda run: {name: unit for name, (_, unit) in run.conditions.items()},
        "numbers": lambda run: run.units,
    }
    for run in runs[1:]:
        for what, of in told.items():
            ours, theirs = of(first), of(run)
            if dict(ours) != dict(theirs):
                here, there = (", ".join(f"{name} [{unit or '1'}]" for name, unit in x.items()) for x in (theirs, ours))
                raise InputError(f"has the {what} {here or 'none'}, and {first.file} {there or 'none'}.", file=run.file)


def _averaged(
    name: str, kept: Sequence[Sequence[RunNumbers]], cycles: Float[np.ndarray, "k"]
) -> dict[str, Float[np.ndarray, "k"]]:
    """A number at each of the conditions, with errors and interval."""
    groups = [[run.numbers[name][0] for run in own] for own in kept]
    if name == "phase":  # of repeats within half a turn of the first
        groups = [[x - 2 * np.pi * round((x - own[0]) / (2 * np.pi)) for x in own] for own in groups]
    value = np.array([np.mean(own) for own in groups])
    counts = np.array([len(own) for own in kept])
    by_cycles = np.array([np.sqrt(np.sum([run.numbers[name][1] ** 2 for run in own])) for own in kept]) / counts
    by_repeats, free = pooled_errors(groups)
    each = np.where(cycles > 0, cycles - counts, np.inf)  # samples are many
    half = np.fmax(
        stdtrit(free, _COVERAGE) * by_repeats if free else by_repeats,
        np.where(each > 0, stdtrit(np.maximum(each, 1), _COVERAGE), np.nan) * by_cycles,
    )
    numbers = {
        "": value,
        "_by_cycles": by_cycles,
        "_by_repeats": by_repeats,
        "_low": value - half,
        "_high": value + half,
    }
    return {f"{name}{key}": x for key, x in numbers.items()}
