r"""Added mass of bodies, which enters mass matrix and gyroscopic terms once; its increase near the floor.

Behind a limb whose flow across separates the water carried resists accelerations only, and a steady drag coefficient
holds all of its pressure (Morison et al. 1950). With the velocity v against the water and the turning $\omega$ of a
section that carries the mass A, in its frame, the force is $-A (\dot v + \omega \times v)$ without a moment.
Kirchhoff's equations, which all added mass enters, have the force $-A \dot v - \omega \times A v$ and the moment
$-v \times A v$ of potential flow (Munk 1924), which along a slender body is Lighthill's reactive force (1971).
"""

from abc import abstractmethod
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import REFERENCE_DENSITY, Assumed, Load, ReshapingLoad, Strips, Water, wetted
from nectosome.core.described import number, numbers, vector
from nectosome.core.se3 import cross
from nectosome.description import AddedMassLoad, Rigid
from nectosome.description.loads import CylinderAddedMassLoad, GivenAddedMassLoad, NearFloorLoad, SpheroidAddedMassLoad
from nectosome.description.mesh_added_mass import MeshAddedMassLoad
from nectosome.units import dimension_of, scale_to_si, show_quantity

from .foil_theory import plate_strip_share
from .places import Carrier

_SIDES = {"floor": "over a floor", "slow_surface": "below a slow surface", "fast_surface": "below a fast surface"}


class AddedMass(Load):
    """Base of all added masses: no own force, energy-conserving."""

    inertial = carries = mild = True

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"] | None, Any]:
        """None: the equations of motion take `inertia`."""
        return None, z


