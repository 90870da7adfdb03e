"""Reading a file: from its columns to quantities over time in SI units, with notes, repairs and warnings.

A recording is an `xarray.Dataset` with the coordinate `time` [s] (`row` for a file without time) and a variable per
quantity, its unit in `units`, its standard error in `error` where the sheet says it. Its attribute `provenance` is
JSON: file, hash, reader, notes on the format (`found`), conversions, repairs and warnings.
"""

import hashlib
import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from nectosome.io import provenance
from nectosome.units import InputError, count, did_you_mean, shorten

from .channels import column_index, doubtful_names, find_channels, find_time, named_channels, unit_doubts, without_time
from .devices import devices_of, other_times, told_clocks, with_one_row_a_time, with_tables_side_by_side
from .formats.file_errors import MEMORY, check_memory, damage_as_input_error
from .formats.source import Piece, TableSource, open_source
from .sheet import Sheet, Split, load_sheet
from .taken_off import take_off
from .timed_channels import TimedChannels

if TYPE_CHECKING:
    import xarray as xr

_ROWS = 100_000  # read at a time
IN_MEMORY = 100_000_000  # bytes
_VALUES, _QUANTITY = "values", "quantity"  # one table in the file: netCDF asks all variables for the length of each
_folders: list[tempfile.TemporaryDirectory[str]] = []  # of large recordings, removed when this process ends
_MOST = 1000  # parts of a file
_LISTED = 8


def read(path: str | Path, sheet: Sheet | str | Path | None = None, *, memory: int = MEMORY) -> "xr.Dataset":
    """Read a recording by a sheet, or by what the file says of itself.

    A recording too large for memory stays in a temporary file until this process ends, and is read from it when used.
    Raises InputError that names file, row and column of what cannot be read, and for a sheet that splits the file.
    """
    recordings = read_all(path, sheet, memory=memory)
    if len(recordings) > 1:
        why = f"splits the file into {len(recordings)} recordings, and one is needed here. Write its value, as in"
        how = f'{why} split: {{column: ..., value: "{shorten(recordings[0].attrs["part"])}"}}.'
        raise InputError(how, file=str(path), field="split")
    return recordings[0]


def read_all(path: str | Path, sheet: Sheet | str | Path | None = None, *, memory: int = MEMORY) -> "list[xr.Dataset]":
    """Read all recordings of a file: those into which `split` in the sheet splits it, else the one.

    Their attribute `part` is the value of each. The contents of a file that is not read piece by piece may take up to
    `memory` [bytes], also when they are unpacked. Raises InputError likewise, and for rows of one value that are not
    together.
    """
    path = Path(path)
    sheet = sheet if isinstance(sheet, Sheet) else Sheet() if sheet is None else load_sheet(sheet)
    split = sheet.split
    labels, drop = split.column if split is not None else None, sheet.repair.rows == "drop"
    options = replace(sheet.file.options, labels=labels, drop=drop, memory=memory)
    with open_source(path, options) as source:
        if split is None:
            return [_Reader(path, sheet, source, memory).read()]
        parts = parts_of(source, split, str(path), _rows_of(source), memory)
        return [_Reader(path, sheet, part, memory, part.label).read() for part in parts]


