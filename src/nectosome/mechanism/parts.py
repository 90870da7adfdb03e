"""Parts of a robot: a body, its joint to the part before it, and what drives both."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Signal, Stations

from .joints import Joint
from .links import Link
from .rods import SoftRod


class TreePart(eqx.Module):
    """A body, its joint to the parent, and the position of that joint on the parent."""

    name: str = eqx.field(static=True)
    parent: int = eqx.field(static=True)  # index of an earlier part; -1: the world
    node: int = eqx.field(static=True)  # -1: the parent's tip; 0: its root; else a node of a parent rod
    rotation: Float[Array, "3 3"]  # joint frame in the frame of that node
    position: Float[Array, "3"]  # [m]
    joint: Joint
    body: Link | SoftRod
    stations: Stations
    prescribed: Signal | None = None  # the joint's coordinates as a function of time
    drive: Signal | None = None  # generalised force of a driven joint [N m, N]
    prescribed_strains: tuple[int, ...] = eqx.field(static=True, default=())  # indices of strain coordinates of a rod
    strain_signals: tuple[Signal, ...] = ()  # their values as functions of time, in order
    strain_start: Float[Array, "2 nq"] | None = None  # strain coordinates of a rod at the start, and their rates
    beside: tuple[str, ...] = eqx.field(
        static=True, default=()
    )  # see `Tree.beside`, of the robot that it is taken from


def node_at(body: Link | SoftRod, at: str | float) -> int:
    """The node of a part at its "tip" (-1), its "root" (0) or a mark of a rod."""
    if at == "tip":
        return -1
    return body.nodes.index(at) if isinstance(body, SoftRod) and at != "root" else 0


def poses(rotation: Float[Array, "*n 3 3"], position: Float[Array, "*n 3"]) -> Float[Array, "*n 3 4"]:
    """Rotations and positions side by side."""
    return jnp.concatenate([rotation, position[..., None]], axis=-1)
