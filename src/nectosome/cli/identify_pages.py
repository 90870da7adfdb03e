"""What an identification found: parameters, errors against recordings, warnings."""

import json
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from nectosome.io.summary import Summary
from nectosome.io.tables import Label, Number, Table, number
from nectosome.units import count

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.identification.hysteresis.trials import PressureTrial
    from nectosome.identification.surge.estimators import SurgeRecording

    Rows = list[tuple[str | Label | Number, ...]]

_NAMES = {"added_mass": "added mass m_as", "drag": "drag Lambda", "alpha": "alpha = -Lambda/m", "gamma": "gamma = 1/m"}
_ROWS = 40  # of shapes at rest that are shown
_FIT = {"parameter": "parameter", "value": "value", "low": "95 % from", "high": "to"}


def surge_summary(found: "xr.Dataset", recordings: "Sequence[SurgeRecording]") -> Summary:
    """Return what a dataset of `SurgeFit` holds, and what was done to recordings."""
    notes = [f"{recording.name}: {note}" for recording in recordings for note in recording.notes]
    said = f"{_used(found)}; M = {number(found.attrs['mass'])} kg"
    rows: Rows = []
    for name, what in _NAMES.items():
        one = found.sel(parameter=name)
        share = float(one["percent"])
        numbers = _numbers(one, "value", "low", "high", "error", unit=str(one["unit"].item()))
        rows.append((Label(name, what), *numbers, Number(share / 100, shown=f"{number(share)} %")))
    table = Table("parameters", _FIT | {"error": "standard error", "percent": ""}, rows)
    off: Rows = []
    for one, name, used in _recordings(found):
        shares = (float(one[f"deviation_{key}"]) for key in ("mean", "std", "largest"))
        off.append((name, *(Number(x / 100, shown=f"{round(x, 2) + 0.0:.2f}") for x in shares), used))
    heads = {"recording": "measured - computed speed, % of its rms", "mean": "mean", "std": "std"}
    errors = Table("errors", heads | {"largest": "largest", "used": ""}, off, listed=True)
    return _summary(found, [table, errors], [said, *notes])


def hysteresis_summary(found: "xr.Dataset", recordings: "Sequence[PressureTrial]") -> Summary:
    """Return what a dataset of `HysteresisFit` holds, and what was done to recordings."""
    from nectosome.identification.hysteresis.files import BENCH_UNITS

    notes = [f"{recording.name}: {note}" for recording in recordings for note in recording.notes]
    rows: Rows = []
    for name in map(str, found["parameter"].values):
        one = found.sel(parameter=name)
        scale, unit = BENCH_UNITS[one["unit"].item()]
        values = _numbers(one, "value", "low", "high", unit=str(one["unit"].item()))
        rows.append((name, *(x._replace(shown=f"{number(scale * x.value)} {unit}".strip()) for x in values)))
    off: Rows = []
    for one, name, used in _recordings(found):
        shares = (float(one[key]) for key in ("e_rmsp", "e_mp"))
        off.append((name, *(Number(x / 100, shown=f"{x:.3g}") for x in shares), used))
    heads = {"recording": "computed - measured, % of the range", "rms": "rms", "largest": "largest", "used": ""}
    tables = [Table("parameters", _FIT, rows), Table("errors", heads, off, listed=True)]
    left = f"residuals: {number(1e3 * found.attrs['noise'])} mm (root mean square)"
    values = {"residuals": Number(float(found.attrs["noise"]), "m")}
    return _summary(found, tables, [_used(found), *notes], [left], values)


def thruster_summary(found: "xr.Dataset") -> Summary:
    """Return what a dataset of `ThrusterFit` holds, with its fields as a robot file has them."""
    rows: Rows = []
    fields = {"thruster": "", "motor": ""}
    for name in map(str, found["parameter"].values):
        one = found.sel(parameter=name)
        unit = str(one["unit"].item())
        rows.append((name, *_numbers(one, "value", "low", "high", unit=unit)))
        of = "motor" if name in ("torque_constant", "resistance", "dead_band") else "thruster"
        fields[of] += f", {name}: {number(float(one['value']))} {unit}".rstrip()
    off: Rows = []
    for k, name in enumerate(map(str, found["recording"].values)):
        shares = (float(found[f"e_{what}"][k]) for what in ("speed", "current", "thrust"))
        off.append((name, *(Number(x / 100, shown=f"{x:.3g}") for x in shares)))
    heads = {"table": "rms error, % of the largest", "speed": "speed", "current": "current", "thrust": "thrust"}
    tables = [Table("parameters", _FIT, rows), Table("errors", heads, off, listed=True)]
    size = f"{number(1e3 * float(found.attrs['diameter']))} mm"
    said = [
        f"in a robot file: {{kind: thruster, diameter: {size}{fields['thruster']}, thrust_slope: ..., "
        "torque_slope: ...}; a stand does not tell the slopes",
        f"and its motor: {{{fields['motor'][2:]}, ...}}",
        "the range of the dead band is that between rows at rest and rows that turn",
        "torque, torque_constant and resistance share their errors: take all of them, or none",
    ]
    return _summary(found, tables, [], said)


