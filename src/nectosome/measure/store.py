"""Rows of a recording while it is read: in memory while they are few, else in a temporary file."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

IN_MEMORY = 100_000_000  # bytes
_folders: list[tempfile.TemporaryDirectory[str]] = []  # removed when this process ends


class Store:
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
