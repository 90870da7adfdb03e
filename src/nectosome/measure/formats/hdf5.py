"""HDF5 and netCDF files: the datasets of one group and one length as columns, read by slices."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome.measure.formats.arrays import ArraySource
from nectosome.measure.formats.cf_attributes import described, text
from nectosome.measure.formats.file_errors import damage_as_input_error, first_bytes, wrong_format
from nectosome.measure.formats.named_arrays import NamedArray, SkippedEntry
from nectosome.measure.formats.netcdf3 import open_netcdf3
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import choose

if TYPE_CHECKING:
    import h5py

_CACHE = 2**25  # bytes
_MERE_DIMENSION = "This is a netCDF dimension but not a netCDF variable"  # a dataset without data


def open_hdf5(path: Path, options: Options) -> TableSource:
    """Open an HDF5 file (.h5, .hdf5) or netCDF file (.nc, classic or netCDF-4).

    Raises InputError for another format, a damaged file, and for no table or several.
    """
    import h5py

    start = first_bytes(path)
    if start.startswith((b"CDF\x01", b"CDF\x02", b"CDF\x05")):
        return open_netcdf3(path, options)
    with damage_as_input_error(path), ExitStack() as stack:
        if not h5py.is_hdf5(path):
            raise wrong_format(path, "an HDF5 or netCDF file", start)
        file = stack.enter_context(open_cached(path))
        table = choose(_inventory(file), options.table)
        return ArraySource("hdf5", path, table.blocks(), table.found, close=stack.pop_all().close)


def open_cached(path: Path) -> "h5py.File":
    """Open an HDF5 file with a chunk cache of at most `_CACHE` for all its datasets together."""
    import h5py

    with h5py.File(path, "r") as file:
        count = len(_datasets(file))
    return h5py.File(path, "r", rdcc_nbytes=min(_CACHE // 4, _CACHE // max(count, 1)))


def _datasets(file: "h5py.File") -> "dict[str, h5py.Dataset]":
    """All datasets of a file by path, without those of linked files."""
    import h5py

    datasets: dict[str, h5py.Dataset] = {}

    def visit(path: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            datasets[path] = node

    file.visititems(visit)
    return datasets


def _inventory(file: "h5py.File") -> list[NamedArray | SkippedEntry]:
    """All datasets of a file as arrays or skipped entries."""
    datasets = _datasets(file)
    labels = {path: _labels(dataset) for path, dataset in datasets.items() if dataset.is_scale}
    return [entry for path, dataset in datasets.items() if (entry := _entry(path, dataset, labels)) is not None]


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
        return SkippedEntry(name, "text", group)  # not read: HDF5 can hang in a damaged heap of strings
    return described(name, dataset, group, attributes, _dimensions(path, dataset), labels)


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
    return [str(label) for label in dataset.asstr()[:]] if is_text else ()
