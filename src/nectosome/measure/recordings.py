"""Reading a file: from its columns to quantities over time in SI units, with all that was found out, mended and odd.

A Recording is an `xarray.Dataset` with the coordinate `time` [s] and a variable for each quantity, its unit in `units`;
without a time its rows are counted by `row`. Its attribute `provenance` is JSON: file, hash, reader, what was found,
converted, repaired, and what is odd.
"""

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.io import provenance
from nectosome.units import InputError

from .channels import Channel, find_channels, find_time
from .formats.open_file import open_source
from .formats.source import Source
from .inspect import TimeWatch, ValueWatch
from .sheet import Sheet, Time, load_sheet
from .store import Store

if TYPE_CHECKING:
    import xarray as xr

_ROWS = 100_000  # read at a time


def read(path: str | Path, sheet: Sheet | str | Path | None = None) -> "xr.Dataset":
    """Read a recording, as a sheet says or as the file says itself.

    A recording too large for memory lies in a file of its own until this process ends, and is read from there when it
    is used. Raises InputError that names file, row and column for what cannot be read.
    """
    path = Path(path)
    sheet = sheet if isinstance(sheet, Sheet) else Sheet() if sheet is None else load_sheet(sheet)
    with open_source(path, sheet.options) as source:
        return _Reading(path, sheet, source).go()


class _Reading:
    """One file on its way."""

    def __init__(self, path: Path, sheet: Sheet, source: Source):
        self.path, self.sheet, self.source = path, sheet, source
        file = str(path)
        self.time, assumed = find_time(source.columns, sheet.time, file)
        self.assumed = [assumed] if assumed else []
        self.channels = find_channels(source.columns, self.time.index if self.time else None, sheet, file)
        if not self.channels:
            raise InputError("there is no quantity in it besides the time.", file=file)
        repair = sheet.time.repair if sheet.time else "refuse"
        self.watch = TimeWatch(file, self.time.source if self.time else "", repair)
        self.values = [ValueWatch(channel.name) for channel in self.channels]
        self.rows = 0

    def go(self) -> "xr.Dataset":
        dim = "time" if self.time is not None or self._rate else "row"
        with Store(dim, [channel.name for channel in self.channels]) as store:
            for piece in self.source.pieces(_ROWS):
                store.add(*self._piece(piece.rows, piece.values))
            if self.rows == 0:
                raise InputError("there are no rows in it.", file=str(self.path))
            dataset = store.dataset()
        for channel, watch in zip(self.channels, self.values, strict=True):
            dataset[channel.name].attrs = self._attributes(channel, watch)
        dataset[dim].attrs = {"units": "s"} if dim == "time" else {"units": "1"}
        for name, (value, unit) in self.sheet.conditions.items():
            dataset = dataset.assign_coords({name: ((), value, {"units": unit})})
        dataset.attrs = {
            "title": self.sheet.about or self.path.name,
            "gaps": json.dumps(self.watch.gaps),
            "provenance": json.dumps(self._provenance()),
        }
        return dataset

    @property
    def _rate(self) -> float | None:
        return self.sheet.time.rate if isinstance(self.sheet.time, Time) else None

    def _piece(self, rows: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """Times (or row numbers) and quantities of a piece."""
        if self.time is not None:
            time = self.time.convert(values[:, self.time.index])
            keep = self.watch.keep(rows, time)
            if not keep.all():
                rows, time, values = rows[keep], time[keep], values[keep]
        else:
            time = np.arange(self.rows, self.rows + rows.size, dtype=float)
            if self._rate:
                time = time / self._rate
                self.watch.keep(rows, time)
        self.rows += rows.size
        columns = np.ascontiguousarray(values.T)
        out = []
        for channel, watch in zip(self.channels, self.values, strict=True):
            cells = watch.look(rows, columns[channel.index], channel.low, channel.high)
            out.append(channel.convert(cells))
        return time, out

    def _attributes(self, channel: Channel, watch: ValueWatch) -> dict[str, Any]:
        ends = sorted(channel.slope * x + channel.shift for x in (watch.smallest, watch.largest))
        attributes: dict[str, Any] = {"units": channel.unit, "column": channel.source}
        if channel.about:
            attributes["long_name"] = channel.about
        if watch.count:
            mean = channel.slope * watch.mean + channel.shift
            attributes |= {"minimum": ends[0], "maximum": ends[1], "mean": mean}
        return attributes | {"missing": watch.missing_count + watch.saturated_count}

    def _provenance(self) -> dict[str, Any]:
        return provenance({"sheet": self.sheet.source}) | {
            "file": str(self.path),
            "bytes": self.path.stat().st_size,
            "sha256": _sha256(self.path),
            "reader": self.source.reader,
            "found": list(self.source.found) + self.assumed,
            "conversions": [f"{c.name}: {c.said}" for c in (self.time, *self.channels) if c is not None and c.said],
            "repairs": [*self.source.repairs, *self._repairs()],
            "odd": self._odd(),
        }

    def _repairs(self) -> list[str]:
        said = []
        if self.watch.dropped:
            n, first = len(self.watch.dropped), self.watch.dropped[0]
            said.append(f"{_rows(n)} left out whose time does not go on, the first is row {first}")
        for watch in self.values:
            if watch.saturated_count:
                n = watch.saturated_count
                said.append(f"{watch.name}: {_rows(n)} saturated or infinite, from row {watch.saturated}: missing now")
        return said

    def _odd(self) -> list[str]:
        said = []
        if self.watch.gaps:
            longest = max(self.watch.gaps, key=lambda gap: gap[1] - gap[0])
            n, length = len(self.watch.gaps), longest[1] - longest[0]
            many = f"{n} gaps, the longest of" if n > 1 else "a gap of"
            said.append(f"time: {many} {length:.3g} s before row {longest[2]}")
        for channel, watch in zip(self.channels, self.values, strict=True):
            if watch.missing_count:
                said.append(f"{watch.name}: {_rows(watch.missing_count)} missing, the first is row {watch.missing[0]}")
            for value, n, row in (
                watch.clipped() if self.watch.count else []
            ):  # rows of a table do not follow each other
                shown = f"{channel.slope * value + channel.shift:.6g} {channel.unit}".strip()
                said.append(f"{watch.name}: stays at its extreme {shown} for {n} rows from row {row}: saturated?")
        return said


def _rows(n: int) -> str:
    return f"{n} rows" if n != 1 else "1 row"


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
