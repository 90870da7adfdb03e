"""The page of an identification in the terminal: parameters, errors against recordings, warnings."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.cli.page import columns, number, page
from nectosome.identification import Observed
from nectosome.units import count
from nectosome.view.corrected_words import WordRows, lines, read_lines, tables

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.identification.hysteresis.fit import PressureTrial
    from nectosome.identification.surge.estimators import SurgeRecording

_NAMES = {"added_mass": "added mass m_as", "drag": "drag Lambda", "alpha": "alpha = -Lambda/m", "gamma": "gamma = 1/m"}


def surge_page(found: "xr.Dataset", recordings: "Sequence[SurgeRecording]") -> Group:
    """Return the page of what `surge_data` holds, and of what was done to recordings."""
    train = int((found["used"] == "train").sum())
    held = found.sizes["recording"] - train
    said = f"{count(train, 'recording')} fitted, {held} held out; M = {number(found.attrs['mass'])} kg"
    notes = [f"{recording.name}: {note}" for recording in recordings for note in recording.notes]
    title = Text("\n").join([Text(str(found.attrs["title"]), "bold"), Text(""), *map(Text, [said, *notes])])
    warnings = [f"beware: {warning}" for warning in json.loads(found.attrs["warnings"])]
    return page(title, [_parameters(found), _errors(found)], warnings)


def _parameters(found: "xr.Dataset") -> Table:
    table = columns("parameter", "value", "95 % from", "to", "standard error", "%", "unit")
    for name, what in _NAMES.items():
        one = found.sel(parameter=name)
        table.add_row(what, *(number(float(one[key])) for key in _SHOWN), str(one["unit"].item()))
    return table


_SHOWN = ("value", "low", "high", "error", "percent")


def _errors(found: "xr.Dataset") -> Table:
    """Errors of the computed speed, in percent of the root mean square of the measured one."""
    table = columns("measured - computed speed, % of its rms", "mean", "std", "largest", "")
    for k in range(found.sizes["recording"]):
        one = found.isel(recording=k)
        deviations = [f"{round(float(one[f'deviation_{name}']), 2) + 0.0:.2f}" for name in ("mean", "std", "largest")]
        table.add_row(
            str(one["recording"].item()), *deviations, "fitted" if one["used"].item() == "train" else "held out"
        )
    return table


def hysteresis_page(found: "xr.Dataset", recordings: "Sequence[PressureTrial]") -> Group:
    """Return the page of what `hysteresis_data` holds, and of what was done to recordings."""
    from nectosome.identification.hysteresis.files import BENCH_UNITS

    train = int((found["used"] == "train").sum())
    said = [f"{count(train, 'recording')} fitted, {found.sizes['recording'] - train} held out"]
    said += [f"{recording.name}: {note}" for recording in recordings for note in recording.notes]
    title = Text("\n").join([Text(str(found.attrs["title"]), "bold"), Text(""), *map(Text, said)])
    table = columns("parameter", "value", "95 % from", "to", "unit")
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        scale, unit = BENCH_UNITS[one["unit"].item()]
        table.add_row(str(name), *(number(scale * float(one[key])) for key in ("value", "low", "high")), unit)
    errors = columns("computed - measured, % of the range", "rms", "largest", "")
    for k in range(found.sizes["recording"]):
        one = found.isel(recording=k)
        used = "fitted" if one["used"].item() == "train" else "held out"
        errors.add_row(str(one["recording"].item()), *(f"{float(one[key]):.3g}" for key in ("e_rmsp", "e_mp")), used)
    left = f"residuals: {number(1e3 * found.attrs['noise'])} mm (root mean square)"
    return page(title, [table, errors], [left, *(f"beware: {x}" for x in json.loads(found.attrs["warnings"]))])


def robot_page(found: "xr.Dataset") -> Group:
    """Return the page of what `RobotFit.to_dataset` holds."""
    train = int((found["used"] == "train").sum())
    said = [f"{count(train, 'recording')} fitted, {found.sizes['recording'] - train} held out"]
    if found.attrs["starts"] > 1:
        said.append(f"{found.attrs['agree']} of {found.attrs['starts']} starts came to these parameters")
    title = Text("\n").join([Text(str(found.attrs["title"]), "bold"), Text(""), *map(Text, said)])
    table = columns("parameter", "value", "95 % from", "to", "unit", "before", "")
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        values = (number(float(one[key])) for key in ("value", "low", "high"))
        known = "" if bool(one["identifiable"]) else "not identifiable alone"
        table.add_row(str(name), *values, str(one["unit"].item()), number(float(one["before"])), known)
    errors = columns("computed - measured, % of the range", "column", "rms", "largest", "")
    for k in range(found.sizes["recording"]):
        one = found.isel(recording=k)
        used = "fitted" if one["used"].item() == "train" else "held out"
        for c, column in enumerate(found["column"].values):
            off = (f"{float(one[key][c]):.3g}" for key in ("e_rmsp", "e_mp"))
            errors.add_row(str(one["recording"].item()), str(column), *off, used)
    noise = [
        f"{column}: standard error {number(float(error))} {unit}".strip()
        for column, error, unit in zip(*(found[key].values for key in ("column", "error", "units_of")), strict=True)
    ]
    warnings = [f"beware: {warning}" for warning in json.loads(found.attrs["warnings"])]
    others = [] if bool(found["identifiable"].all()) else json.loads(found.attrs["words"])
    return page(title, [table, errors], [*json.loads(found.attrs["notes"]), *noise, *others, *warnings])


def gait_page(found: "xr.Dataset") -> Group:
    """Return the page of what `gait_data` holds."""
    best = float(found["discrepancy"].min())
    said = f"discrepancy {best:.3g} after {count(found.sizes['evaluation'], 'evaluation')}: {found.attrs['ended']}"
    title = Text("\n").join([Text(str(found.attrs["title"]), "bold"), Text(""), Text(said)])
    table = columns("parameter", "best", "as good from", "to", "range", "")
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        ends = f"{number(float(one['low']))} to {number(float(one['high']))} {one['unit'].item()}".strip()
        known = "identifiable" if bool(one["identifiable"]) else ""
        table.add_row(str(name), *(number(float(one[key])) for key in ("value", "good_low", "good_high")), ends, known)
    tables = [table]
    for k in range(found.sizes["trial"]):
        reached = columns(f"trial {k + 1}", *map(str, found["feature"].values))
        units = found["unit_of_feature"].values
        for row in ("target", "reached"):
            values = found[row].values[k]
            reached.add_row(row, *(f"{x:.6g} {unit}" for x, unit in zip(values, units, strict=True)))
        tables.append(reached)
    good = count(int(found.attrs["good"]), "candidate")
    same = f"as good, of a discrepancy of at most {found.attrs['as_good']:.3g}: {good}"
    rank = (
        f"{found.attrs['rank']} of {found.sizes['parameter']} directions in the ranges are identifiable by the features"
    )
    return page(title, tables, [same, rank, *json.loads(found.attrs["words"])])


def correction_page(found: "xr.Dataset", observed: Sequence[Observed], aim: str) -> Group:
    """Return the page of what `correct_grid` gives."""
    title = Text(str(found.attrs["title"]), "bold")
    head = Text("\n").join([title, Text(""), *map(Text, read_lines(observed))])
    return page(head, [_correction_table(rows) for rows in tables(found, aim)], lines(found, observed))


def _correction_table(rows: WordRows) -> Table:
    table = columns(*rows.names)
    for row in rows.rows:
        table.add_row(*row)
    return table
