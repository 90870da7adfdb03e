"""Results on disk: an `xarray.Dataset` as a netCDF file."""

from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.io.atomic import reason, write_atomic
from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray

_HDF5 = b"\x89HDF"


def save_dataset(dataset: "xarray.Dataset", path: str | Path) -> None:
    """Write a dataset as netCDF, atomically. Raises InputError if it cannot be written."""
    # in memory first: HDF5 crashes on a full disk
    write_atomic(path, bytes(dataset.to_netcdf(engine="h5netcdf")))


def is_results(path: str) -> bool:
    """Return whether a file is a results file, by its name or its first bytes."""
    if path.endswith(".nc"):
        return True
    try:
        with Path(path).open("rb") as file:
            return file.read(len(_HDF5)) == _HDF5
    except (OSError, ValueError):
        return False


def load_dataset(path: str | Path) -> "xarray.Dataset":
    """Return a dataset of `save_dataset`, with the same values, types, coordinates and attributes.

    Raises InputError for a missing, foreign or incomplete file.
    """
    import xarray

    try:
        with Path(path).open("rb") as file:
            file.read(1)
        dataset = xarray.load_dataset(path, engine="h5netcdf", decode_timedelta=False)
    except OSError as error:
        why = reason(error) if error.errno else "this is not a results file, or it is incomplete"
        raise InputError(f"cannot be read: {why}.", file=str(path)) from None
    except ImportError:
        raise
    except Exception:  # the HDF5 reader raises arbitrary exceptions for damaged files
        raise InputError("cannot be read: this is not a results file, or it is damaged.", file=str(path)) from None
    for name, variable in dataset.variables.items():
        if variable.dtype.kind in "OT":
            dataset = dataset.assign({name: variable.astype(str)})
    return dataset
