"""HDF5 and netCDF files: the datasets of one group and one length as columns, with CF attributes, read by slices."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.io.heaps import check_heaps
from nectosome.measure.formats.arrays import ArraySource, LazyArray
from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.pose_tracks import pose_table
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import NamedArray, SkippedEntry, Transposed, choose, classify, text
from nectosome.units import InputError

from .file_errors import COLUMNS, check_memory, damage_as_input_error, first_bytes, wrong_format

if TYPE_CHECKING:
    import h5py

ENDINGS = ".h5", ".hdf5", ".hdf", ".nc", ".cdf"
BEGINNINGS = b"\x89HDF", b"CDF"

_CACHE = 2**25  # bytes
_PACKED = 100  # ratio of sizes from which a file is no recording, but mostly fill values or a constant
_MERE_DIMENSION = "This is a netCDF dimension but not a netCDF variable"  # a dataset without data


def open_hdf5(path: Path, options: Options) -> TableSource:
    """Open an HDF5 file (.h5, .hdf5) or netCDF file (.nc, classic or netCDF-4).

    Raises InputError for another format, a damaged file, and for no table or several.
    """
    import h5py

    start = first_bytes(path)
    if start.startswith((b"CDF\x01", b"CDF\x02")):
        return _open_netcdf3(path, options)
    if start.startswith(b"CDF\x05"):
        raise InputError("has the netCDF format CDF-5. Convert it: nccopy -k nc4 old.nc new.nc.", file=str(path))
    with damage_as_input_error(path), ExitStack() as stack:
        if not h5py.is_hdf5(path):
            raise wrong_format(path, "an HDF5 or netCDF file", start)
        datasets = _datasets(stack.enter_context(open_cached(path, options.memory)))
        poses = pose_table(datasets) if options.table is None else None
        if poses is not None:
            table = choose([poses[0]], None)
            notes = (*poses[1], *table.found)
            return ArraySource("hdf5", path, table.blocks(), notes, close=stack.pop_all().close)
        labels = {name: _labels(dataset) for name, dataset in datasets.items() if dataset.is_scale}
        entries = (_entry(name, dataset, labels) for name, dataset in datasets.items())
        table = choose([entry for entry in entries if entry is not None], options.table)
        return ArraySource(
            "hdf5", path, table.blocks(), table.found, close=stack.pop_all().close, left_out=table.left_out
        )


def open_cached(path: Path, memory: int) -> "h5py.File":
    """Open an HDF5 file with a chunk cache of at most `_CACHE` for all its datasets together.

    Raises InputError for one with too many datasets, and where it, or a chunk of it, is larger than `memory` [bytes]
    when it is unpacked. What is not packed is read by slices, however large it is.
    """
    import h5py

    size = path.stat().st_size
    check_heaps(path)
    with h5py.File(path, "r") as file:
        datasets = _datasets(file).values()
        if len(datasets) > COLUMNS:
            raise InputError(f"has {len(datasets)} datasets, and {COLUMNS} are read at most. Save a part of them.")
        sizes = [(prod(data.shape or ()), prod(data.chunks or ()), data.id.get_type().get_size()) for data in datasets]
        whole = sum(n * each for n, _, each in sizes)
        check_memory([whole] if whole > _PACKED * size else [], memory)
        largest = max((n * each for _, n, each in sizes), default=0)
        check_memory([largest], memory, "a chunk holds when it is unpacked", share=1 / 8)
    return h5py.File(path, "r", rdcc_nbytes=min(_CACHE // 4, _CACHE // max(len(datasets), 1)))


def _datasets(file: "h5py.File") -> "dict[str, h5py.Dataset]":
    """All datasets of a file by path, without those of linked files."""
    import h5py

    datasets: dict[str, h5py.Dataset] = {}

    def visit(path: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            datasets[path] = node

    file.visititems(visit)
    return datasets


def _entry(path: str, dataset: "h5py.Dataset", labels: Mapping[str, Sequence[str]]) -> NamedArray | SkippedEntry | None:
    import h5py

    group, _, name = path.rpartition("/")
    attributes = dict(dataset.attrs)
    if text(attributes.get("NAME", "")).startswith(_MERE_DIMENSION):
        return None
    if dataset.shape is None:
        return SkippedEntry(name, "empty", group)
    if dataset.is_virtual or dataset.external:
        return SkippedEntry(name, "its data are in another file", group)
    try:
        dataset.dtype  # noqa: B018
    except TypeError:
        return SkippedEntry(name, "a type unknown to NumPy", group)
    if h5py.check_string_dtype(dataset.dtype):
        rows = dataset.shape[0] if len(dataset.shape) == 1 else 0
        return SkippedEntry(name, "text", group, rows=rows)  # not read: HDF5 can hang in a damaged heap of strings
    return _described(name, dataset, group, attributes, _dimensions(path, dataset), labels)


def _dimensions(path: str, dataset: "h5py.Dataset") -> list[str]:
    """The paths of a dataset's dimension scales; [] without any."""
    if dataset.is_scale:
        return [path] if len(dataset.shape) == 1 else []
    scales = [str(dimension[0].name).strip("/") if len(dimension) else "" for dimension in dataset.dims]
    return scales if any(scales) else []


