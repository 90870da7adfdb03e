"""The same table of times and forces as a file of every format that is read."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import xarray as xr
from nptdms import ChannelObject, TdmsWriter
from openpyxl import Workbook
from scipy.io import savemat

Table = dict[str, np.ndarray]


def mat73(path: Path, fill: Callable[[h5py.File], None]) -> None:
    """Write HDF5 as MATLAB does: after a block of its own."""
    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: now HDF5 schema 1.00 .".ljust(124))
        raw.write(b"\x00\x02IM")


def _text(delimiter: str, decimal: str = ".") -> Callable[[Path, Table], None]:
    def write(path: Path, table: Table) -> None:
        rows = zip(*(column.tolist() for column in table.values()), strict=True)
        lines = [table, *([repr(x).replace(".", decimal) for x in row] for row in rows)]
        path.write_text("".join(delimiter.join(line) + "\n" for line in lines))

    return write


def _excel(path: Path, table: Table) -> None:
    book = Workbook()
    book.active.append(list(table))
    for row in zip(*(column.tolist() for column in table.values()), strict=True):
        book.active.append([None if np.isnan(x) else x for x in row])
    book.save(path)


def _mat73(path: Path, table: Table) -> None:
    def fill(file: h5py.File) -> None:
        for name, column in table.items():
            file.create_dataset(name, data=column[None]).attrs["MATLAB_class"] = np.bytes_("double")

    mat73(path, fill)


def _tdms(path: Path, table: Table) -> None:
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("log", name, column) for name, column in table.items()])


def _hdf5(path: Path, table: Table) -> None:
    with h5py.File(path, "w") as file:
        for name, column in table.items():
            file[name] = column


def _netcdf(engine: str) -> Callable[[Path, Table], None]:
    def write(path: Path, table: Table) -> None:
        data = xr.Dataset({name: ("sample", column) for name, column in table.items()})
        data.to_netcdf(path, engine=engine)

    return write


def _records(path: Path, table: Table) -> None:
    np.save(path, np.rec.fromarrays(list(table.values()), names=",".join(table)))


FORMATS: dict[str, tuple[str, int, Callable[[Path, Table], None]]] = {
    "comma": ("a.csv", 2, _text(",")),
    "decimal comma": ("a.csv", 2, _text(";", ",")),
    "tab": ("a.tsv", 2, _text("\t")),
    "blanks": ("a.txt", 2, _text(" ")),
    "excel": ("a.xlsx", 2, _excel),
    "mat 4": ("a.mat", 1, lambda path, table: savemat(path, table, format="4")),
    "mat 5": ("a.mat", 1, savemat),
    "mat 7": ("a.mat", 1, lambda path, table: savemat(path, table, do_compression=True)),
    "mat 7.3": ("a.mat", 1, _mat73),
    "tdms": ("a.tdms", 1, _tdms),
    "hdf5": ("a.h5", 1, _hdf5),
    "netcdf 3": ("a.nc", 1, _netcdf("scipy")),
    "netcdf 4": ("a.nc", 1, _netcdf("h5netcdf")),
    "npy": ("a.npy", 1, _records),
    "npz": ("a.npz", 1, lambda path, table: np.savez(path, **table)),
}
"""By name: a file's name, the row of its first sample, and how it is written."""
