"""Reasons of missing values in tracked data, and the table (.csv) of tracked data."""

import csv
import io
from collections.abc import Iterator, Sequence
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from nectosome.io import write_atomic

if TYPE_CHECKING:
    import xarray as xr


def write_table(tracked: "xr.Dataset", path: str | Path) -> None:
    """Write all tracked values over time (.csv), as `nectosome measure` reads it. Raises InputError if it cannot."""
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


class Reason(IntEnum):
    """Reason of a missing value in a frame; 0: not missing."""

    SEEN = 0
    LOST = 1
    PIECES = 2
    MERGED = 3
    COVERED = 4
    EDGE = 5
    ROUND = 6
    DIRECTION = 7
    DOUBT = 8

    @property
    def words(self) -> str:
        """Description for messages."""
        return _WORDS[self]


_WORDS = {
    Reason.SEEN: "seen",
    Reason.LOST: "not seen",
    Reason.PIECES: "seen in too many pieces",
    Reason.MERGED: "larger than usual: merged with something else",
    Reason.COVERED: "smaller than usual: partly covered",
    Reason.EDGE: "cut off by the edge of the picture",
    Reason.ROUND: "as wide as long: it has no direction",
    Reason.DIRECTION: "no visible neighbour gives its direction",
    Reason.DOUBT: "two assignments are equally likely",
}


def loss_notes(names: Sequence[str], why: Int[np.ndarray, "t n"]) -> Iterator[str]:
    """Notes on frames without a value."""
    for k, name in enumerate(names):
        for reason in Reason:
            count = int(np.sum(why[:, k] == reason))
            if count and reason != Reason.SEEN:
                first = int(np.argmax(why[:, k] == reason)) + 1
                yield f"{name}: {reason.words} in {count} of {len(why)} frames, the first is frame {first}"
