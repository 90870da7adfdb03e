"""Means of a sweep by name, and which of them tell anything."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

MEANS = ("speed", "turn_rate", "power", "efficiency", "cost_of_transport")
_NOTHING = 1e-3  # mean of a force that is left of its peak where nothing holds the robot: what the tolerance leaves


def mean_of(found: "xr.Dataset", name: str) -> "xr.DataArray":
    """A mean over the axes of a sweep: one of MEANS, or `force.x`, what pushes the robot along the world's x [N].

    Along the axes of a robot that nothing holds, the mean of the force is 0.
    """
    if name in MEANS:
        return found[name]
    axis = name.removeprefix("force.")
    force, peak = (found[own].sel(axis=axis, drop=True) for own in ("force", "force_peak"))
    held = force.where((abs(force) > _NOTHING * peak) | force.isnull(), 0)
    return held.rename(f"force {axis}").assign_attrs(found["force"].attrs)


def telling(found: "xr.Dataset") -> dict[str, "xr.DataArray"]:
    """Means that are known and not 0 at some point, by name."""
    forces = [f"force.{axis}" for axis in found["axis"].values] if "force" in found else []
    means = {name: mean_of(found, name) for name in (MEANS[0], *forces, *MEANS[1:])}
    return {name: values for name, values in means.items() if values.notnull().any() and (values != 0).any()}
