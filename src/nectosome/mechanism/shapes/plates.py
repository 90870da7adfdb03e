"""Flat plates of even thickness by their outlines: areas, moments, and how wide they are across lines."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core.described import number
from nectosome.description import Rigid
from nectosome.description.plates import PlateShape
from nectosome.geometry import Triangles
from nectosome.geometry.outlines import plate_faces

from .contract import Places, RigidShape, Solid


class OutlineMoments(NamedTuple):
    """Area of an outline, and its moments about the axes through its centre."""

    area: Float[Array, ""]  # [m2]
    centre: Float[Array, "2"]  # [m]
    second: Float[Array, "2 2"]  # integral of r r^T over the area [m4]


def outline_moments(points: Float[Array, "n 2"]) -> OutlineMoments:
    r"""Moments of a polygon, whatever its direction and first corner, by triangles from its first corner.

    $$ A = \tfrac12 \sum_k a \times b, \quad A c = \tfrac16 \sum_k (a \times b)(a + b), \quad
       S = \tfrac1{24} \sum_k (a \times b)\,(a a^T + b b^T + (a + b)(a + b)^T) $$

    with the corners a and b of each edge seen from there (Green's theorem), and S then moved to the centre.
    """
    start = points[0]
    a = points - start
    b = jnp.roll(a, -1, axis=0)
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    twice = twice * jnp.sign(jnp.sum(twice))
    area, both = 0.5 * jnp.sum(twice), a + b
    centre = jnp.sum(twice[:, None] * both, axis=0) / (6 * area)
    outer = [x[:, :, None] * x[:, None, :] for x in (a, b, both)]
    second = jnp.sum(twice[:, None, None] * sum(outer), axis=0) / 24
    return OutlineMoments(area, start + centre, second - area * centre[:, None] * centre[None, :])


def outline_range(points: Float[Array, "n 2"]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Smallest and largest of the first coordinates of a polygon [m]."""
    return jnp.min(points[:, 0]), jnp.max(points[:, 0])


def outline_widths(points: Float[Array, "n 2"], at: Float[Array, "k"]) -> tuple[Float[Array, "k"], Float[Array, "k"]]:
    """Widths of a polygon across lines where its first coordinate is `at`, and their middles [m].

    A line that crosses it several times has the sum of the widths, and the middle of all of them.
    """
    a, b = points, jnp.roll(points, -1, axis=0)
    area = jnp.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    x = at[:, None]
    rises, falls = (a[:, 0] <= x) & (x < b[:, 0]), (b[:, 0] <= x) & (x < a[:, 0])
    crosses = rises | falls
    run = jnp.where(crosses, b[:, 0] - a[:, 0], 1.0)
    y = a[:, 1] + (x - a[:, 0]) / run * (b[:, 1] - a[:, 1])
    sign = jnp.sign(area) * jnp.where(falls, 1.0, jnp.where(rises, -1.0, 0.0))
    width, moment = jnp.sum(sign * y, axis=1), 0.5 * jnp.sum(sign * y * y, axis=1)
    return width, moment / width


def plate_inertia(
    mass: Float[Array, ""], moments: OutlineMoments, thickness: Float[Array, ""], upright: bool
) -> Float[Array, "3 3"]:
    """Inertia of an even plate about its centre, in the x-y plane, or upright in the x-z plane [kg m2]."""
    (xx, xy), (_, yy) = mass / moments.area * moments.second
    zz = mass * thickness**2 / 12
    if upright:
        return jnp.array([[yy + zz, 0.0, -xy], [0.0, xx + yy, 0.0], [-xy, 0.0, xx + zz]])
    return jnp.array([[yy + zz, -xy, 0.0], [-xy, xx + zz, 0.0], [0.0, 0.0, xx + yy]])


class FlatPlate(RigidShape):
    """A plate by its outline, flat or upright. Its centre is that of its area; strips run across x.

    A strip sits in the middle of the plate's width there.
    """

    described_by = PlateShape

    def __init__(self, part: Rigid):
        super().__init__(part)
        assert isinstance(part.shape, PlateShape)
        self.plate, self.upright = part.shape, part.shape.plane == "xz"
        self.points, self.thickness = jnp.asarray(self.plate.outline, float), number(self.plate.thickness)
        self.moments, (self.start, self.end) = outline_moments(self.points), outline_range(self.points)
        self.length = self.end - self.start

    @property
    def volume(self) -> Float[Array, ""]:
        """Area times thickness [m3]."""
        return self.moments.area * self.thickness

    def tip(self) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
        """At the largest x of the outline."""
        return jnp.eye(3), jnp.stack([self.end, *jnp.zeros(2)])

    def places(self, fractions: Float[np.ndarray, "n"]) -> Places:
        """The centre, as wide as the plate is on average, and middles of the widths at the other fractions."""
        n, x = fractions.size, self.start + self.length * fractions[1:]
        width, middle = outline_widths(self.points, x)
        position = jnp.concatenate([self.moments.centre[None], jnp.stack([x, middle], axis=-1)])
        in_plane = jnp.concatenate([(self.moments.area / self.length)[None], width])
        thick = jnp.broadcast_to(self.thickness, (n,))
        place = jnp.concatenate([position[:, :1], self._across(position[:, 1], jnp.zeros(n))], axis=1)
        turned = jnp.broadcast_to(jnp.eye(3), (n, 3, 3))
        return Places(turned, place, 0.5 * self._across(in_plane, thick), jnp.zeros(n), in_plane * thick)

    def _across(self, in_plane: Array, normal: Array) -> Float[Array, "n 2"]:
        """Two columns, along y and z."""
        return jnp.stack([normal, in_plane] if self.upright else [in_plane, normal], axis=-1)

    def own_inertia(self, mass: Float[Array, ""]) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
        """`plate_inertia`."""
        return plate_inertia(mass, self.moments, self.thickness, self.upright), jnp.zeros(3)

    def surface(self) -> Triangles:
        """Both faces and the rim."""
        faces = plate_faces(np.asarray(self.points - self.moments.centre), self.plate.thickness)
        x, y, normal = np.moveaxis(faces, -1, 0)
        corners = np.stack([x, -normal, y] if self.upright else [x, y, normal], axis=-1)
        k = np.arange(4 * len(corners)).reshape(-1, 4)
        return Triangles(corners.reshape(-1, 3), np.concatenate([k[:, [0, 1, 2]], k[:, [0, 2, 3]]]))

    def solids(self) -> tuple[Solid, ...]:
        """The box around it."""
        low, high = np.min(self.plate.outline, axis=0), np.max(self.plate.outline, axis=0)
        order = [0, 2, 1] if self.upright else [0, 1, 2]
        half = np.array([*(0.5 * (high - low)), 0.5 * self.plate.thickness])[order]
        return (Solid("box", half, np.eye(3), np.array([*(0.5 * (high + low)), 0.0])[order]),)
