"""Samples of a recording, from a column of a file of measurements."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.description.base import wrong
from nectosome.units import DIMENSIONS, InputError, did_you_mean, expected, shorten

if TYPE_CHECKING:
    import xarray as xr

_MOST = 20_000


def read_samples(
    file: str, column: str, sheet: str | None, folder: Path, dimension: str, smooth: bool
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return times [s], from 0, and values [SI] of a column of a file in `folder`, or of a channel of its sheet.

    Raises the error of a field for a file that cannot be read, a column that is not there, another unit, a missing
    value, more than 20 000 rows and, for a `smooth` curve, a gap in time.
    """
    import numpy as np

    from nectosome.measure import read  # it takes a second, and few robots need it

    try:
        recording = read(folder / file, None if sheet is None else folder / sheet)
    except InputError as error:
        raise wrong("file" if sheet is None else "sheet", str(error)) from None
    if column not in recording.data_vars:
        known = [str(name) for name in recording.data_vars]
        raise wrong("column", f'{file} has no column "{shorten(column)}".{did_you_mean(column, known)}')
    if "time" not in recording.dims:
        raise wrong("file", f"{file} has no time. Say in a sheet which column it is, or its rate.")
    if recording.sizes["time"] > _MOST:
        why = f"{file} has {recording.sizes['time']} rows, at most {_MOST} can drive a robot."
        raise wrong("file", f"{why} Resample it with fewer, or cut a part out.")
    _check_unit(recording[column], file, dimension)
    values, time = recording[column].values.astype(float), recording["time"].values.astype(float)
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        odd = [text for text in _said(recording) if text.startswith(f"{column}: ")]
        where = odd[0] if odd else f"{column}: {missing.size} values missing"
        why = f"{file}, {where}, at {time[missing[0]]:.9g} s. Fill them in, or leave these rows out."
        raise wrong("column", why)
    gaps = json.loads(recording.attrs["gaps"]) if smooth else []
    if gaps:
        since, until, row = gaps[0]
        why = f"{file}, row {row}: nothing was recorded between {since:.9g} s and {until:.9g} s."
        raise wrong("file", f"{why} Cut out a part without a gap.")
    return tuple((time - time[0]).tolist()), tuple(values.tolist())


def _said(recording: "xr.Dataset") -> list[str]:
    provenance = json.loads(recording.attrs["provenance"])
    return [*provenance["warnings"], *provenance["repairs"]]


def _check_unit(values: "xr.DataArray", file: str, dimension: str) -> None:
    unit = str(values.attrs.get("units", ""))
    if unit == DIMENSIONS[dimension].unit:
        return
    if unit in ("", "1"):
        why = f"{file} gives it no unit. Write one into its heading, as in angle (deg), or into a sheet."
    else:
        why = f"{file} has it in {unit}. {expected(dimension)}"
    raise wrong("column", why)
