"""The page of an identification in the terminal: parameters, errors against recordings, warnings."""

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rich.console import Group

from nectosome.cli.page import columns, number, page
from nectosome.units import count

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.identification.hysteresis.fit import PressureTrial
    from nectosome.identification.surge.estimators import SurgeRecording

_NAMES = {"added_mass": "added mass m_as", "drag": "drag Lambda", "alpha": "alpha = -Lambda/m", "gamma": "gamma = 1/m"}


def surge_page(found: "xr.Dataset", recordings: "Sequence[SurgeRecording]") -> Group:
    """Return the page of what `surge_data` holds, and of what was done to recordings."""
    notes = [f"{recording.name}: {note}" for recording in recordings for note in recording.notes]
    said = f"{_used(found)}; M = {number(found.attrs['mass'])} kg"
    table = columns("parameter", "value", "95 % from", "to", "standard error", "%", "unit")
    for name, what in _NAMES.items():
        one = found.sel(parameter=name)
        shown = _numbers(one, "value", "low", "high", "error", "percent")
        table.add_row(what, *shown, str(one["unit"].item()))
    errors = columns("measured - computed speed, % of its rms", "mean", "std", "largest", "")
    for one, name, used in _recordings(found):
        deviations = [f"{round(float(one[f'deviation_{key}']), 2) + 0.0:.2f}" for key in ("mean", "std", "largest")]
        errors.add_row(name, *deviations, used)
    return page(str(found.attrs["title"]), [table, errors], _warnings(found), [said, *notes])


def hysteresis_page(found: "xr.Dataset", recordings: "Sequence[PressureTrial]") -> Group:
    """Return the page of what `hysteresis_data` holds, and of what was done to recordings."""
    from nectosome.identification.hysteresis.files import BENCH_UNITS

    notes = [f"{recording.name}: {note}" for recording in recordings for note in recording.notes]
    table = columns("parameter", "value", "95 % from", "to", "unit")
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        scale, unit = BENCH_UNITS[one["unit"].item()]
        table.add_row(str(name), *_numbers(one, "value", "low", "high", scale=scale), unit)
    errors = columns("computed - measured, % of the range", "rms", "largest", "")
    for one, name, used in _recordings(found):
        errors.add_row(name, *(f"{float(one[key]):.3g}" for key in ("e_rmsp", "e_mp")), used)
    left = f"residuals: {number(1e3 * found.attrs['noise'])} mm (root mean square)"
    return page(str(found.attrs["title"]), [table, errors], [left, *_warnings(found)], [_used(found), *notes])


def robot_page(found: "xr.Dataset") -> Group:
    """Return the page of what `RobotFit.to_dataset` holds."""
    said = [_used(found)]
    if found.attrs["starts"] > 1:
        said.append(f"{found.attrs['agree']} of {found.attrs['starts']} starts came to these parameters")
    table = columns("parameter", "value", "95 % from", "to", "unit", "before", "")
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        known = "" if bool(one["identifiable"]) else "not identifiable alone"
        values, unit = _numbers(one, "value", "low", "high"), str(one["unit"].item())
        table.add_row(str(name), *values, unit, *_numbers(one, "before"), known)
    errors = columns("computed - measured, % of the range", "column", "rms", "largest", "")
    for one, name, used in _recordings(found):
        for c, column in enumerate(found["column"].values):
            errors.add_row(name, str(column), *(f"{float(one[key][c]):.3g}" for key in ("e_rmsp", "e_mp")), used)
    noise = [
        f"{column}: standard error {number(float(error))} {unit}".strip()
        for column, error, unit in zip(*(found[key].values for key in ("column", "error", "units_of")), strict=True)
    ]
    others = [] if bool(found["identifiable"].all()) else json.loads(found.attrs["words"])
    lines = [*json.loads(found.attrs["notes"]), *noise, *others, *_warnings(found)]
    return page(str(found.attrs["title"]), [table, errors], lines, said)


def gait_page(found: "xr.Dataset") -> Group:
    """Return the page of what `gait_data` holds."""
    best = float(found["discrepancy"].min())
    said = f"discrepancy {best:.3g} after {count(found.sizes['evaluation'], 'evaluation')}: {found.attrs['ended']}"
    table = columns("parameter", "best", "as good from", "to", "range", "")
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        ends = f"{' to '.join(_numbers(one, 'low', 'high'))} {one['unit'].item()}".strip()
        known = "identifiable" if bool(one["identifiable"]) else ""
        table.add_row(str(name), *_numbers(one, "value", "good_low", "good_high"), ends, known)
    tables, units = [table], found["unit_of_feature"].values
    for k in range(found.sizes["trial"]):
        each = ((row, zip(found[row].values[k], units, strict=True)) for row in ("target", "reached"))
        rows = [(row, *(f"{x:.6g} {unit}" for x, unit in values)) for row, values in each]
        tables.append(columns(f"trial {k + 1}", *map(str, found["feature"].values), rows=rows))
    good = count(int(found.attrs["good"]), "candidate")
    same = f"as good, of a discrepancy of at most {found.attrs['as_good']:.3g}: {good}"
    rank = (
        f"{found.attrs['rank']} of {found.sizes['parameter']} directions in the ranges are identifiable by the features"
    )
    return page(str(found.attrs["title"]), tables, [same, rank, *json.loads(found.attrs["words"])], [said])


def _used(found: "xr.Dataset") -> str:
    train = int((found["used"] == "train").sum())
    return f"{count(train, 'recording')} fitted, {found.sizes['recording'] - train} held out"


def _recordings(found: "xr.Dataset") -> "Iterator[tuple[xr.Dataset, str, str]]":
    """Each recording: its data, its name and its use."""
    for k in range(found.sizes["recording"]):
        one = found.isel(recording=k)
        yield one, str(one["recording"].item()), "fitted" if one["used"].item() == "train" else "held out"


def _numbers(one: "xr.Dataset", *keys: str, scale: float = 1.0) -> list[str]:
    return [number(scale * float(one[key])) for key in keys]


def _warnings(found: "xr.Dataset") -> list[str]:
    return [f"beware: {warning}" for warning in json.loads(found.attrs["warnings"])]
