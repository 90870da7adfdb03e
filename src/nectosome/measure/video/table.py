"""What was tracked as a table that other programs read: one row a frame, units in the heads, gaps empty."""

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from nectosome.io import write_atomic

if TYPE_CHECKING:
    import xarray as xr


def write_table(tracked: "xr.Dataset", path: str | Path) -> None:
    """Write all that goes over time (.csv), as `nectosome measure` reads it. Raises InputError where it cannot."""
    heads, columns = ["time (s)"], [tracked["time"].values]
    for name, variable in tracked.data_vars.items():
        unit = variable.attrs["units"]
        flat = variable.values.reshape(variable.shape[0], -1)
        for label, column in zip(_labels(variable), flat.T, strict=True):
            heads.append(f"{name}{label}" + (f" ({unit})" if unit != "1" else ""))
            columns.append(column)
    text = io.StringIO(newline="")
    out = csv.writer(text, lineterminator="\n")
    out.writerow(heads)
    out.writerows([_cell(column[k]) for column in columns] for k in range(len(columns[0])))
    write_atomic(path, text.getvalue().encode())


def _labels(variable: "xr.DataArray") -> list[str]:
    labels = [""]
    for dim in variable.dims[1:]:
        labels = [f"{label} {value}" for label in labels for value in variable[dim].values]
    return labels


def _cell(value: Float[np.ndarray, ""]) -> str:
    return "" if np.isnan(value) else repr(value.item())
