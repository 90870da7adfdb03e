"""Tables of flows in netCDF files: velocities over any of time, x, y and z, in SI units."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome.io.schema.described import wrong
from nectosome.units import InputError, unit_to_si

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

AXES = {"time": "times", "x": "x", "y": "y", "z": "z"}
"""Dimensions of a file, and the fields that have their values."""
_VELOCITIES = ("u", "v", "w")  # along x, y, z
_MOST = 20_000  # points of a table


def read_flow_table(path: Path, file: str) -> dict[str, Any]:
    """Return the fields of a table whose file messages call `file`; times count from the first one.

    Raises the error of the field `file` for what is no such table.
    """
    import numpy as np
    import xarray as xr

    from nectosome.geometry import packed
    from nectosome.io.results import load_dataset

    try:
        data = load_dataset(path)
    except InputError as error:
        why = str(error).replace("a results file", "a netCDF 4 file")
        raise wrong("file", f"{why} Write one by xarray: data.to_netcdf(FILE, engine='h5netcdf').") from None
    known = [name for name in _VELOCITIES if name in data.data_vars]
    if not known:
        there = ", ".join(map(str, data.data_vars)) or "nothing"
        raise wrong("file", f"{file} has no u, v or w, the velocities along x, y and z, but {there}.")
    dims = list(map(str, data[known].dims))
    if any(dim not in AXES or dim not in data.coords for dim in dims):
        why = f"{file} has its velocities over {', '.join(dims)}."
        raise wrong("file", f"{why} Name these dimensions time, x, y and z (up), each with its values, in s and in m.")
    if (points := int(np.prod([data.sizes[dim] for dim in dims]))) > _MOST:
        raise wrong("file", f"{file} has {points} points, at most {_MOST} are taken. Cut a part out, or thin it.")
    axes = {dim: _in_si(data[dim], file, "s" if dim == "time" else "m") for dim in dims}
    for dim, values in axes.items():
        if not (np.isfinite(values).all() and (np.diff(values) > 0).all()):
            raise wrong("file", f"{file}: the values of {dim} must be numbers that increase.")
    if "time" in axes:
        axes["time"] = axes["time"] - axes["time"][0]
    for name in known:
        for bad in np.argwhere(~np.isfinite(data[name].values))[:1]:
            places = zip(map(str, data[name].dims), bad.tolist(), strict=True)
            where = ", ".join(f"{dim} = {axes[dim][k]:.6g}" for dim, k in places)
            raise wrong("file", f"{file}: {name} is no number at {where}. Fill it in, or cut that part out.")
    each = [
        xr.zeros_like(data[known[0]]) if name not in known else data[name].copy(data=_in_si(data[name], file, "m/s"))
        for name in _VELOCITIES
    ]
    whole = [x.expand_dims([dim for dim in AXES if dim not in x.dims]).transpose(*AXES) for x in xr.broadcast(*each)]
    velocity = np.stack([x.values for x in whole], axis=-1).astype("<f8")
    found = {AXES[dim]: tuple(values.tolist()) for dim, values in axes.items() if values.size > 1}
    return {**found, "velocity": packed(velocity.tobytes())}


def _in_si(values: "xr.DataArray", file: str, unit: str) -> "np.ndarray":
    """Values in the unit, which theirs becomes in SI. Raises the error of the field `file` for another one."""
    given = str(values.attrs.get("units", unit)).partition(" since ")[0]
    try:
        factor, si = unit_to_si(given)
    except ValueError as error:
        raise wrong("file", f"{file}: the unit of {values.name}, {given}: {error}.") from None
    if si != unit:
        raise wrong("file", f"{file} has {values.name} in {given}, and {unit} is needed.")
    return factor * values.values.astype(float)
