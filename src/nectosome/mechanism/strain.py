"""Bending strain and stress of rods, and of the flexible layers of hinges."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import JointLoad

from .robot import Robot
from .rods import SoftRod, bending


class Bending(NamedTuple):
    """Bending strain and stress at the edges of sections; NaN for rigid parts."""

    strain: Float[Array, "n 2"]  # of each station of a rod, at +r_y and at +r_z of its section
    stress: Float[Array, "n 2"]  # [Pa]
    hinge_strain: Float[Array, "parts"]  # at the face of the flexible layer of the part's hinge
    hinge_stress: Float[Array, "parts"]  # [Pa]


def bending_of(robot: Robot, q: Float[Array, "nq"]) -> Bending:
    r"""Bending at all coordinates q, prescribed ones included.

    Rods: $\epsilon = -\kappa_z r_y$ and $\kappa_y r_z$ with the curvatures relative to the rest shape, $\sigma = E
    \epsilon$. Hinges: the moment $k\theta$ of a layer of thickness h and second moment I gives $\sigma = k \theta h /
    2I$.
    """
    tree = robot.tree
    strains, stresses = [], []
    for part, place in zip(tree.parts, tree.layout, strict=True):
        if isinstance(part.body, SoftRod):
            strain = bending(part.body, q[place.q][part.joint.nq :])
            strains.append(strain)
            stresses.append(part.body.young * strain)
        else:
            strains.append(jnp.full(part.body.half_width.shape, jnp.nan))
            stresses.append(strains[-1])
    hinges = jnp.full((2, len(tree.parts)), jnp.nan)
    for attached in robot.loads:
        if isinstance(attached.load, JointLoad):
            place, joint = tree.layout[attached.part], tree.parts[attached.part].joint
            bent = attached.load.bending(joint.displacement(q[place.q][: joint.nq]))
            hinges = hinges if bent is None else hinges.at[:, attached.part].set(bent)
    return Bending(jnp.concatenate(strains), jnp.concatenate(stresses), *hinges)
