"""Parts of a robot: a body, its joint to the part before it, and what drives both; rigid links as bodies."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Signal, Stations
from nectosome.core.se3 import exp_se3, matmul3, skew

from .joints import Joint
from .rods import SoftRod
from .soft_bodies import SoftBody
from .webs import Web


class Link(eqx.Module):
    """A rigid body. Station 0 is the centre of its shape; strips, if any, follow from its rear end to its front end.

    The inertia is concentrated at the centre. The part's frame is at the root, local +x along the (possibly bent) axis
    from the root to the tip. A body that lies elsewhere in its frame has `ends` of its own.
    """

    rotation: Float[Array, "n 3 3"]  # of the stations in the part frame
    position: Float[Array, "n 3"]  # [m]
    tip_rotation: Float[Array, "3 3"]
    tip_position: Float[Array, "3"]
    ends: Float[Array, "2 3"] | None = None  # rear and front, in the part frame [m]; None: root and tip
    nq: ClassVar[int] = 0  # number of own coordinates


def spatial_inertia(mass: Array, about_com: Array, com: Array) -> Array:
    r"""Inertia [..., 6, 6] about a frame with parallel axes, in which the centre of mass is at `com`.

    $$ \begin{bmatrix} I - m [c]^2 & m [c] \\ -m [c] & m 1 \end{bmatrix} $$
    """
    c = skew(com)
    m = mass[..., None, None]
    top = jnp.concatenate([about_com - m * matmul3(c, c), m * c], axis=-1)
    bottom = jnp.concatenate([-m * c, jnp.broadcast_to(m * jnp.eye(3), c.shape)], axis=-1)
    return jnp.concatenate([top, bottom], axis=-2)


def axis_poses(
    length: Array, bend: Array, fractions: Float[np.ndarray, "n"] | Float[Array, "n"]
) -> tuple[Float[Array, "n 3 3"], Float[Array, "n 3"]]:
    """Poses along an axis of constant curvature bend/length about y, in the root frame."""
    straight = jnp.stack([jnp.zeros_like(bend), bend, jnp.zeros_like(bend), length, *jnp.zeros((2,))])
    return exp_se3(jnp.asarray(fractions)[:, None] * straight)


class TreePart(eqx.Module):
    """A body, its joint to the parent, and the position of that joint on the parent."""

    name: str = eqx.field(static=True)
    parent: int = eqx.field(static=True)  # index of an earlier part; -1: the world
    node: int = eqx.field(static=True)  # -1: the parent's tip; 0: its root; else a node of a parent rod
    rotation: Float[Array, "3 3"]  # joint frame in the frame of that node
    position: Float[Array, "3"]  # [m]
    joint: Joint
    body: Link | SoftBody | Web
    stations: Stations
    prescribed: Signal | None = None  # the joint's coordinates as a function of time
    drive: Signal | None = None  # generalised force of a driven joint [N m, N]
    prescribed_strains: tuple[int, ...] = eqx.field(static=True, default=())  # indices of strain coordinates of a rod
    strain_signals: tuple[Signal, ...] = ()  # their values as functions of time, in order
    strain_start: Float[Array, "2 nq"] | None = None  # strain coordinates of a rod at the start, and their rates
    between: tuple[tuple[int, int], ...] = eqx.field(static=True, default=())  # of a web: stations beside each strip
    beside: tuple[str, ...] = eqx.field(
        static=True, default=()
    )  # see `Tree.beside`, of the robot that it is taken from


def node_at(body: Link | SoftBody | Web, at: str | float) -> int:
    """The node of a part at its "tip" (-1), its "root" (0) or a mark of a rod."""
    if at == "tip":
        return -1
    return body.nodes.index(at) if isinstance(body, SoftRod) and at != "root" else 0


def poses(rotation: Float[Array, "*n 3 3"], position: Float[Array, "*n 3"]) -> Float[Array, "*n 3 4"]:
    """Rotations and positions side by side."""
    return jnp.concatenate([rotation, position[..., None]], axis=-1)
