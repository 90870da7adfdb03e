"""The contract of shapes of rigid parts: mass, water, strips, contact, pictures and export, from traced numbers."""

from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Stations, Water
from nectosome.core.described import is_zero, number, vector
from nectosome.description import Rigid
from nectosome.description.meshes import MeshShape
from nectosome.description.shapes import ShapeDescription
from nectosome.geometry import Triangles
from nectosome.mechanism.parts import Link, axis_poses, spatial_inertia
from nectosome.mechanism.sections import Sections, ellipse

STANDING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # takes z to x
_GAUSS = np.polynomial.legendre.leggauss(8)


class Solid(NamedTuple):
    """A shape for drawings and water in other programs: half sizes along its own axes; a mesh by its description."""

    kind: str  # box, cylinder or capsule (along z), ellipsoid or mesh
    half: Float[np.ndarray, "3"]  # [m]; of a mesh those of the box around it
    rotation: Float[np.ndarray, "3 3"]
    position: Float[np.ndarray, "3"]  # of its middle [m]
    mesh: MeshShape | None = None
    unlike: str = ""  # words for how it differs from the shape of the part


class Places(NamedTuple):
    """A shape at fractions of its length, in the frame of its part; the first one is its centre."""

    rotation: Float[Array, "n 3 3"]
    position: Float[Array, "n 3"]  # [m]
    half_width: Float[Array, "n 2"]  # [m]
    round_axes: Float[Array, "n"]
    area: Float[Array, "n"]  # [m2]


