"""What a fit of a robot found, as a table: values with their intervals, how far off it is, what to beware of."""

import json
from html import escape
from typing import TYPE_CHECKING

from nectosome.view.scorecard import number
from nectosome.view.style import GREY

if TYPE_CHECKING:
    import xarray as xr


def fitted_html(found: "xr.Dataset") -> str:
    """Of what `identify.robot_results.robot_data` has of one recording."""
    rows = [_row("", "value", "95 % from", "to", "unit")]
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        values = (number(float(one[key])) for key in ("value", "low", "high"))
        mark = "" if bool(one["told"]) else " *"
        rows.append(_row(f"{name}{mark}", *values, str(one["unit"].item())))
    lines = [] if bool(found["told"].all()) else ["* not told alone", *json.loads(found.attrs["words"])]
    for c, column in enumerate(map(str, found["column"].values)):
        rms, largest = (f"{float(found[key][0, c]):.3g} %" for key in ("e_rmsp", "e_mp"))
        lines.append(f"{column}: off by {rms} of its range (root mean square), {largest} at most")
    if found.attrs["starts"] > 1:
        lines.append(f"{found.attrs['agree']} of {found.attrs['starts']} starts came to these values")
    lines += [f"beware: {warning}" for warning in json.loads(found.attrs["warnings"])]
    lines += json.loads(found.attrs["notes"])
    said = "".join(f'<div style="color:{GREY};padding-top:3px">{escape(line)}</div>' for line in lines)
    return (
        '<div style="font-size:12px;padding:0 12px 8px;overflow-x:auto" id="studio-fit">'
        f'<table style="width:100%;border-collapse:collapse">{"".join(rows)}</table>{said}</div>'
    )


def _row(*cells: str) -> str:
    style = "text-align:right;padding:1px 0 1px 6px;white-space:nowrap"
    return f"<tr>{''.join(f'<td style={chr(34)}{style}{chr(34)}>{escape(cell)}</td>' for cell in cells)}</tr>"