def _labels(dataset: "h5py.Dataset") -> Sequence[str]:
    """The labels of a dimension scale that holds text."""
    import h5py

    is_text = dataset.shape is not None and len(dataset.shape) == 1 and h5py.check_string_dtype(dataset.dtype)
    return [str(label) for label in dataset.asstr()[:]] if is_text and len(dataset) <= COLUMNS else ()


def _open_netcdf3(path: Path, options: Options) -> TableSource:
    """Open a classic netCDF file (format 1 or 2), mapped again for each piece, so that read data leave the memory."""
    from scipy.io import netcdf_file

    def mapped(name: str, data: np.ndarray) -> LazyArray:
        def read(rows: Any) -> np.ndarray:
            with netcdf_file(path, mmap=True) as file:
                return np.array(file.variables[name].data[rows])

        return LazyArray(data.shape, data.dtype, read)

    with damage_as_input_error(path):
        with netcdf_file(path, mmap=True) as file:
            entries = [
                _described(name, mapped(name, variable.data), "", variable._attributes, variable.dimensions)
                for name, variable in file.variables.items()
            ]
        table = choose(entries, options.table)
        return ArraySource("netcdf3", path, table.blocks(), table.found, left_out=table.left_out)


def _described(
    name: str,
    array: Any,
    group: str,
    attributes: Mapping[str, Any],
    dimensions: Sequence[str] = (),
    labels: Mapping[str, Sequence[str]] | None = None,
) -> NamedArray | SkippedEntry:
    """An array with unit, dimension and notes of its attributes (CF conventions); `labels` of dimensions, by name."""
    lower = {key.lower(): value for key, value in attributes.items()}
    unit, notes, start = text(lower.get("units", lower.get("unit", ""))), [], ""
    if " since " in unit:
        notes.append(f"{name}: {unit}")
        unit, _, start = unit.partition(" since ")
    if array.dtype.kind in "iuf" and (unpacked := _unpacked(array, lower)) is not None:
        array = unpacked
        if {"scale_factor", "add_offset"} & lower.keys():
            notes.append(f"{name}: unpacked with its scale_factor and add_offset")
    entry = classify(name, array, group, unit=unit, notes=notes, start=start)
    if isinstance(entry, SkippedEntry) or not dimensions:
        return entry
    along, *across = dimensions
    if len(dimensions) == 2 and not entry.is_vector and is_time(_last(across[0])) and not is_time(_last(along)):
        along, across, entry = across[0], [along], replace(entry, array=Transposed(array))
    named = (labels or {}).get(across[0], ()) if across and not entry.is_vector else ()
    return replace(entry, along=along, labels=named, first=_last(along) == name)


def _unpacked(array: Any, lower: Mapping[str, Any]) -> LazyArray | None:
    """Packed numbers as scale * raw + offset, NaN for the raw values that mean missing; None if there is neither."""
    missing = [value for key in ("_fillvalue", "missing_value") for value in _numbers(lower.get(key)) if value == value]
    (scale, *_), (offset, *_) = _numbers(lower.get("scale_factor")) or [1.0], _numbers(lower.get("add_offset")) or [0.0]
    if not missing and (scale, offset) == (1, 0):
        return None

    def read(rows: Any) -> np.ndarray:
        raw = np.asarray(array[rows])
        values = raw.astype(float)
        if (scale, offset) != (1, 0):
            values = values * scale + offset
        return np.where(np.isin(raw, missing), np.nan, values)

    return LazyArray(array.shape, float, read)


def _numbers(value: Any) -> list[float]:
    values = np.ravel(value)
    return values.astype(float).tolist() if values.dtype.kind in "iuf" else []


def _last(path: str) -> str:
    return path.rpartition("/")[2]