class RigidShape:
    """The shape of one rigid part, from 0 to its length along x; its numbers may be traced.

    A round one gives its `radii`, one of other sections these; all else follows, or is overridden.
    """

    described_by: ClassVar[type[ShapeDescription]]
    middle: ClassVar[float] = 0.5  # its centre of volume as a fraction of the length
    square: ClassVar[bool] = False  # whether its sections are rectangles
    even: ClassVar[bool] = False  # whether they are the same from end to end
    cut: ClassVar[bool] = False  # whether `core.immersion` has what a surface cuts off all of it
    solid: ClassVar[str] = ""  # its kind of `Solid`; without one it is a cylinder of the same length and volume

    def __init__(self, part: Rigid):
        self.part, self.bent = part, self.described_by.bends and not is_zero(part.bend)
        self.length, self.radius = (number(0.0 if x is None else x) for x in (part.length, part.radius))  # [m]

    def radii(self, fractions: Float[Array, "n"]) -> Float[Array, "n"]:
        """Radii of a round one at fractions of its length [m]."""
        raise NotImplementedError

    def sections(self, fractions: Float[np.ndarray, "n"] | Float[Array, "n"]) -> Sections:
        """Sections at fractions of the length."""
        radii = self.radii(jnp.asarray(fractions))
        return ellipse(radii, radii)

    def kinks(self) -> Float[Array, "k"]:
        """Fractions of the length where its pieces end, each of which has polynomials as moments of its sections."""
        return jnp.array([0.0, 1.0])

    def _quadrature(self) -> tuple[Float[Array, "m"], Float[Array, "m"]]:
        """Fractions of the length, and weights that sum to 1."""
        ends, (s, w) = self.kinks(), _GAUSS
        half = 0.5 * jnp.diff(ends)[:, None]
        return jnp.ravel(ends[:-1, None] + half * (s + 1)), jnp.ravel(half * w)

    @property
    def volume(self) -> Float[Array, ""]:
        """Volume of its matter [m3]."""
        s, w = self._quadrature()
        return self.length * w @ self.sections(s).area

    def own_inertia(self, mass: Float[Array, ""]) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
        """Inertia about its centre of mass [kg m2], and the place of that from its centre [m], for an even density."""
        s, w = self._quadrature()
        here, x = self.sections(s), self.length * (s - self.middle)
        far = here.area * x**2
        moments = jnp.stack([here.polar_moment, here.second_moment_y + far, here.second_moment_z + far])
        return jnp.diag(mass / (w @ here.area) * (moments @ w)), jnp.zeros(3)

    def mass_and_inertia(self) -> tuple[Float[Array, ""], Float[Array, "6 6"]]:
        """Mass, and inertia about its centre; what the description gives comes before what the shape says."""
        part, com = self.part, vector(self.part.centre_of_mass)
        mass = number(part.mass) if part.mass is not None else number(part.density) * self.volume
        if part.inertia is None:
            about, place = self.own_inertia(mass)
            return mass, spatial_inertia(mass, about, place + com)
        about = jnp.diag(vector(part.inertia))
        if part.products is not None:
            xy, xz, yz = vector(part.products)
            about += jnp.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])
        return mass, spatial_inertia(mass, about, com)

    def places(self, fractions: Float[np.ndarray, "n"]) -> Places:
        """The shape at fractions of its length."""
        poses, here = axis_poses(self.length, number(self.part.bend), fractions), self.sections(fractions)
        return Places(*poses, here.half_width, here.round_axes, here.area)

    def tip(self) -> tuple[Float[Array, "3 3"], Float[Array, "3"]]:
        """Pose of the tip in the part's frame."""
        R, p = axis_poses(self.length, number(self.part.bend), np.array([1.0]))
        return R[0], p[0]

    def whole(self, here: Places, water: Water, mass: Array, volume: Array) -> tuple[Array, Array, Array]:
        """Half length of all of it [m]; half widths [m] and round axes with those of all of it at its centre."""
        return 0.5 * self.length, here.half_width, here.round_axes

    def built(self, water: Water) -> tuple[Link, Stations]:
        """Rigid link and its stations: its centre with the inertia, then strips along its axis for loads per length.

        Strips displace the water of what is bent or in deep water, and else of what has no closed form under a surface.
        """
        part, surface = self.part, water.surface is not None
        by_strips = self.bent or surface != self.cut
        per_length = any(load.per_length for load in part.loads.values())
        n = part.strips if per_length or (surface and by_strips) else 0
        s, w = np.polynomial.legendre.leggauss(max(n, 1))
        fractions = np.concatenate([[self.middle], 0.5 * (s + 1)[:n]])
        share = np.concatenate([[0.0], 0.5 * w[:n]])
        here, length = self.places(fractions), self.length
        volume = self.volume if part.volume is None else number(part.volume)
        mass, own = self.mass_and_inertia()
        along = jnp.asarray(share) * here.area
        split = volume * along / jnp.sum(along) if n and by_strips else jnp.zeros(n + 1).at[0].set(volume)
        inertia = jnp.zeros((n + 1, 6, 6)).at[0].set(own)
        half, half_width, round_axes = self.whole(here, water, mass, volume)
        stations = Stations.along(length * fractions, length * share, half_width, split, inertia, round_axes)
        half_length = stations.half_length.at[0].set(half)
        return Link(*here[:2], *self.tip()), eqx.tree_at(lambda s: s.half_length, stations, half_length)

    def wet_triangles(self, beside: int) -> tuple[Float[Array, "m 3 3"], Float[Array, ""]] | None:
        """Triangles about its centre [m] and a factor, for buoyancy under a surface; None: buoyancy of its stations.

        Meshes share a number of triangles, and `beside` is how many meshes there are.
        """
        return None

    def chain(self) -> tuple[int, Float[Array, ""], Float[Array, ""]]:
        """Number of spheres whose chain it is in contact, 1 of a sphere; fractions of the length where that ends."""
        return (self.part.strips + 1 if self.bent else 2), jnp.zeros(()), jnp.ones(())

    def spheres(self, along: Float[np.ndarray, "n"]) -> tuple[Float[Array, "n 3"], Float[Array, "n"]]:
        """Places in the part's frame and radii [m] of spheres at fractions of that chain."""
        _, start, end = self.chain()
        _, p = axis_poses(self.length, number(self.part.bend), start + jnp.asarray(along) * (end - start))
        return p, self.radius * jnp.ones(along.size)

    def profile(self, n: int) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]] | None:
        """Places along it over that of its centre, half widths there over those there; None: through its stations."""
        s = 0.5 * (1 - np.cos(np.linspace(0, np.pi, n)))
        r = None if self.even else np.asarray(self.radii(jnp.asarray([self.middle, *s])))
        return None if r is None else (s / self.middle, r[1:] / r[0])

    def surface(self) -> Triangles | None:
        """Its surface about its centre in the part's axes [m]; None where it is drawn by its sections."""
        return None

    def solids(self) -> tuple[Solid, ...]:
        """Its solids in the part's frame, for other programs."""
        half, unlike = 0.5 * float(self.length), ""
        wide, middle = np.asarray(self.sections(np.array([self.middle])).half_width[0]), np.array([half, 0.0, 0.0])
        if self.solid in ("box", "ellipsoid"):
            return (Solid(self.solid, np.array([half, *wide]), np.eye(3), middle),)
        if not self.solid:
            wide = np.full(2, (float(self.volume) / (2 * np.pi * half)) ** 0.5)
            unlike = f"its shape, a {self.part.form}: here it is a cylinder of the same length and volume"
        return (Solid(self.solid or "cylinder", np.array([*wide, half]), STANDING, middle, unlike=unlike),)
