"""Results on disk: an `xarray.Dataset` as netCDF or CSV, its provenance, the check of files that others made."""

import itertools
import json
import os
import platform
import warnings
from collections.abc import Collection, Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from nectosome.io.atomic import write_atomic
from nectosome.io.file_system import reason
from nectosome.io.heaps import check_heaps
from nectosome.units import InputError, kind_of

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import xarray as xr

Dims = tuple[str, ...]
_HDF5 = b"\x89HDF"
_PACKED = 100  # ratio of sizes from which a file holds mostly fill values
_MOST = 1e100  # of any number: its square is finite still
SUFFIXES = (".nc", ".csv")  # of what `save_dataset` writes
PACKAGES = ("jax", "jaxlib", "equinox", "numpy", "pydantic", "xarray", "h5netcdf")


def dataset_of(result: Any) -> "xr.Dataset":
    """The dataset itself, or that of a result that has `to_dataset()`. Raises InputError for anything else."""
    if hasattr(result, "to_dataset"):
        result = result.to_dataset()
    if not hasattr(result, "to_netcdf"):
        raise InputError(f"{kind_of(result)} is given where a result or its dataset is expected.")
    return result


def save_dataset(dataset: Any, path: str | Path) -> None:
    """Write a dataset, or that of a result, as netCDF, or as a table where the path ends in .csv; whole or not at all.

    Only netCDF keeps attributes, such as the provenance. Raises InputError for what is no dataset, and where it cannot
    be written.
    """
    dataset = dataset_of(dataset)
    if Path(path).suffix == ".csv":
        write_atomic(path, table_of(dataset).to_csv(index=False, lineterminator="\n").encode())
    else:
        # made in memory: HDF5 does not survive a disk that fills up under it
        write_atomic(path, bytes(dataset.to_netcdf(engine="h5netcdf")))


def table_of(dataset: "xr.Dataset") -> "pd.DataFrame":
    """Table of a dataset: a row for each time, else for each place on the dimensions that all variables share.

    A variable with more dimensions has a column for each of their labels, as `velocity body x (m/s)`. A table over
    time leaves out variables that do not depend on it; columns of NaN are left out. Where variables share no
    dimension, the table is long: a row for each number, with its variable, unit and labels.
    """
    import pandas as pd

    variables = {str(name): variable for name, variable in dataset.data_vars.items() if variable.size}
    shared = [str(dim) for dim in dataset.dims if all(dim in variable.dims for variable in variables.values())]
    rows = ["time"] if "time" in dataset.dims else shared
    if not rows:
        return _long(dataset)
    chosen = {name: variable for name, variable in variables.items() if set(rows) <= set(variable.dims)}
    places = pd.MultiIndex.from_product([_labels(dataset, dim) for dim in rows], names=rows)
    heads = (_with_unit(dim, dataset[dim]) if dim in dataset.coords else dim for dim in rows)
    columns: dict[str, Any] = {head: places.get_level_values(dim) for head, dim in zip(heads, rows, strict=True)}
    for name, variable in chosen.items():
        others = [str(dim) for dim in variable.dims if dim not in rows]
        values = variable.transpose(*rows, *others).values.reshape(len(places), -1)
        labels = itertools.product(*(map(str, _labels(dataset, dim)) for dim in others))
        for label, column in zip(labels, values.T, strict=True):
            columns[_with_unit(" ".join([name, *label]), variable)] = column
    return pd.DataFrame(columns).dropna(axis="columns", how="all")


def _long(dataset: "xr.Dataset") -> "pd.DataFrame":
    import pandas as pd

    dims = [str(dim) for dim in dataset.dims]
    parts = []
    for name, variable in dataset.data_vars.items():
        places = itertools.product(*(_labels(dataset, str(dim)) for dim in variable.dims))
        part = pd.DataFrame([dict(zip(map(str, variable.dims), place, strict=True)) for place in places])
        part = part.reindex(columns=dims, index=range(variable.size))
        part.insert(0, "quantity" if "variable" in dims else "variable", str(name))
        parts.append(part.assign(value=variable.values.ravel(), unit=str(variable.attrs.get("units", ""))))
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _labels(dataset: "xr.Dataset", dim: str) -> list:
    """Labels along a dimension; where it has none, numbers from 0, of each part from 0 where a text names parts."""
    if dim in dataset.coords:
        return list(dataset[dim].values)
    import numpy as np

    parts = next((x.values for x in dataset.coords.values() if x.dims == (dim,) and x.dtype.kind == "U"), None)
    if parts is None:
        return list(range(dataset.sizes[dim]))
    return [f"{part} {np.sum(parts[:k] == part)}" for k, part in enumerate(parts)]


def _with_unit(name: str, variable: "xr.DataArray") -> str:
    unit = str(variable.attrs.get("units", ""))
    return f"{name} ({unit})" if unit not in ("", "1") else name


def is_results(path: str) -> bool:
    """Return whether a file is a results file, by its name or its first bytes."""
    if path.endswith(".nc"):
        return True
    try:
        with Path(path).open("rb") as file:
            return file.read(len(_HDF5)) == _HDF5
    except (OSError, ValueError):
        return False


