"""Choice of the reader of a file: by its ending, else by its first bytes."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from nectosome.units import InputError

from .file_errors import first_bytes
from .source import Options, TableSource

_READERS = {
    "text": ("text", "open_text"),
    "excel": ("excel", "open_excel"),
    "matlab": ("matlab", "open_matlab"),
    "tdms": ("tdms", "open_tdms"),
    "hdf5": ("hdf5", "open_hdf5"),
    "numpy": ("numpy_files", "open_numpy"),
}
_ENDINGS = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat", ".asc", ".lvm", ".log"), "text"),
    **dict.fromkeys((".xlsx", ".xlsm"), "excel"),
    **dict.fromkeys((".h5", ".hdf5", ".hdf", ".nc", ".cdf"), "hdf5"),
    **dict.fromkeys((".npy", ".npz"), "numpy"),
    ".mat": "matlab",
    ".tdms": "tdms",
    ".tdms_index": "tdms",
}
_BEGINNINGS = {b"\x89HDF": "hdf5", b"CDF": "hdf5", b"TDSm": "tdms", b"\x93NUMPY": "numpy", b"MATLAB 5": "matlab"}


def open_source(path: Path, options: Options) -> TableSource:
    """Open a file with the reader of its format. Raises InputError if it cannot be read."""
    kind = _ENDINGS.get(path.suffix.lower()) or _by_beginning(path)
    module, name = _READERS[kind]
    opens: Callable[[Path, Options], TableSource] = getattr(import_module(f"nectosome.measure.formats.{module}"), name)
    return opens(path, options)


def _by_beginning(path: Path) -> str:
    first = first_bytes(path)
    if path.suffix.lower() in (".xls", ".ods", ".mdf", ".mf4"):
        raise InputError(f"{path.suffix} files are not supported. Save it as .xlsx or .csv.", file=str(path))
    return next((kind for mark, kind in _BEGINNINGS.items() if first.startswith(mark)), "text")
