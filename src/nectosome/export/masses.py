"""Mass properties and added mass of each part of a robot, and of the whole, as data that are written as a table."""

import numpy as np
import xarray as xr

from nectosome.mechanism import Robot

from .rigid_bodies import RigidBody, about, joined_rigidly, rigid_bodies

WHOLE = "whole"
_AXES = ["x", "y", "z"]


def mass_properties(robot: Robot) -> xr.Dataset:
    """Mass, centres, inertia, displaced volume and added mass of each part, as it is at the start, and of the whole.

    Numbers of a part are in its own frame (origin at its root, x along it; a mesh in the frame of its file), those of
    the whole, with all joints held, in that of the first part. The inertia is about the centre of mass, the added mass
    about the centre of buoyancy, or the origin of what displaces nothing. Added mass is that of all under water, with
    `added_mass` on velocities, `added_inertia` on angular velocities, and `added_coupling` as the force along the
    second axis of an angular acceleration about the first one.
    """
    bodies = rigid_bodies(robot)
    name = WHOLE if WHOLE not in robot.tree.names else f"{WHOLE} robot"
    every = [*bodies, joined_rigidly(bodies, name)]
    fields = {
        "mass": ("kg", lambda body: body.mass),
        "volume": ("m3", lambda body: body.volume),
        "centre_of_mass": ("m", lambda body: body.centre_of_mass),
        "centre_of_buoyancy": ("m", lambda body: body.centre_of_buoyancy),
        "inertia": ("kg m2", lambda body: about(body.inertia, body.centre_of_mass)[:3, :3]),
        "added_mass": ("kg", lambda body: _added(body)[3:, 3:]),
        "added_inertia": ("kg m2", lambda body: _added(body)[:3, :3]),
        "added_coupling": ("kg m", lambda body: _added(body)[:3, 3:]),
    }
    dims = "part", "axis", "other_axis"
    data = {}
    for field, (unit, of) in fields.items():
        values = np.stack([np.asarray(of(body), dtype=float) for body in every])
        data[field] = (dims[: values.ndim], values, {"units": unit})
    return xr.Dataset(data, {"part": [body.name for body in every], "axis": _AXES, "other_axis": _AXES})


def _added(body: RigidBody) -> np.ndarray:
    return about(body.added, body.centre_of_buoyancy)