class SlenderAddedMass(AddedMass):
    """Added mass of slender parts, behind which the flow across may separate."""

    separated: bool = eqx.field(static=True, kw_only=True, default=False)

    @abstractmethod
    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """Added mass of each station, or of all at the centre: diagonal in its frame."""

    @property
    def inertial(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Whether the flow is attached."""
        return not self.separated

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"] | None, Any]:
        """What separated flow lacks of Kirchhoff's force and moment."""
        if not self.separated:
            return None, z
        A = jnp.diagonal(self.inertia(strips, water), axis1=1, axis2=2)[:, 3:]
        turning, v = strips.angular_velocity, strips.velocity
        lacks = cross(turning, A * v) - A * cross(turning, v)
        return wetted(t, strips, water)[..., None] * jnp.concatenate([cross(v, A * v), lacks], axis=1), z

    def in_stream(self, water: Water) -> tuple[Assumed, ...]:
        """Whether its momentum moves along the part, in a current."""
        how = "not along the part" if self.separated else "along the part"
        source = "held, flow separates: Morison" if self.separated else "flow attached: Lighthill, Munk"
        return () if water.current is None else (Assumed("momentum moves", how, source),)


def _at_centre(matrix: Array, strips: Strips) -> Array:
    return jnp.pad(matrix[None], ((0, strips.weight.shape[0] - 1), (0, 0), (0, 0)))


class StripAddedMass(SlenderAddedMass):
    r"""Per length $\rho\pi\,diag(C_t r_y r_z,\ C_n r_z^2,\ C_n r_y^2)$ on translation; slender bodies: C_n = 1.

    Where the motion across runs along the body as a wave, its neighbours carry part of the water: C_n has the factor
    `wave_share` of the motion's wavelength. A body that ends carries less than its strips: with its length L, C_n has
    the factor `plate_strip_share` of height over length, too.
    """

    normal: Float[Array, ""]  # C_n [-]
    tangential: Float[Array, ""]  # C_t [-]
    wavelength: Float[Array, ""] | None = None  # [m]; None: long against the section
    length: Float[Array, ""] | None = None  # L [m]; None: long against the section
    by_station = True
    described_by = AddedMassLoad

    @classmethod
    def from_description(cls, described: AddedMassLoad, part: Carrier) -> "StripAddedMass":
        """Of its numbers."""
        ends = part.length if described.fin and described.length is None else described.length
        wavelength, length = (None if x is None else number(x) for x in (described.wavelength, ends))
        own = numbers(described, "normal", "tangential")
        return cls(**own, wavelength=wavelength, length=length, separated=bool(described.separated))

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """Added mass of each station [kg]."""
        ry, rz = strips.half_width[:, 0], strips.half_width[:, 1]
        zero, along_y, along_z = jnp.zeros_like(ry), self.normal * rz**2, self.normal * ry**2
        if self.wavelength is not None:
            k = 2 * jnp.pi / self.wavelength
            along_y, along_z = along_y * wave_share(k * rz, k * ry), along_z * wave_share(k * ry, k * rz)
        if self.length is not None:
            along_y = along_y * plate_strip_share(2 * rz / self.length)
            along_z = along_z * plate_strip_share(2 * ry / self.length)
        line = jnp.stack([zero, zero, zero, self.tangential * ry * rz, along_y, along_z], axis=-1)
        return (water.density * jnp.pi * strips.weight[:, None] * line)[..., None] * jnp.eye(6)

    def assumed(self, described: AddedMassLoad, water: Water) -> tuple[Assumed, ...]:
        """Of waves, and along the part."""
        along = (Assumed("along the part", self.tangential, "slender body"),)
        long = {"wavelength": "waves along it", "length": "whole body"}
        open_ = tuple(Assumed(what, "long", f"no {name}") for name, what in long.items() if getattr(self, name) is None)
        if described.fin and described.length is None:
            open_ = *open_, Assumed("whole body", self.length, "a fin", "m")
        return *along * ("tangential" not in described.model_fields_set), *open_, *self.in_stream(water)


def wave_share(half_height: Float[Array, "n"], half_thickness: Float[Array, "n"]) -> Float[Array, "n"]:
    r"""Added mass of a section whose motion is a wave along the body over that of a long wave.

    With half widths across the motion and along it, times the wavenumber k. The potential obeys
    $\nabla^2 \phi = k^2 \phi$ around the section, which gives $-K_1(\kappa)/(\kappa K_1'(\kappa))$ of a circle, and of
    a plate the solution of an integral equation. Here is $(1 + (c \kappa)^p)^{-1/p}$ with $c, p = \pi/4, 1.55$ of a
    plate and 1, 1.32 of a circle, evenly between by thickness over height: within 0.015 of both, and right for short
    waves.
    """
    round_share = jnp.minimum(half_thickness / jnp.where(half_height > 0, half_height, 1.0), 1.0)
    c, p = jnp.pi / 4 + (1 - jnp.pi / 4) * round_share, 1.55 - 0.23 * round_share
    kappa = c * jnp.where(half_height > 0, half_height, 1.0)
    return (1 + kappa**p) ** (-1 / p)


class _MatrixAddedMass(AddedMass):
    r"""A full 6x6 matrix of a rigid body about its centre, by blocks.

    $$ \begin{bmatrix} rotational & coupling \\ coupling^T & mass \end{bmatrix} $$ acts on (angular, linear) velocity.
    """

    mass: Float[Array, "3 3"]  # [kg]
    coupling: Float[Array, "3 3"]  # [kg m]
    rotational: Float[Array, "3 3"]  # [kg m2]

    def matrix(self) -> Float[Array, "6 6"]:
        """The whole of it."""
        top = jnp.concatenate([self.rotational, self.coupling], axis=1)
        return jnp.concatenate([top, jnp.concatenate([self.coupling.T, self.mass], axis=1)])


class GivenAddedMass(_MatrixAddedMass):
    """Given added mass of a rigid body about its centre."""

    described_by = GivenAddedMassLoad

    @classmethod
    def from_description(cls, described: GivenAddedMassLoad, part: Carrier) -> "GivenAddedMass":
        """Of the full matrix, rotation before translation and symmetric, or of the numbers axis by axis."""
        if described.matrix is not None:
            m = jnp.triu(jnp.stack([vector(row) for row in described.matrix]))
            m += jnp.triu(m, 1).T
            return cls(m[3:, 3:], m[:3, 3:], m[:3, :3])
        return cls(jnp.diag(vector(described.mass)), jnp.zeros((3, 3)), jnp.diag(vector(described.inertia)))

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """The matrix at the centre."""
        return _at_centre(self.matrix(), strips)


class MeshAddedMass(_MatrixAddedMass):
    """Added mass of a mesh, as panels gave it: over the water's density [m3], [m4] and [m5].

    Near a floor or a surface it is that of one height at any: no force comes from its change with the height.
    """

    described_by = MeshAddedMassLoad

    @classmethod
    def from_description(cls, described: MeshAddedMassLoad, part: Carrier) -> "MeshAddedMass":
        """Of what was computed of the mesh."""
        m = jnp.asarray(described.known.matrix)
        return cls(m[3:, 3:], m[:3, 3:], m[:3, :3])

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """The matrix at the centre, times the density."""
        return _at_centre(water.density * self.matrix(), strips)

    def assumed(self, described: MeshAddedMassLoad, water: Water) -> tuple[Assumed, ...]:
        """Its diagonal, and in the same unit about how far off it may be; that alone where it is larger."""
        near, height, density = described.near, described.height, float(water.density)
        at = "" if near is None or height is None else f" {height:.4g} m {_SIDES[near]}"
        assumed, sizes = list[Assumed](), zip(jnp.diag(self.matrix()).tolist(), described.known.error, strict=True)
        for k, (value, error) in enumerate(sizes):
            how, unit = ("about", "kg m2") if k < 3 else ("along", "kg")
            value, error, what = density * value, float(f"{density * error:.1g}"), f"{how} {'xyz'[k % 3]}"
            if value < error:
                assumed.append(
                    Assumed(what, f"below {show_quantity(error, dimension_of(unit))}", f"panels{at}, its error")
                )
                continue
            own = show_quantity(value, dimension_of(unit)).partition(" ")[2]
            assumed.append(Assumed(what, value, f"panels{at}, +- {error / scale_to_si(own)[0]:.4g} {own}", unit))
        return tuple(assumed)


class SpheroidAddedMass(AddedMass):
    """A spheroid in unbounded potential flow (Lamb 1932, art. 114-115, 373); half axes a along x, b across."""

    half_length: Float[Array, ""]  # a [m]
    radius: Float[Array, ""]  # b [m]
    described_by = SpheroidAddedMassLoad

    @classmethod
    def from_description(cls, described: SpheroidAddedMassLoad, part: Carrier) -> "SpheroidAddedMass":
        """Of the shape of the part."""
        assert isinstance(part.limb, Rigid)
        return cls(0.5 * number(part.limb.length), number(part.limb.radius))

    def assumed(self, described: SpheroidAddedMassLoad, water: Water) -> tuple[Assumed, ...]:
        """Its coefficients, over the displaced mass and inertia."""
        whats = "along the part", "across", "turning"
        each = zip(whats, lamb_coefficients(self.half_length / self.radius), strict=True)
        return tuple(Assumed(what, value, "Lamb 1932") for what, value in each)

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """k1, k2 of the displaced mass for translation, k' of its inertia for rotation across the axis."""
        k1, k2, k3 = lamb_coefficients(self.half_length / self.radius)
        mass = water.density * 4 / 3 * jnp.pi * self.half_length * self.radius**2
        across = k3 * mass / 5 * (self.half_length**2 + self.radius**2)
        zero = jnp.zeros_like(mass)
        return _at_centre(jnp.diag(jnp.stack([zero, across, across, k1 * mass, k2 * mass, k2 * mass])), strips)


def lamb_coefficients(ratio: Float[Array, ""]) -> tuple[Array, Array, Array]:
    r"""Lamb's k1 (along), k2 (across), k' (rotation) of a spheroid with half axes a = ratio * b.

    With $e^2 = 1 - 1/ratio^2$, $\alpha = 2(1-e^2)/e^3 (artanh\, e - e)$, $\beta = 1/e^2 - (1-e^2)/e^3\, artanh\, e$:
    $k_1 = \alpha/(2-\alpha)$, $k_2 = \beta/(2-\beta)$,
    $k' = e^4 (\beta-\alpha) / ((2-e^2)(2e^2 - (2-e^2)(\beta-\alpha)))$; continued to oblate ones (ratio below 1) and to
    the sphere, with 1/2, 1/2, 0.
    """
    s = 1 - 1 / ratio**2  # e^2, negative for oblate
    small = jnp.abs(s) < 0.04
    x = jnp.where(small, 0.5, s)
    root = jnp.sqrt(jnp.abs(x))
    prolate = jnp.arctanh(jnp.where(x > 0, root, 0.5)) / root
    oblate = jnp.arctan(root) / root
    closed = (jnp.where(x > 0, prolate, oblate) - 1) / x  # (artanh e - e) / e^3
    series = jnp.zeros_like(s)
    for k in reversed(range(14)):
        series = series * s + 1 / (2 * k + 3)
    g = jnp.where(small, series, closed)
    alpha = 2 * (1 - s) * g
    beta = 1 - (1 - s) * g
    difference = beta - alpha
    # k' tends to 0/0 at the sphere; difference = s d with smooth d
    ratio_series = jnp.zeros_like(s)
    for k in reversed(range(13)):
        ratio_series = ratio_series * s + 6 / ((2 * k + 3) * (2 * k + 5))
    d = jnp.where(small, ratio_series, jnp.where(small, 1.0, difference / x))
    return alpha / (2 - alpha), beta / (2 - beta), s**2 * d / ((2 - s) * (2 - (2 - s) * d))


class CylinderAddedMass(SlenderAddedMass):
    r"""A rigid round cylinder across its axis: $C \rho\pi r^2 L$, for rotation $C \rho\pi r^2 L^3/12$; strip theory."""

    length: Float[Array, ""]  # [m]
    radius: Float[Array, ""]  # [m]
    coefficient: Float[Array, ""]  # C [-]
    described_by = CylinderAddedMassLoad

    @classmethod
    def from_description(cls, described: CylinderAddedMassLoad, part: Carrier) -> "CylinderAddedMass":
        """Of the shape of the part."""
        assert isinstance(part.limb, Rigid)
        own = number(part.limb.length), number(part.limb.radius), number(described.coefficient)
        return cls(*own, separated=bool(described.separated))

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """diag(0, I, I, 0, m, m) at the centre."""
        mass = self.coefficient * water.density * jnp.pi * self.radius**2 * self.length
        turning = mass * self.length**2 / 12
        zero = jnp.zeros_like(mass)
        return _at_centre(jnp.diag(jnp.stack([zero, turning, turning, zero, mass, mass])), strips)

    def assumed(self, described: CylinderAddedMassLoad, water: Water) -> tuple[Assumed, ...]:
        """Its coefficient."""
        open_ = "coefficient" not in described.model_fields_set
        return *(Assumed("across", self.coefficient, "strip theory"),) * open_, *self.in_stream(water)


class NearFloor(ReshapingLoad):
    r"""Additional added mass and drag near the floor, as functions of the height h above it.

    The factor $s(h)$ is 1 up to `full`, 0 above `none`, and $1 - 3 x^2 + 2 x^3$ between, with
    $x = (h - full)/(none - full)$. Drag is $F_i = -\tfrac12 s \rho A_i |v_i| v_i$, $M_i = -s \rho c_i |w_i| w_i$. With
    the added mass s m, diagonal in the body frame, the water's kinetic energy $T = \tfrac12 s\, v \cdot m v$ depends on
    the position; Lagrange's equations then contain the force $\partial T/\partial h = \tfrac12 s'(h)\, v \cdot m v$
    upwards beside the rate of momentum (Lamb 1932, art. 136-137), which conserves energy. Zero without a floor.

    Of a body in the surface all of it has the share of its volume that is under water.
    """

    mass: Float[Array, "3"]  # m along local x, y, z [kg]
    drag_area: Float[Array, "3"]  # drag areas A [m2]
    rotational: Float[Array, "3"]  # c [m5]
    full: Float[Array, ""]  # height up to which all of it is there [m]
    none: Float[Array, ""]  # height from which on nothing is [m]
    on_first = True
    described_by = NearFloorLoad

    @classmethod
    def from_description(cls, described: NearFloorLoad, part: Carrier) -> "NearFloor":
        """Of the moments in water of the reference density."""
        vectors = vector(described.mass), vector(described.drag_area), vector(described.rotational) / REFERENCE_DENSITY
        return cls(*vectors, number(described.full), number(described.none))

    def carried(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        """Added mass at this height, and its rate [kg]."""
        share, slope = self.share(strips, water)
        v = strips.velocity[0]
        climb = sum(strips.rotation[0, 2, i] * v[i] for i in range(3))
        if water.current is not None:
            climb = climb + water.flow(t, strips.position[:1])[0][0, 2]
        one = jnp.diag(jnp.concatenate([jnp.zeros(3), self.mass]))
        return share * one, slope * climb * one

    def share(self, strips: Strips, water: Water) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Factor s at the height of the first station, and its derivative [1/m]."""
        if water.floor is None:
            return jnp.zeros(()), jnp.zeros(())
        width = self.none - self.full
        x = jnp.clip((strips.position[0, 2] - water.floor - self.full) / width, 0.0, 1.0)
        return 1 - x * x * (3 - 2 * x), -6 * x * (1 - x) / width

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Drag, and the upward derivative of the water's energy, on the first station."""
        share, slope = (wetted(t, strips, water)[0] * x for x in self.share(strips, water))
        v, w, up = strips.velocity[0], strips.angular_velocity[0], strips.rotation[0, 2]
        lift = 0.5 * slope * sum(self.mass[i] * v[i] * v[i] for i in range(3))
        dense = share * water.density
        moment = [-dense * self.rotational[i] * jnp.abs(w[i]) * w[i] for i in range(3)]
        force = [lift * up[i] - 0.5 * dense * self.drag_area[i] * jnp.abs(v[i]) * v[i] for i in range(3)]
        return strips.at_first(jnp.stack([*moment, *force])), z
