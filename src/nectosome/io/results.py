"""Results on disk: an `xarray.Dataset` as a netCDF file."""

from pathlib import Path
from typing import TYPE_CHECKING

from nectosome.io.atomic import reason, write_atomic
from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray

_HDF5 = b"\x89HDF"


def save_dataset(dataset: "xarray.Dataset", path: str | Path) -> None:
    """Write a dataset as netCDF, whole or not at all. Raises InputError where it cannot be written."""
    # made in memory: HDF5 does not survive a disk that fills up under it
    write_atomic(path, bytes(dataset.to_netcdf(engine="h5netcdf")))


def is_results(path: str) -> bool:
    """Return whether that is a results file, by its name or by how it begins."""
    if path.endswith(".nc"):
        return True
    try:
        with Path(path).open("rb") as file:
            return file.read(len(_HDF5)) == _HDF5
    except (OSError, ValueError):
        return False


def load_dataset(path: str | Path) -> "xarray.Dataset":
    """Return the dataset that `save_dataset` wrote: same values, types, coordinates and attributes.

    Raises InputError for a file that is missing, foreign or cut off.
    """
    import xarray

    try:
        with Path(path).open("rb") as file:
            file.read(1)
        dataset = xarray.load_dataset(path, engine="h5netcdf", decode_timedelta=False)
    except OSError as error:
        why = reason(error) if error.errno else "this is not a results file, or it is cut off"
        raise InputError(f"cannot be read: {why}.", file=str(path)) from None
    except ImportError:
        raise
    except Exception:  # the HDF5 reader answers damage with whatever breaks first
        raise InputError("cannot be read: this is not a results file, or it is damaged.", file=str(path)) from None
    for name, variable in dataset.variables.items():
        if variable.dtype.kind in "OT":
            dataset = dataset.assign({name: variable.astype(str)})
    return dataset