def robot_summary(found: "xr.Dataset") -> Summary:
    """Return what `RobotFit.to_dataset` holds."""
    said = [_used(found)]
    if found.attrs["starts"] > 1:
        said.append(f"{found.attrs['agree']} of {found.attrs['starts']} starts came to these parameters")
    rows: Rows = []
    for name in map(str, found["parameter"].values):
        one = found.sel(parameter=name)
        numbers = _numbers(one, "value", "low", "high", "before", unit=str(one["unit"].item()))
        told = (bool(one[key]) for key in ("low_known", "high_known", "identifiable"))
        rows.append((name, *numbers, "no interval" if json.loads(found.attrs["asked"]) else _known(*told)))
    off: Rows = []
    for one, name, used in _recordings(found):
        for c, column in enumerate(map(str, found["column"].values)):
            shares = (float(one[key][c]) for key in ("e_rmsp", "e_mp"))
            numbers = (Number(x / 100, shown="-" if math.isnan(x) else f"{x:.3g}") for x in shares)
            off.append((name, column, *numbers, used, str(one["start"].item())))
    heads = {"recording": "computed - measured, % of the range", "column": "column", "rms": "rms"}
    tables = [
        Table("parameters", _FIT | {"before": "before", "known": ""}, rows),
        Table("errors", heads | {"largest": "largest", "used": "", "start": "start"}, off, listed=True),
        *_shapes(found),
    ]
    columns = [*zip(*(found[key].values.tolist() for key in ("column", "error", "units_of")), strict=True)]
    known = [(column, error, unit) for column, error, unit in columns if not math.isnan(error)]
    noise = [f"{column}: standard error {number(error)} {unit}".strip() for column, error, unit in known]
    others = json.loads(found.attrs.get("scatter", "[]"))
    others += [words for words in json.loads(found.attrs["words"]) if ": identifiable" not in words]
    values = {f"error.{column}": Number(error, unit) for column, error, unit in columns}
    return _summary(found, tables, said, [*json.loads(found.attrs["notes"]), *noise, *others], values)


def _shapes(found: "xr.Dataset") -> list[Table]:
    """What was read and what is computed in each row of shapes at rest, where these are few."""
    still = found.isel(sample=found["time"].isnull().values)
    if not 0 < still.sizes["sample"] <= _ROWS:
        return []
    names, columns = found["recording"].values[still["of"].values], still["of_column"].values
    rows: Rows = []
    for k, (name, c) in enumerate(zip(map(str, names), columns, strict=True)):
        one, unit = still.isel(sample=k), str(found["units_of"].values[c])
        numbers = _numbers(one, "measured", "computed", unit=unit)
        rows.append(
            (name, Number(int(one["row"]), shown=f"{int(one['row'])}"), str(found["column"].values[c]), *numbers)
        )
    heads = {"recording": "at rest", "row": "row", "column": "column", "measured": "measured", "computed": "computed"}
    return [Table("rows", heads, rows, listed=True)]


def _known(low: bool, high: bool, identifiable: bool) -> str:
    """What an interval says besides its ends."""
    if not (low or high):
        return "any value of the range"
    if low and high:
        return "" if identifiable else "not identifiable alone"
    return f"no {'upper' if low else 'lower'} end but the range's"


def gait_summary(found: "xr.Dataset") -> Summary:
    """Return what a dataset of `GaitResult` holds."""
    best = float(found["discrepancy"].min())
    said = f"discrepancy {best:.3g} after {count(found.sizes['evaluation'], 'evaluation')}: {found.attrs['ended']}"
    rows: Rows = []
    for name in map(str, found["parameter"].values):
        one, unit = found.sel(parameter=name), str(found.sel(parameter=name)["unit"].item())
        known = "identifiable" if bool(one["identifiable"]) else ""
        rows.append((name, *_numbers(one, "value", "good_low", "good_high", "low", "high", unit=unit), known))
    heads = {"parameter": "parameter", "value": "best", "good_low": "as good from", "good_high": "to"}
    tables = [Table("parameters", heads | {"low": "range from", "high": "to", "known": ""}, rows)]
    units, features = map(str, found["unit_of_feature"].values), map(str, found["feature"].values)
    each: Rows = []
    for f, (feature, unit) in enumerate(zip(features, units, strict=True)):
        for k in range(found.sizes["trial"]):
            pair = (float(found[row].values[k][f]) for row in ("target", "reached"))
            each.append((str(k + 1), feature, *(Number(x, unit, shown=f"{x:.6g} {unit}".strip()) for x in pair)))
    of = {"trial": "trial", "feature": "feature", "target": "target", "reached": "reached"}
    tables.append(Table("features", of, each, listed=True))
    good = count(int(found.attrs["good"]), "candidate")
    same = f"as good, of a discrepancy of at most {found.attrs['as_good']:.3g}: {good}"
    rank = (
        f"{found.attrs['rank']} of {found.sizes['parameter']} directions in the ranges are identifiable by the features"
    )
    values = {"discrepancy": Number(best), "rank": Number(int(found.attrs["rank"]))}
    return _summary(found, tables, [said], [same, rank, *json.loads(found.attrs["words"])], values)


def _summary(
    found: "xr.Dataset",
    tables: Sequence[Table],
    above: Sequence[str],
    notes: Sequence[str] = (),
    values: "dict[str, Number] | None" = None,
) -> Summary:
    given, warnings = found.attrs, json.loads(found.attrs.get("warnings", "[]"))
    made = {"provenance": given["provenance"]}
    return Summary(str(given["title"]), tables, above, notes, warnings, attributes=made, values=values or {})


def _used(found: "xr.Dataset") -> str:
    train = int((found["used"] == "train").sum())
    return f"{count(train, 'recording')} fitted, {found.sizes['recording'] - train} held out"


def _recordings(found: "xr.Dataset") -> "Iterator[tuple[xr.Dataset, str, str]]":
    """Each recording: its data, its name and its use."""
    for k in range(found.sizes["recording"]):
        one = found.isel(recording=k)
        yield one, str(one["recording"].item()), "fitted" if one["used"].item() == "train" else "held out"


def _numbers(one: "xr.Dataset", *keys: str, unit: str) -> list[Number]:
    return [Number(float(one[key]), "" if unit == "1" else unit) for key in keys]
