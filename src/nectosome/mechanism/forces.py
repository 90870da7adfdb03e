"""What acts on a robot at one time."""

from typing import NamedTuple

from jaxtyping import Array, Float

from .carried import AtSurface
from .tree import PartShape


class Forces(NamedTuple):
    """All forces at one time; their sum is the residual."""

    shape: PartShape
    twist: Float[Array, "n 6"]  # of the stations, body frame
    wrenches: tuple[Array, ...]  # of each group of loads on its stations, station frame
    on_joints: tuple[Array, ...]  # of each group of loads and of tendons along the velocities of their joints
    on_cranks: tuple[Array, ...]  # of each group of loads whose cranks joints turn, on these cranks [N m]
    in_rods: tuple[Array, ...]  # of each group of loads inside rods along their velocities
    pair_wrenches: tuple[Array, ...]  # of each group of pairs on the first parts, and on the second ones
    joint: Float[Array, "nv"]  # sum of those on joints
    crank: Float[Array, "nv"]  # sum of those on cranks
    active: Float[Array, "nv"]  # sum of those inside rods
    paired: Float[Array, "nv"]  # sum of those of pairs
    added: Float[Array, "n 6 6"]  # current added mass
    fluid: Float[Array, "n 6"]  # inertia force of the added mass, station frame
    reshaping: Float[Array, "n 6"] | None  # wrench of the changing added mass; None if it is constant
    surface: AtSurface | None  # added mass that comes and goes there; None if all is under water
    slamming: Float[Array, "n 6"] | None  # wrench of the water that the body meets at its surface
    inertia: Float[Array, "n 6"]  # rate of momentum of the body's own matter
    elastic: Float[Array, "nv"]  # K q of the rods
    viscous: Float[Array, "nv"]  # D v of the rods
    drive: Float[Array, "nv"]  # of driven joints
    residual: Float[Array, "nv"]  # zero at free coordinates, the reaction at prescribed ones