def load_dataset(path: str | Path) -> "xr.Dataset":
    """Return the dataset that `save_dataset` wrote as netCDF: same values, types, coordinates and attributes.

    Raises InputError for a missing, foreign or incomplete file, and for one that is much larger when it is unpacked.
    """
    import h5py
    import xarray

    options: dict[str, Any] = {"engine": "h5netcdf", "decode_times": False, "decode_timedelta": False}
    try:
        with Path(path).open("rb") as file:
            size = file.seek(0, os.SEEK_END)
        check_heaps(path)
        with h5py.File(path, "r") as whole:  # h5netcdf leaves a traceback of a file whose head HDF5 cannot read
            whole.attrs.get("_nc3_strict")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of attributes that xarray takes for its own
            with xarray.open_dataset(path, **options) as packed:
                fits = packed.nbytes <= _PACKED * size
                dataset = packed.load() if fits else None
    except OSError as error:
        why = reason(error) if error.errno else "this is not a results file, or it is incomplete"
        raise InputError(f"cannot be read: {why}.", file=str(path)) from None
    except (ImportError, InputError):
        raise
    except Exception:  # the HDF5 reader raises arbitrary exceptions for damaged files
        raise InputError("cannot be read: this is not a results file, or it is damaged.", file=str(path)) from None
    if dataset is None:
        raise InputError(f"is more than {_PACKED} times larger when it is unpacked: it is damaged.", file=str(path))
    for name, variable in dataset.variables.items():
        if variable.dtype.kind in "OT":
            dataset = dataset.assign({name: variable.astype(str)})
    return dataset


def provenance(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data to reproduce a result, as JSON data: `settings`, versions, platform, processors, UTC time."""
    return {
        "nectosome": _version("nectosome"),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "processors": os.cpu_count(),
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": dict(settings),
    }


@cache  # each call reads a file
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


class Contents(NamedTuple):
    """What the readers of a kind of results file take from it; other variables and attributes may be anything.

    - kind: its name in messages, such as "a simulation".
    - needed: numbers that it must have, with their dimensions; known: those that older files lack.
    - finite: which of them are never NaN; endless: which may be infinite.
    - units: which of them need a unit.
    - names: dimensions whose labels are texts, each once.
    - texts: attributes that are text; counts: those that are whole numbers, where there are any; numbers: other ones.
    - encoded: attributes that are JSON, of this type.
    """

    kind: str
    needed: Mapping[str, Dims]
    known: Mapping[str, Dims] = {}
    finite: Collection[str] = ()
    endless: Collection[str] = ()
    units: Collection[str] = ()
    names: Collection[str] = ()
    texts: Collection[str] = ()
    counts: Collection[str] = ()
    numbers: Collection[str] = ()
    encoded: Mapping[str, type] = {}


def check_contents(dataset: "xr.Dataset", contents: Contents, source: str) -> None:
    """Raise InputError with the first thing that is not as `contents` has it; `source` is the name of the file."""
    for what in _faults(dataset, contents):
        raise InputError(f"this is not {contents.kind}: {what}.", file=source)
    for name in (*contents.needed, *contents.known):
        if name in dataset.variables:
            _check_values(dataset[name].values, name, contents, source)


def _faults(dataset: "xr.Dataset", contents: Contents) -> Iterator[str]:
    """What variables, names and attributes have of a wrong kind, or lack."""
    import numpy as np

    for name, dims in (*contents.needed.items(), *contents.known.items()):
        over = f" over {', '.join(dims)}" if dims and dims != (name,) else ""
        fits = name in dataset.variables and dataset[name].dims == dims and dataset[name].dtype.kind == "f"
        if not fits and (name in contents.needed or name in dataset.variables):
            yield f"it has no {name}{over}" if name in contents.needed else f"its {name} has no numbers{over}"
        elif fits and name in contents.units and not isinstance(dataset[name].attrs.get("units"), str):
            yield f"its {name} has no unit"
    for name in contents.names:
        labels = dataset.coords.get(name)
        if labels is None or labels.dims != (name,) or labels.dtype.kind != "U":
            yield f"its {name} has no names"
        elif len({*labels.values.tolist()}) < labels.size:
            yield f"its {name} has a name twice"
    for name in (*contents.texts, *contents.encoded):
        if not isinstance(dataset.attrs.get(name), str):
            yield f"its {name} is missing" if name not in dataset.attrs else f"its {name} is no text"
    for name in (*contents.counts, *contents.numbers):
        kind = np.asarray(dataset.attrs.get(name, 0))
        if kind.ndim or kind.dtype.kind not in ("iu" if name in contents.counts else "iuf") or not np.isfinite(kind):
            yield f"its {name} is no number"
    for name, kind in contents.encoded.items():
        try:
            fits = isinstance(json.loads(dataset.attrs[name]), kind)
        except (ValueError, RecursionError):
            fits = False
        if not fits:
            yield f"its {name} cannot be read"


def _check_values(values: "np.ndarray", name: str, contents: Contents, source: str) -> None:
    import numpy as np

    known = np.isfinite(values)
    if name in contents.finite and not known.all():
        raise InputError(f"its {name} is not finite everywhere.", file=source)
    if name not in contents.endless and np.isinf(values).any():
        raise InputError(f"its {name} is infinite.", file=source)
    if np.abs(values[known].astype(float)).max(initial=0.0) > _MOST:
        raise InputError(f"its {name} is beyond {_MOST:g}.", file=source)
