"""Reading a file: from its columns to quantities over time in SI units, with notes, repairs and warnings.

A recording is an `xarray.Dataset` with the coordinate `time` [s] (`row` for a file without time) and a variable per
quantity, its unit in `units`, its standard error in `error` where the sheet says it. Its attribute `provenance` is
JSON: file, hash, reader, notes on the format (`found`), conversions, repairs and warnings.
"""

import hashlib
import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from nectosome.io import provenance
from nectosome.units import InputError, count

from .anomalies import TimeCheck, ValueCheck
from .channels import Channel, find_channels, find_time, unit_doubts, without_time
from .formats.source import TableSource, open_source
from .sheet import Sheet, load_sheet

if TYPE_CHECKING:
    import xarray as xr

_ROWS = 100_000  # read at a time
_LIMIT = 100_000_000  # bytes in memory
_folders: list[tempfile.TemporaryDirectory[str]] = []  # removed when this process ends


def read(path: str | Path, sheet: Sheet | str | Path | None = None) -> "xr.Dataset":
    """Read a recording by a sheet, or by what the file says of itself.

    A recording too large for memory stays in a temporary file until this process ends, and is read from it when used.
    Raises InputError that names file, row and column of what cannot be read.
    """
    path = Path(path)
    sheet = sheet if isinstance(sheet, Sheet) else Sheet() if sheet is None else load_sheet(sheet)
    with open_source(path, sheet.file.options) as source:
        return _Reader(path, sheet, source).read()


