"""Parts of a robot as rigid bodies in their starting shape: numbers of each in its own frame, and of all together."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.core.programs.remember import remembered
from nectosome.mechanism import Link, Robot
from nectosome.mechanism.robot import start_poses


class RigidBody(NamedTuple):
    """A part in its starting shape; inertias are [6, 6], (angular, linear), about the origin of its frame."""

    name: str
    rotation: Float[np.ndarray, "3 3"]  # of its frame at the start, to world
    position: Float[np.ndarray, "3"]  # [m]
    inertia: Float[np.ndarray, "6 6"]  # of its own matter [kg m2, kg m, kg]
    added: Float[np.ndarray, "6 6"]  # added mass, all of it under water
    volume: float  # that it displaces [m3]
    moment: Float[np.ndarray, "3"]  # first moment of that volume [m4]

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return float(self.inertia[5, 5])

    @property
    def centre_of_mass(self) -> Float[np.ndarray, "3"]:
        """Place of the centre of mass [m]; the origin without a mass."""
        return _centre(self.inertia) if self.mass else np.zeros(3)

    @property
    def centre_of_buoyancy(self) -> Float[np.ndarray, "3"]:
        """Place of the centre of the displaced volume [m]; the origin without one."""
        return self.moment / self.volume if self.volume else np.zeros(3)


def rigid_bodies(robot: Robot) -> list[RigidBody]:
    """The parts of a robot, as they are at the start."""
    rotation, position = map(np.asarray, remembered(start_poses, robot))
    volume, inertia, added = map(np.asarray, (robot.tree.stations.volume, robot.inertia, robot.added))
    bodies = []
    for part, place in zip(robot.tree.parts, robot.tree.layout, strict=True):
        here = place.stations
        R, p = rotation[here], position[here]
        of_first, at_first = np.eye(3), np.zeros(3)  # pose of the first station: a rod's is its root
        if isinstance(part.body, Link):
            of_first, at_first = np.asarray(part.body.rotation[0]), np.asarray(part.body.position[0])
        frame = R[0] @ of_first.T
        origin = p[0] - frame @ at_first
        own = frame.T @ R, (p - origin) @ frame
        bodies.append(
            RigidBody(
                name=part.name,
                rotation=frame,
                position=origin,
                inertia=summed(inertia[here], *own),
                added=summed(added[here], *own),
                volume=float(volume[here].sum()),
                moment=volume[here] @ own[1],
            )
        )
    return bodies


def joined_rigidly(bodies: Sequence[RigidBody], name: str) -> RigidBody:
    """All bodies as one, in the frame of the first one."""
    R, p = bodies[0].rotation, bodies[0].position
    rotation = np.stack([R.T @ body.rotation for body in bodies])
    position = np.stack([R.T @ (body.position - p) for body in bodies])
    volume = np.array([body.volume for body in bodies])
    turned = np.einsum("nij,nj->i", rotation, np.stack([body.moment for body in bodies]))
    return RigidBody(
        name=name,
        rotation=R,
        position=p,
        inertia=summed(np.stack([body.inertia for body in bodies]), rotation, position),
        added=summed(np.stack([body.added for body in bodies]), rotation, position),
        volume=float(volume.sum()),
        moment=turned + volume @ position,
    )


def summed(
    inertia: Float[np.ndarray, "n 6 6"], rotation: Float[np.ndarray, "n 3 3"], position: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "6 6"]:
    r"""Sum of inertias in a frame in which theirs have these poses: $\sum A^T M A$ with the twists $V_k = A_k V$.

    $$ A = \begin{bmatrix} R^T & 0 \\ -R^T [p] & R^T \end{bmatrix} $$
    """
    A = np.zeros((len(inertia), 6, 6))
    A[:, :3, :3] = A[:, 3:, 3:] = np.swapaxes(rotation, 1, 2)
    A[:, 3:, :3] = -A[:, :3, :3] @ skews(position)
    return np.einsum("nji,njk,nkl->il", A, inertia, A)


def about(inertia: Float[np.ndarray, "6 6"], place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "6 6"]:
    """The inertia about another place [m], along the same axes."""
    return summed(inertia[None], np.eye(3)[None], -place[None])


def skews(x: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Matrices [x] with [x] y = x x y."""
    return np.cross(x[:, None], np.eye(3)).swapaxes(1, 2)


def _centre(inertia: Float[np.ndarray, "6 6"]) -> Float[np.ndarray, "3"]:
    """Centre of mass of an inertia, whose upper right block is m [c]."""
    block = inertia[:3, 3:] / inertia[5, 5]
    return np.array([block[2, 1], block[0, 2], block[1, 0]])


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
