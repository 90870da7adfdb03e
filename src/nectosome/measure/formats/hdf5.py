"""HDF5 and netCDF files: the datasets of one group and one length as columns, read by slices."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome.measure.formats.arrays import ArraySource
from nectosome.measure.formats.conventions import described, text
from nectosome.measure.formats.faults import damage_told, foreign, head
from nectosome.measure.formats.items import Item, Other
from nectosome.measure.formats.netcdf3 import open_netcdf3
from nectosome.measure.formats.source import Options, Source
from nectosome.measure.formats.tables import choose

if TYPE_CHECKING:
    import h5py

_CACHE = 2**25  # bytes
_MERE_DIMENSION = "This is a netCDF dimension but not a netCDF variable"  # its dataset holds no data


def open_hdf5(path: Path, options: Options) -> Source:
    """Open an HDF5 file (.h5, .hdf5) or netCDF file (.nc, classic ones as well).

    Raises InputError for what is no such file, is damaged, or holds no table or several.
    """
    import h5py

    start = head(path)
    if start.startswith((b"CDF\x01", b"CDF\x02", b"CDF\x05")):
        return open_netcdf3(path, options)
    with damage_told(path), ExitStack() as stack:
        if not h5py.is_hdf5(path):
            raise foreign(path, "an HDF5 or netCDF file", start)
        file = stack.enter_context(opened(path))
        table = choose(_inventory(file), options.table)
        return ArraySource("hdf5", path, table.blocks(), table.found, close=stack.pop_all().close)


def opened(path: Path) -> "h5py.File":
    """Open an HDF5 file whose datasets together do not keep more than `_CACHE` of what was read of them."""
    import h5py

    with h5py.File(path, "r") as file:
        count = len(_datasets(file))
    return h5py.File(path, "r", rdcc_nbytes=min(_CACHE // 4, _CACHE // max(count, 1)))


def _datasets(file: "h5py.File") -> "dict[str, h5py.Dataset]":
    """All datasets of a file by their paths. Links to other files are not followed."""
    import h5py

    datasets: dict[str, h5py.Dataset] = {}

    def visit(path: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            datasets[path] = node

    file.visititems(visit)
    return datasets


def _inventory(file: "h5py.File") -> list[Item | Other]:
    """Everything in a file that is no group."""
    datasets = _datasets(file)
    labels = {path: _labels(dataset) for path, dataset in datasets.items() if dataset.is_scale}
    return [thing for path, dataset in datasets.items() if (thing := _thing(path, dataset, labels)) is not None]


def _thing(path: str, dataset: "h5py.Dataset", labels: Mapping[str, Sequence[str]]) -> Item | Other | None:
    import h5py

    group, _, name = path.rpartition("/")
    attributes = dict(dataset.attrs)
    if text(attributes.get("NAME", "")).startswith(_MERE_DIMENSION):
        return None
    if dataset.shape is None:
        return Other(name, "empty", group)
    if dataset.is_virtual or dataset.external:
        return Other(name, "its numbers are in another file", group)
    try:
        dataset.dtype  # noqa: B018
    except TypeError:
        return Other(name, "a type that NumPy does not know", group)
    if h5py.check_string_dtype(dataset.dtype):
        return Other(name, "text", group)  # not read: HDF5 can hang in a damaged heap of texts
    return described(name, dataset, group, attributes, _dimensions(path, dataset), labels)


def _dimensions(path: str, dataset: "h5py.Dataset") -> list[str]:
    """The paths of the scales along which a dataset lies; [] where it has none."""
    if dataset.is_scale:
        return [path] if len(dataset.shape) == 1 else []
    scales = [str(dimension[0].name).strip("/") if len(dimension) else "" for dimension in dataset.dims]
    return scales if any(scales) else []


def _labels(dataset: "h5py.Dataset") -> Sequence[str]:
    """The texts of a scale that holds texts."""
    import h5py

    is_text = dataset.shape is not None and len(dataset.shape) == 1 and h5py.check_string_dtype(dataset.dtype)
    return [str(label) for label in dataset.asstr()[:]] if is_text else ()