class _Reader:
    """Reads one file piece by piece."""

    def __init__(self, path: Path, sheet: Sheet, source: TableSource):
        self.path, self.sheet, self.source = path, sheet, source
        file = str(path)
        self.clock = find_time(source, sheet.time, file)
        self.channels = find_channels(source, self.clock, sheet, file)
        if not self.channels:
            raise InputError("contains no quantity besides the time.", file=file)
        self.assumed, self.doubts = without_time(source, sheet.time) if self.clock is None else ([], [])
        for told, said in zip((self.assumed, self.doubts), unit_doubts(self.channels, sheet), strict=True):
            told += said
        self._check_names(file)
        drop = sheet.time is not None and sheet.time.repair == "drop"
        self.time_check = TimeCheck(file, self.clock.column.name if self.clock else "", drop)
        self.value_checks = [ValueCheck(channel.name) for channel in self.channels]
        self.rows = 0

    def _check_names(self, file: str) -> None:
        """Refuse conditions that have the name of a quantity, and quantities that have that of a coordinate."""
        for name in self.sheet.conditions:
            if name in {channel.name for channel in self.channels}:
                raise InputError(
                    "is a column of the file, too. Give the condition another name.", file=file, field=name
                )
        taken = "time" if self.clock is not None or self._rate else "row"
        for k, channel in enumerate(self.channels):
            if channel.name == taken:
                others = {other.name for other in self.channels}
                name = next(free for n in range(2, len(others) + 3) if (free := f"{taken} ({n})") not in others)
                self.channels[k] = replace(channel, name=name)

    def read(self) -> "xr.Dataset":
        dim = "time" if self.clock is not None or self._rate else "row"
        with _Store(dim, [channel.name for channel in self.channels]) as store:
            for piece in self.source.pieces(_ROWS):
                if self.rows == 0 and self.clock is not None:
                    self.clock.begin(piece.values)
                store.add(*self._piece(piece.rows, piece.values))
            if self.rows == 0:
                raise InputError("contains no rows.", file=str(self.path))
            dataset = store.dataset()
        for channel, check in zip(self.channels, self.value_checks, strict=True):
            dataset.variables[channel.name].attrs = self._attributes(channel, check)  # indexing costs 1 ms each
        dataset[dim].attrs = {"units": "s"} if dim == "time" else {"units": "1"}
        for name, (value, unit) in self.sheet.conditions.items():
            dataset = dataset.assign_coords({name: ((), value, {"units": unit})})
        dataset.attrs = {
            "title": self.sheet.about or self.path.name,
            "since": self.clock.start if self.clock else "",  # date and time at which the time is 0
            "gaps": json.dumps(self.time_check.gaps),
            "provenance": json.dumps(self._provenance()),
        }
        return dataset

    @property
    def _rate(self) -> float | None:
        return self.sheet.time.rate if self.sheet.time is not None else self.source.rate

    def _piece(self, rows: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """Times (or row numbers) and quantities of a piece."""
        if self.clock is not None:
            time = self.clock.seconds(rows, values)
            keep = self.time_check.keep(rows, time)
            if not keep.all():
                rows, time, values = rows[keep], time[keep], values[keep]
        else:
            time = np.arange(self.rows, self.rows + rows.size, dtype=float)
            if self._rate:
                time = time / self._rate + (self.sheet.time.offset if self.sheet.time is not None else 0.0)
                self.time_check.keep(rows, time)
        self.rows += rows.size
        columns = np.ascontiguousarray(values.T)
        out = []
        for channel, check in zip(self.channels, self.value_checks, strict=True):
            cells = check.check(rows, columns[channel.index], channel.low, channel.high)
            out.append(channel.convert(cells))
        return time, out

    def _attributes(self, channel: Channel, check: ValueCheck) -> dict[str, Any]:
        ends = sorted(channel.slope * x + channel.shift for x in (check.smallest, check.largest))
        attributes: dict[str, Any] = {"units": channel.unit, "column": channel.source}
        if channel.error is not None:
            attributes["error"] = channel.error
        if channel.about:
            attributes["long_name"] = channel.about
        if check.count:
            mean = channel.slope * check.mean + channel.shift
            attributes |= {"minimum": ends[0], "maximum": ends[1], "mean": mean}
        return attributes | {"missing": check.missing_count + check.saturated_count}

    def _provenance(self) -> dict[str, Any]:
        with self.path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        found = [*self.source.found, *self.assumed, *(self.clock.found() if self.clock else [])]
        conversions = [f"{c.name}: {c.conversion}" for c in self.channels if c.conversion]
        if self.clock is not None and self.clock.conversion:
            conversions.insert(0, f"time: {self.clock.conversion}")
        return provenance({"sheet": self.sheet.model_dump(mode="json", exclude_defaults=True)}) | {
            "file": str(self.path),
            "bytes": self.path.stat().st_size,
            "sha256": digest,
            "reader": self.source.reader,
            "found": found,
            "conversions": conversions,
            "repairs": [*self.source.repairs, *self._repairs()],
            "warnings": self._warnings(),
        }

    def _repairs(self) -> list[str]:
        notes = self.clock.repairs() if self.clock else []
        if self.time_check.dropped:
            n, first = len(self.time_check.dropped), self.time_check.dropped[0]
            notes.append(f"{count(n, 'row')} left out: time does not increase; the first is row {first}")
        for check in self.value_checks:
            if check.saturated_count:
                rows = count(check.saturated_count, "row")
                notes.append(f"{check.name}: {rows} saturated or infinite, from row {check.saturated}: now missing")
        return notes

    def _warnings(self) -> list[str]:
        check = self.time_check
        odd = self.clock.oddities(check.first, check.last, check.median_step) if self.clock else []
        notes = [*odd, *self.doubts]
        if self.time_check.gaps:
            longest = max(self.time_check.gaps, key=lambda gap: gap[1] - gap[0])
            n, length = len(self.time_check.gaps), longest[1] - longest[0]
            many = f"{n} gaps, the longest of" if n > 1 else "a gap of"
            notes.append(f"time: {many} {length:.3g} s before row {longest[2]}")
        for channel, check in zip(self.channels, self.value_checks, strict=True):
            if check.missing_count:
                rows = count(check.missing_count, "row")
                notes.append(f"{check.name}: {rows} missing, the first is row {check.missing[0]}")
            # rows of a table without time have no order
            for value, n, row in check.clipped() if self.time_check.count else []:
                shown = f"{channel.slope * value + channel.shift:.6g} {channel.unit}".strip()
                notes.append(f"{check.name}: stays at its extreme {shown} for {n} rows from row {row}: saturated?")
        return notes


class _Store:
    """One coordinate and some variables along it, in memory while small, else in a netCDF file read on demand."""

    def __init__(self, dim: str, names: list[str]):
        self.dim, self.names = dim, names
        self.pieces: list[list[np.ndarray]] = []
        self.bytes = 0
        self.file: Any = None
        self.path = Path()
        self.rows = 0  # in the file

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.file is not None:
            self.file.close()

    def add(self, along: np.ndarray, values: list[np.ndarray]) -> None:
        """Append rows."""
        self.pieces.append([along, *values])
        self.bytes += along.nbytes * (1 + len(values))
        if self.bytes > _LIMIT:
            self._flush()

    def _flush(self) -> None:
        """Move the rows in memory to the file."""
        import h5netcdf

        if self.file is None:
            _folders.append(tempfile.TemporaryDirectory(prefix="nectosome-"))
            self.path = Path(_folders[-1].name) / "recording.nc"
            self.file = h5netcdf.File(self.path, "w")
            self.file.dimensions = {self.dim: None}
            for name in (self.dim, *self.names):
                self.file.create_variable(name, (self.dim,), "f8", chunks=(100_000,))
        for row in self.pieces:
            start, self.rows = self.rows, self.rows + row[0].size
            self.file.resize_dimension(self.dim, self.rows)
            for name, values in zip((self.dim, *self.names), row, strict=True):
                self.file.variables[name][start:] = values
        self.pieces, self.bytes = [], 0

    def dataset(self) -> "xr.Dataset":
        """All rows; those in a file are read when used."""
        import xarray as xr

        if self.file is None:
            along, *values = (np.concatenate(rows) for rows in zip(*self.pieces, strict=True))
            data = {name: (self.dim, x) for name, x in zip(self.names, values, strict=True)}
            return xr.Dataset(data, coords={self.dim: along})
        self._flush()
        self.file.close()
        self.file = None
        # an index would keep all times in memory
        return xr.open_dataset(
            self.path, engine="h5netcdf", decode_times=False, cache=False, create_default_indexes=False
        )
