"""Classic netCDF files: the variables along one dimension as columns."""

from pathlib import Path
from typing import Any

import numpy as np

from nectosome.measure.formats.arrays import ArraySource
from nectosome.measure.formats.cf_attributes import described
from nectosome.measure.formats.file_errors import damage_as_input_error, first_bytes
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import choose
from nectosome.units import InputError


class NetcdfVariable:
    """A variable of a file that is mapped again for each piece, so that read data do not stay in memory."""

    def __init__(self, path: Path, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]):
        self.shape, self.dtype, self._path, self._name = shape, dtype, path, name

    def __getitem__(self, rows: Any) -> np.ndarray:
        from scipy.io import netcdf_file

        with netcdf_file(self._path, mmap=True) as file:
            return np.array(file.variables[self._name].data[rows])


def open_netcdf3(path: Path, options: Options) -> TableSource:
    """Open a classic netCDF file (format 1 or 2). Raises InputError if it is damaged or holds no table."""
    from scipy.io import netcdf_file

    if first_bytes(path).startswith(b"CDF\x05"):
        raise InputError("has the netCDF format CDF-5. Convert it: nccopy -k nc4 old.nc new.nc.", file=str(path))
    with damage_as_input_error(path):
        with netcdf_file(path, mmap=True) as file:
            entries = [
                described(
                    name,
                    NetcdfVariable(path, name, variable.data.shape, variable.data.dtype),
                    "",
                    variable._attributes,
                    variable.dimensions,
                )
                for name, variable in file.variables.items()
            ]
        table = choose(entries, options.table)
        return ArraySource("netcdf3", path, table.blocks(), table.found)
