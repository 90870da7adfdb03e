"""What a fit of a robot found, as a table: values with their intervals, how far off it is, warnings."""

import json

import xarray as xr

from nectosome.view.scorecard import number

from .left_panel import cells


def fitted_html(found: xr.Dataset) -> str:
    """Of what `RobotFit.to_dataset` has of one recording."""
    rows = [["", "value", "95 % from", "to", "unit"]]
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        values = (number(float(one[key])) for key in ("value", "low", "high"))
        mark = "" if bool(one["identifiable"]) else " *"
        rows.append([f"{name}{mark}", *values, str(one["unit"].item())])
    lines = [] if bool(found["identifiable"].all()) else ["* not identifiable alone", *json.loads(found.attrs["words"])]
    for c, column in enumerate(map(str, found["column"].values)):
        rms, largest = (f"{float(found[key][0, c]):.3g} %" for key in ("e_rmsp", "e_mp"))
        lines.append(f"{column}: off by {rms} of its range (root mean square), {largest} at most")
    if found.attrs["starts"] > 1:
        lines.append(f"{found.attrs['agree']} of {found.attrs['starts']} starts came to these values")
    lines += [f"beware: {warning}" for warning in json.loads(found.attrs["warnings"])]
    return cells(rows, "studio-fit", [*lines, *json.loads(found.attrs["notes"])])