def _rows_of(source: TableSource) -> int:
    """How many rows are read at a time."""
    return max(1, min(_ROWS, IN_MEMORY // (8 * len(source.columns))))


class _Reader:
    """Reads one file piece by piece."""

    def __init__(
        self,
        path: Path,
        sheet: Sheet,
        source: TableSource,
        memory: int,
        part: str = "",
        counted: dict[str, tuple[float, float]] | None = None,
    ):
        file = f"{path} [{shorten(part)}]" if part else str(path)
        sheet = with_tables_side_by_side(source, sheet, file)
        self.path, self.sheet, self.source, self.part, self.memory = path, sheet, source, part, memory
        self.clock, self.joined = find_time(source, sheet.time, file), list[int]()
        channels = find_channels(source, self.clock, sheet, file)
        if not channels:
            raise InputError("contains no quantity besides the time.", file=file)
        rate = sheet.time.rate if sheet.time is not None else source.rate
        taken = "time" if self.clock is not None or rate else "row"
        channels, renamed = named_channels(channels, sheet.conditions, taken, file)
        channels = [replace(channel, counted=(counted or {}).get(channel.name)) for channel in channels]
        self.assumed, self.doubts = without_time(source, sheet.time) if self.clock is None else ([], [])
        for told, said in zip((self.assumed, self.doubts), unit_doubts(channels, sheet), strict=True):
            told += said
        self.assumed += renamed
        self.devices = devices_of(source, sheet, channels, file, memory)
        others = {channel.name for device in self.devices for channel in device.columns.channels}
        own = [channel for channel in channels if channel.name not in others]
        has_gaps = bool(self.devices or source.times)  # of several tables side by side some are shorter
        self.columns = TimedChannels(source, sheet.time, own, file, clock=self.clock, has_gaps=has_gaps)
        clocks = [self.columns, *(device.columns for device in self.devices)]
        times = {one.clock.index: one.clock.label for one in clocks if one.clock is not None}
        chosen = {name: entry.column for name, entry in sheet.columns.items()}
        self.doubts += other_times(source, sheet, file)
        self.doubts += doubtful_names(source, chosen, channels, times)
        if self.devices and not self.columns.is_timed:
            why = "their readings are resampled at the times of the recording, which has none. Write time:, too."
            raise InputError(why, file=file, field="clocks")

    def read(self) -> "xr.Dataset":
        dim = "time" if self.columns.is_timed else "row"
        with _Store(dim, [channel.name for channel in self.columns.channels]) as store:
            first, pieces = True, self.source.pieces(_rows_of(self.source))
            for piece in with_one_row_a_time(pieces, self.clock.index, self.joined) if self.clock else pieces:
                if first:
                    first = False
                    if self.clock is not None:
                        self.clock.begin(piece.values)
                    for device in self.devices:
                        device.begin(piece.values, self.clock)
                store.add(*self.columns.piece(piece.rows, piece.values))
                for device in self.devices:
                    device.add(piece.rows, piece.values)
            if self.columns.rows == 0:
                raise InputError("contains no rows.", file=str(self.path))
            again = self.columns.started_again()
            for device in self.devices:
                again |= device.columns.started_again()
            if again:  # what is known after the last row only
                return _Reader(self.path, self.sheet, self.source, self.memory, self.part, again).read()
            dataset = store.dataset()
        for channel, attributes in zip(self.columns.channels, self.columns.attributes(), strict=True):
            dataset.variables[channel.name].attrs = attributes  # indexing costs 1 ms each
        for device in self.devices:
            dataset = dataset.assign(device.variables(dataset["time"].values))
        if self.devices:
            dataset = dataset[list(self.sheet.columns)]  # in the order of the sheet
        done = take_off(dataset, self.sheet, str(self.path))
        gaps, begun, error = self.columns.time_check.gaps, 0.0, 0.0
        if self.sheet.time is not None and self.sheet.time.trigger is not None:
            begun, error = self._triggered(dataset, self.sheet.time.trigger)
            dataset = dataset.assign_coords(time=dataset["time"] - begun)
            done.append(f"time: 0 where {self.sheet.time.trigger} rises, {begun:.6g} s on its clock (+- {error:.2g} s)")
        dataset[dim].attrs = {"units": "s"} if dim == "time" else {"units": "1"}
        for name, (value, unit) in self.sheet.conditions.items():
            dataset = dataset.assign_coords({name: ((), value, {"units": unit})})
        dataset.attrs = {
            "title": " ".join([self.sheet.about or self.path.name, *([f"[{self.part}]"] if self.part else [])]),
            "since": self.clock.start if self.clock else "",  # date and time at which the time is 0
            "gaps": json.dumps([(start - begun, end - begun, row) for start, end, row in gaps]),
            **({"trigger_error": error} if begun else {}),
            **({"clocks": json.dumps(told_clocks(self.sheet))} if self.sheet.clocks else {}),
            "provenance": json.dumps(self._provenance(done)),
        } | ({"part": self.part} if self.part else {})
        return dataset

    def _triggered(self, dataset: "xr.Dataset", name: str) -> tuple[float, float]:
        """When a pulse first rises, with its standard error [s]. Raises InputError for a quantity that does not."""
        from .signals.correlation import rise

        where: dict[str, Any] = {"file": str(self.path), "field": "time.trigger"}
        if name not in dataset.data_vars:
            raise InputError(f'"{name}" is no quantity.{did_you_mean(name, map(str, dataset.data_vars))}', **where)
        values = dataset[name].values
        level = 0.5 * (np.nanmin(values) + np.nanmax(values))
        known = dataset[[name]].isel(time=np.flatnonzero(np.isfinite(values)))
        try:
            return rise(known, name, float(level))
        except ValueError as error:
            raise InputError(str(error), **where) from None

    def _provenance(self, done: list[str]) -> dict[str, Any]:
        with self.path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        each = [self.columns, *(device.columns for device in self.devices)]
        clocks = [columns.clock for columns in each if columns.clock is not None]
        doubts = [note for columns in each for note in columns.oddities()] + self.doubts
        what = "joined with the one before, which has the same time and other readings; the first is row"
        joined = [f"{count(len(self.joined), 'row')} {what} {self.joined[0]}"] if self.joined else []
        return provenance({"sheet": self.sheet.model_dump(mode="json", exclude_defaults=True)}) | {
            "file": str(self.path),
            "part": self.part,
            "bytes": self.path.stat().st_size,
            "sha256": digest,
            "reader": self.source.reader,
            "found": [
                *self.source.found,
                *self.assumed,
                *(note for clock in clocks for note in clock.found()),
                *(note for name, clock in self.sheet.clocks.items() for note in clock.found(name)),
            ],
            "conversions": [
                *(note for columns in each for note in columns.conversions()),
                *(note for device in self.devices for note in device.notes),
                *done,
            ],
            "repairs": [
                *self.source.repairs,
                *joined,
                *(note for columns in each for note in columns.repairs()),
            ],
            "warnings": [
                *doubts,
                *(note for columns in each for note in columns.warnings()),
                *(note for device in self.devices for note in device.warnings),
            ],
        }


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
        if self.bytes > IN_MEMORY:
            self._flush()

    def _flush(self) -> None:
        """Move the rows in memory to the file."""
        import h5netcdf

        if self.file is None:
            _folders.append(tempfile.TemporaryDirectory(prefix="nectosome-"))
            self.path = Path(_folders[-1].name) / "recording.nc"
            self.file = h5netcdf.File(self.path, "w")
            self.file.dimensions = {self.dim: None, _QUANTITY: len(self.names)}
            self.file.create_variable(self.dim, (self.dim,), "f8", chunks=(_ROWS,))
            rows = min(_ROWS, sum(along.size for along, *_ in self.pieces))
            self.file.create_variable(_VALUES, (self.dim, _QUANTITY), "f8", chunks=(rows, 1))
        for along, *values in self.pieces:
            start, self.rows = self.rows, self.rows + along.size
            self.file.resize_dimension(self.dim, self.rows)
            self.file.variables[self.dim][start:] = along
            self.file.variables[_VALUES][start:, :] = np.stack(values, axis=1)
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
        every = xr.open_dataset(
            self.path, engine="h5netcdf", decode_times=False, cache=False, create_default_indexes=False
        )
        data = {name: every[_VALUES].variable[:, k] for k, name in enumerate(self.names)}
        return xr.Dataset(data, coords=every.coords)


class FilePart(TableSource):
    """Rows of a file of which one column says the same; the column itself is not among its columns."""

    def __init__(self, source: TableSource, index: int, label: str, pieces: Sequence[Piece]):
        column = source.columns[index]
        self.reader, self.rate, self.repairs, self.label = source.reader, source.rate, source.repairs, label
        self.columns = (*source.columns[:index], *source.columns[index + 1 :])
        self.left_out = {**source.left_out, column.place: (column.name, "what the file is split by")}
        rows = f"rows {pieces[0].rows[0]} to {pieces[-1].rows[-1]}"
        self.found = (*source.found, f"split by {column.name}: {label}, {rows}")
        self._pieces = pieces

    def pieces(self, rows: int) -> Iterator[Piece]:
        """Yield all rows as they were read."""
        yield from self._pieces

    def close(self) -> None:
        """Do nothing: the file is closed by itself."""


def parts_of(source: TableSource, split: Split, file: str, rows: int, memory: int) -> list[FilePart]:
    """The parts of a file, in its order, or the one of `split.value`; read `rows` at a time, and kept in memory.

    Raises InputError that names the row for a missing value, rows of one value that are not together, and for more
    than 1000 parts, for a file of topics, where there is no such column or value, and where the file is larger than
    `memory` [bytes].
    """
    texts = {*source.left_out} | {name for name, _ in source.left_out.values()}
    if split.column in texts:
        why = (
            f'the column "{shorten(split.column)}" is no numbers, and only text files and worksheets are split by text'
        )
        raise InputError(f"{why}. Save it as .csv.", file=file, field="split")
    if source.times:
        raise InputError("is for tables, and this file has topics. Leave it out.", file=file, field="split")
    index = column_index(source, split.column, "split", file)
    name = shorten(source.columns[index].name)
    by_code: dict[float, list[Piece]] = {}
    last, size = np.nan, 0
    for piece in source.pieces(rows):
        size += piece.values.nbytes
        with damage_as_input_error(Path(file)):
            check_memory([size], memory, "the first rows of a file that is split hold")
        codes = piece.values[:, index]
        if np.isnan(codes).any():
            line = int(piece.rows[np.isnan(codes)][0])
            raise InputError("has no value in this row.", file=file, line=line, field=name)
        edges = np.flatnonzero(np.diff(codes)) + 1
        for start, stop in zip([0, *edges], [*edges, len(codes)], strict=True):
            code, line = float(codes[start]), int(piece.rows[start])
            if code != last and code in by_code:
                before = int(by_code[code][-1].rows[-1])
                why = f'rows with "{shorten(_text(source, code))}" are not together: they go on here after row {before}'
                raise InputError(f"{why}. Sort the file by {name}.", file=file, line=line, field=name)
            if code not in by_code and len(by_code) == _MOST:
                why = f"has more than {_MOST} values. Is it the column that says which recording a row is of?"
                raise InputError(why, file=file, field=name)
            values = np.delete(piece.values[start:stop], index, axis=1)
            by_code.setdefault(code, []).append(Piece(piece.rows[start:stop], values))
            last = code
    parts = [FilePart(source, index, _text(source, code), pieces) for code, pieces in by_code.items()]
    if split.value is None:
        return parts
    chosen = [part for part in parts if part.label == split.value]
    if not chosen:
        labels = [shorten(part.label, 40) for part in parts]
        listed = ", ".join(labels[:_LISTED]) + (f" and {len(labels) - _LISTED} more" if len(labels) > _LISTED else "")
        why = f'there is no "{shorten(split.value)}". {count(len(labels), "value")}: {listed}.'
        raise InputError(why, file=file, field=name)
    return chosen


def _text(source: TableSource, code: float) -> str:
    return source.labels[int(code)] if source.labels is not None else f"{code:.15g}"
