"""A correction in words: what was read, how well it is met, where it is best, and what to measure next."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from nectosome.identification import Observed, errors_of
from nectosome.identification.fits.errors import SIDES
from nectosome.io.tables import Cell, Number, Table
from nectosome.units import count, shown_unit

_ODD = 4.0  # standard errors from what the others tell: measure again
_NOTES = 12  # shown


def read_lines(observed: Sequence[Observed]) -> list[str]:
    """How much was read, and what of it was left out."""
    files, seconds = sum(len(row.files) for row in observed), sum(row.seconds for row in observed)
    noise = np.median([row.error / abs(row.mean) for row in observed if row.mean != 0])
    repeated = sum(row.repeats > 1 for row in observed)
    first = f"{count(files, 'recording')}, {_number(seconds)} s in all, at {count(len(observed), 'condition')}"
    notes = _gathered([*dict.fromkeys(note for row in observed for note in row.notes)])
    more = [f"and {count(len(notes) - _NOTES, 'more note')}"] if len(notes) > _NOTES else []
    quality = f"{repeated} of them repeated; standard error of a mean: {100 * noise:.2g} % (median)"
    return [f"{first}, {quality}", *notes[:_NOTES], *more]


def _gathered(notes: Sequence[str]) -> list[str]:
    """Notes `file: what`, those that say the same of several files as one."""
    files: dict[str, list[str]] = {}
    for note in notes:
        file, _, what = note.partition(": ")
        files.setdefault(what or note, []).append(file)
    return [
        (f"{named[0]}: {what}" if what != named[0] else what)
        + (f" (and {len(named) - 1} more files)" if named[1:] else "")
        for what, named in files.items()
    ]


def tables(found: xr.Dataset, aim: str) -> list[Table]:
    """Errors before and after, the best place before and after, the next experiments."""
    return [_errors(found), _optimum(found, aim), *([_next(found)] if found.sizes["next"] else [])]


def _errors(found: xr.Dataset) -> Table:
    """How far the simulator is off, as it was and corrected; each experiment is predicted by the others."""
    names = {"of": "error, % of what is measured", "mean": "mean", "signed": "signed", "largest": "largest"}
    names |= {"total": "total", "coverage": "in 95 % intervals"}
    rows = list[Sequence[Cell]]()
    measured, noise = found["measured"].values, found["measured_error"].values
    before = errors_of(found["simulated_there"].values, measured, np.full(len(measured), np.nan), noise)
    after = errors_of(found["predicted"].values, measured, found["predicted_error"].values, noise)
    for name, e in (("simulator as it was", before), (f"corrected ({found.attrs['method']}), by the others", after)):
        covered = [_percent(e.coverage, f"{e.coverage:.0f} %")] if e.coverage == e.coverage else []
        rows.append((name, *map(_percent, (e.mean, e.signed, e.largest, e.total)), *covered))
    rows.append(("noise alone", _percent(after.floor)))
    if after.small:
        rows.append((f"{count(after.small, 'experiment')} below 1 % of the largest: in total and intervals only",))
    return Table("errors", names, rows)


def _optimum(found: xr.Dataset, aim: str) -> Table:
    """Where the grid is best, before and after."""
    name = found.attrs["quantity"]
    what = "lowest" if aim == "lowest" else "highest"
    rows = list[Sequence[Cell]]()
    for row, values in (("simulator as it was", found["simulated"]), ("corrected", found[name])):
        place = values.argmin(...) if aim == "lowest" else values.argmax(...)
        at = values.isel(place)
        error = float(found[f"{name}_error"].isel(place)) if row == "corrected" else np.nan
        rows.append((row, *_value(float(at), error, values), _place([at[dim] for dim in values.dims])))
    names = {"of": f"{what} on the grid", "value": name, "half_interval": "95 %", "at": "at"}
    return Table("best", names, rows)


def _next(found: xr.Dataset) -> Table:
    rows = list[Sequence[Cell]]()
    for k in range(found.sizes["next"]):
        one = found.isel(next=k)
        place = _place([one[f"next_{name}"] for name in found["simulated"].dims], "next_")
        expected = _value(float(one["expected"]), float(one["expected_error"]), one["expected"])
        rows.append((place, *expected, str(one["reason"].item())))
    names = {"at": "next experiment", "expected": "expected", "half_interval": "95 %", "reason": ""}
    return Table("next", names, rows)


def lines(found: xr.Dataset, observed: Sequence[Observed]) -> list[str]:
    """The estimated parameter, what does not fit, and what the next experiments take."""
    known, parameter = list[str](), found["parameter_there"]
    if found.attrs["parameter"]:
        low, high = (_number(float(x)) for x in (parameter.min(), parameter.max()))
        ends = f"{low} to {high} {parameter.attrs['units']}".strip()
        nominal = f"{_number(found.attrs['nominal'])} in the simulator as it was"
        name, source = found.attrs["parameter"], found.attrs["estimated_from"]
        known.append(f"{name}: {ends} where measured, estimated from {source}; {nominal}")
    if not found.sizes["next"]:
        known.append("every point of the grid was measured: there is no next experiment")
    return [*known, *_odd(found), *_cost(found, observed)]


def _cost(found: xr.Dataset, observed: Sequence[Observed]) -> list[str]:
    """What the next experiments take, if they are made as those before."""
    seconds = found.sizes["next"] * float(np.median([row.seconds for row in observed]))
    return [f"the next {count(found.sizes['next'], 'experiment')} take about {_number(seconds)} s"] if seconds else []


def _odd(found: xr.Dataset) -> list[str]:
    """Which experiments do not fit the others."""
    off = abs(found["measured"] - found["predicted"]).values
    error = np.hypot(found["predicted_error"].values, found["measured_error"].values)
    if not np.isfinite(error).all():
        return [f"{found.attrs['method']} tells no intervals, and so not which experiments do not fit the others"]
    lines = []
    for k in np.flatnonzero(off > _ODD * error):
        place = _place([found[f"measured_{name}"][k] for name in found["simulated"].dims], "measured_")
        value, predicted = (_number(float(found[name][k])) for name in ("measured", "predicted"))
        far = f"{off[k] / max(error[k], 1e-300):.1f} standard errors"
        lines.append(f"measure again: {place}: {value}, by the others {predicted}, {far} away")
    return lines or [f"no experiment is more than {_ODD:g} standard errors from what the others tell"]


def _value(value: float, error: float, like: xr.DataArray) -> tuple[Number, Cell]:
    """A value with its unit and half of its 95 % interval, where there is one."""
    unit, half = str(like.attrs["units"]), SIDES * error
    interval = Number(half, unit, shown=f"± {half:.2g}") if error == error else ""
    return Number(value, unit, shown=f"{_number(value)} {unit}".strip()), interval


def _percent(percent: float, text: str = "") -> Number:
    return Number(percent / 100, shown=text or _number(percent))


def _place(conditions: Sequence[xr.DataArray], prefix: str = "") -> str:
    """Conditions with their units."""
    parts = []
    for x in conditions:
        factor, unit = shown_unit(str(x.attrs.get("units", "")))
        parts.append(f"{str(x.name).removeprefix(prefix)}={_number(factor * float(x))} {unit}".strip())
    return ", ".join(parts)


def _number(value: float) -> str:
    return f"{value:.4g}"
