"""Cylinders, straight or bent, boxes, spheroids and points."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Water
from nectosome.core.described import is_zero, number
from nectosome.core.se3 import dot, matmul3
from nectosome.description import Rigid
from nectosome.description.shapes import BoxShape, CylinderShape, PointShape, SpheroidShape
from nectosome.mechanism.parts import axis_poses, spatial_inertia
from nectosome.mechanism.sections import Sections, rectangle

from .contract import Places, RigidShape, Solid

_SMALL = 1e-9  # radius of a point [m]


class Cylinder(RigidShape):
    """A cylinder along x; the axis of a bent one is an arc about y."""

    described_by = CylinderShape
    even, cut, solid = True, True, "cylinder"

    def radii(self, fractions: Float[Array, "n"]) -> Float[Array, "n"]:
        """The radius everywhere."""
        return self.radius * jnp.ones(fractions.size)

    def own_inertia(self, mass: Float[Array, ""]) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
        """Of a bent one about the pose of its middle, by 16 Gauss points along its axis."""
        if not self.bent:
            return super().own_inertia(mass)
        s, w = np.polynomial.legendre.leggauss(16)
        R, p = axis_poses(self.length, number(self.part.bend), np.concatenate([[self.middle], 0.5 * (s + 1)]))
        R, p = matmul3(R[0].T, R[1:]), dot(R[0].T, p[1:] - p[0])
        here = self.sections(np.array([self.middle]))
        moments = jnp.stack([here.polar_moment[0], here.second_moment_y[0], here.second_moment_z[0]])
        share = 0.5 * mass * jnp.asarray(w)
        about = matmul3(R * (moments / here.area[0]), jnp.swapaxes(R, -1, -2)) * share[:, None, None]
        own = jnp.sum(spatial_inertia(share, about, p), axis=0)
        c = own[3:, :3] / mass
        return own[:3, :3] + mass * c @ c, jnp.stack([c[1, 2], c[2, 0], c[0, 1]])


class Cuboid(RigidShape):
    """A box along x, y and z."""

    described_by = BoxShape
    square, even, cut, solid = True, True, True, "box"

    def sections(self, fractions: Float[np.ndarray, "n"] | Float[Array, "n"]) -> Sections:
        """The same rectangle everywhere."""
        one = jnp.ones(fractions.size)
        return rectangle(0.5 * number(self.part.width) * one, 0.5 * number(self.part.height) * one)


class Spheroid(RigidShape):
    """A spheroid about x."""

    described_by = SpheroidShape
    cut, solid = True, "ellipsoid"

    def radii(self, fractions: Float[Array, "n"]) -> Float[Array, "n"]:
        """r sqrt(4 s (1 - s))."""
        return self.radius * jnp.sqrt(4 * fractions * (1 - fractions))

    def whole(self, here: Places, water: Water, mass: Array, volume: Array) -> tuple[Array, Array, Array]:
        """Round in three axes."""
        return 0.5 * self.length, here.half_width, here.round_axes.at[0].set(3.0)

    def chain(self) -> tuple[int, Float[Array, ""], Float[Array, ""]]:
        """The sphere itself."""
        return 1, jnp.asarray(self.middle), jnp.asarray(self.middle)


class MassPoint(Spheroid):
    """A point, for water with a surface a ball of the water that it displaces, or else weighs; drawn as such."""

    described_by = PointShape

    def __init__(self, part: Rigid):
        super().__init__(part)
        self.radius = number(_SMALL)

    def own_inertia(self, mass: Float[Array, ""]) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
        """0."""
        return jnp.zeros((3, 3)), jnp.zeros(3)

    def whole(self, here: Places, water: Water, mass: Array, volume: Array) -> tuple[Array, Array, Array]:
        """The ball."""
        if water.surface is None:
            return self.length, here.half_width, here.round_axes
        ball = mass / water.density if self.part.volume is None or is_zero(self.part.volume) else volume
        half = jnp.cbrt(0.75 / jnp.pi * ball + _SMALL**3)
        return half, half * jnp.ones((1, 2)), jnp.full(1, 3.0)

    def solids(self) -> tuple[Solid, ...]:
        """None."""
        return ()
