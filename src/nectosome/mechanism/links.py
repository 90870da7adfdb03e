"""Rigid links: mass and inertia (from the shape or given), and the strips along their axis for loads."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core.se3 import dot, exp_se3, matmul3, skew

from .sections import Sections


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


def cylinder_moments(mass: Array, length: Array, half_y: Array, half_z: Array) -> Float[Array, "3"]:
    """Principal moments of an elliptic cylinder along x about its centre."""
    return mass * jnp.stack(
        [(half_y**2 + half_z**2) / 4, half_z**2 / 4 + length**2 / 12, half_y**2 / 4 + length**2 / 12]
    )


def box_moments(mass: Array, length: Array, width: Array, height: Array) -> Float[Array, "3"]:
    """Principal moments of a box about its centre; length, width, height along x, y, z."""
    return mass / 12 * jnp.stack([width**2 + height**2, length**2 + height**2, length**2 + width**2])


def spheroid_moments(mass: Array, half_length: Array, radius: Array) -> Float[Array, "3"]:
    """Principal moments of a spheroid about its centre; half_length along x, radius across."""
    across = half_length**2 + radius**2
    return mass / 5 * jnp.stack([2 * radius**2, across, across])


def axis_poses(
    length: Array, bend: Array, fractions: Float[np.ndarray, "n"]
) -> tuple[Float[Array, "n 3 3"], Float[Array, "n 3"]]:
    """Poses along an axis of constant curvature bend/length about y, in the root frame."""
    straight = jnp.stack([jnp.zeros_like(bend), bend, jnp.zeros_like(bend), length, *jnp.zeros((2,))])
    return exp_se3(jnp.asarray(fractions)[:, None] * straight)


def bent_inertia(
    mass: Array, length: Array, bend: Array, sections: Sections, centre: tuple[Array, Array]
) -> Float[Array, "6 6"]:
    """Inertia about the `centre` pose of a uniform bent cylinder, summed over 16 Gauss points along its axis."""
    s, w = np.polynomial.legendre.leggauss(16)
    R, p = axis_poses(length, bend, 0.5 * (s + 1))
    R = matmul3(centre[0].T, R)
    p = dot(centre[0].T, p - centre[1])
    moments = jnp.stack([sections.polar_moment[0], sections.second_moment_y[0], sections.second_moment_z[0]])
    share = 0.5 * mass * jnp.asarray(w)
    about = matmul3(R * (moments / sections.area[0]), jnp.swapaxes(R, -1, -2)) * share[:, None, None]
    return jnp.sum(spatial_inertia(share, about, p), axis=0)
