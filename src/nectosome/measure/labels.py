"""What a recording is called: its file, its conditions, units of its quantities."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def file_of(recording: "xr.Dataset") -> str:
    """Name of a recording's file, and its part of it in brackets; "recording" where it has none."""
    about = json.loads(recording.attrs.get("provenance", "{}"))
    return Path(about.get("file", "recording")).name + (f" [{about['part']}]" if about.get("part") else "")


def conditions_of(recording: "xr.Dataset") -> "dict[str, xr.DataArray]":
    """Numbers that hold for a whole recording, by name; how often it was repeated is none of them."""
    return {str(name): x for name, x in recording.coords.items() if x.ndim == 0 and name != "repeat"}


def unit_of(quantity: "xr.DataArray") -> str:
    """SI unit of a quantity; of several ways to write one always the same."""
    unit = str(quantity.attrs.get("units", ""))
    return {"1": "", "s-1": "Hz", "1/s": "Hz"}.get(unit, unit)
