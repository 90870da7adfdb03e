"""Drag: quadratic, with lift, by strips (Morison) or lumped; viscous, by resistive force theory; skin friction."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import REFERENCE_DENSITY, Assumed, Flow, Load, Strips, Water, safe_norm, wetted
from nectosome.core.described import number, numbers, vector
from nectosome.core.rows import rows
from nectosome.description.drag import PlateDragLoad, StokesDragLoad
from nectosome.description.loads import DragLoad, LumpedDragLoad, SkinFrictionLoad

from .places import Carrier, SheetCarrier

_LIGHTHILL = 0.09  # q over the length of a wave along the helix
_THINNED = 2.7  # Taylor (1952), whose force per length is 1/2 rho d U^2 5.4 Re^-1/2 cos(a) sin(a)^1/2


class StripDrag(Load):
    r"""Drag and lift per length of a slender body (Armanini et al. 2022, eq. 12).

    In the section's frame, x along the body, with the velocity v relative to the water and half widths r_y, r_z:

    $$ f = -\rho |v| \begin{bmatrix} \tfrac{\pi}{2} r C_t v_x \\ r_z C_n v_y - r C_l v_z \\ r C_l v_y + r_y C_n v_z
    \end{bmatrix}, \quad r = \tfrac12 (r_y + r_z) $$

    Lift does no work; drag dissipates energy in any motion. No force out of the water.
    """

    normal: Float[Array, ""]  # C_n [-]
    tangential: Float[Array, ""]  # C_t [-]
    lift: Float[Array, ""]  # C_l [-]
    dissipative = by_station = mild = True
    described_by = DragLoad

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each station [N m, N]."""
        vx, vy, vz = jnp.moveaxis(strips.velocity, -1, 0)
        ry, rz = strips.half_width[:, 0], strips.half_width[:, 1]
        r = strips.radius
        f = jnp.stack(
            [
                0.5 * jnp.pi * r * self.tangential * vx,
                rz * self.normal * vy - r * self.lift * vz,
                r * self.lift * vy + ry * self.normal * vz,
            ],
            axis=-1,
        )
        f = -(water.density * wetted(t, strips, water) * strips.weight * safe_norm(strips.velocity))[:, None] * f
        return jnp.concatenate([jnp.zeros_like(f), f], axis=-1), z

    def flow(self, strips: Strips) -> Flow:
        """Of the section's diameter."""
        across, height = broadside(strips)
        return Flow(safe_norm(strips.velocity), 2 * strips.radius, across, height)

    def assumed(self, described: DragLoad, water: Water) -> tuple[Assumed, ...]:
        """Of the drag along the part."""
        open_ = "tangential" not in described.model_fields_set
        return (Assumed("along the part", self.tangential, "not given"),) if open_ else ()


def broadside(strips: Strips) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
    """Velocities across the larger side of sections, along y and z, 0 of the other one; and the height of that side."""
    ry, rz = strips.half_width[:, 0], strips.half_width[:, 1]
    larger = jnp.stack([ry <= rz, rz <= ry], axis=-1)
    return jnp.where(larger, strips.velocity[:, 1:], 0.0), 2 * jnp.maximum(ry, rz)


class PlateDrag(Load):
    r"""Blade-element drag per length of a plate or bar, by the normal velocity of each face.

    In the section's frame, with half widths r_y, r_z and the velocity v relative to the water (Hu et al. 2024, eq. 7,
    whose square drops the sign):

    $$ f_y = -\rho C_n r_z |v_y| v_y, \quad f_z = -\rho C_n r_y |v_z| v_z $$

    A plate that oscillates by the amplitude a meets its own vortices: at small Keulegan-Carpenter numbers
    $KC = 2\pi a/h$ of the face's height h its coefficient is larger than in a steady stream (see `oscillating_drag`).

    No force along the axis or out of the water.
    """

    normal: Float[Array, ""]  # C_n [-]
    amplitude: Float[Array, ""] | None = None  # a [m]; None: long against the height
    dissipative = by_station = mild = True
    described_by = PlateDragLoad

    @classmethod
    def from_description(cls, described: PlateDragLoad, part: Carrier | SheetCarrier) -> "PlateDrag":
        """Of its numbers, and of the stations of its part."""
        normal, amplitude, start = number(described.normal), described.amplitude, described.start_up
        if start is None:
            return cls(normal, None if amplitude is None else number(amplitude))
        return StartingPlateDrag(
            normal,
            **numbers(start, "extra", "distance", "softness"),
            length=None if start.length is None else number(start.length),
            whole=part.height if isinstance(part, SheetCarrier) else None,
            rows=part.rows if isinstance(part, SheetCarrier) else tuple(range(part.stations.x.shape[0])),
        )

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each station [N m, N]."""
        _, vy, vz = jnp.moveaxis(strips.velocity, -1, 0)
        ry, rz = strips.half_width[:, 0], strips.half_width[:, 1]
        scale = -water.density * wetted(t, strips, water) * strips.weight
        none = jnp.zeros_like(vy)
        fy, fz = self._coefficient(rz) * rz * jnp.abs(vy) * vy, self._coefficient(ry) * ry * jnp.abs(vz) * vz
        return jnp.stack([none, none, none, none, scale * fy, scale * fz], axis=-1), z

    def flow(self, strips: Strips) -> Flow:
        """Of the height of the larger side."""
        across, height = broadside(strips)
        return Flow(safe_norm(strips.velocity[:, 1:]), height, across, height)

    def _coefficient(self, half_height: Float[Array, "n"]) -> Float[Array, "*n"]:
        """Of faces."""
        if self.amplitude is None:
            return self.normal
        return jnp.maximum(self.normal, oscillating_drag(jnp.pi * self.amplitude / half_height))


class StartingPlateDrag(PlateDrag):
    r"""The same for a plate that starts and reverses: more, until its starting vortices have grown with the distance.

    Two states w lag the velocity v across the plate's larger side, of height h, relative to the water, by the distance
    moved at the speed $S = \sqrt{v_y^2 + v_z^2 + v_0^2}$:

    $$ f = -\tfrac12 \rho h C_n S \sum_i \kappa_i (v - w_i), \quad \dot w_i = \frac{S}{\lambda_i h} (v - w_i)
       - \frac{2 |v_x|}{l} w_i $$

    on top of the steady drag. After a distance s from rest that is a factor $1 + \sum_i \kappa_i e^{-s/(\lambda_i h)}$,
    far from the start 1. The term with the body's length l brings in water without vortices, of which the mean strip is
    half of the length behind; without l it is left out. The wake has the energy $\tfrac14 \rho h^2 C_n
    \sum_i \kappa_i \lambda_i w_i^2$ per length, which grows by less than the work of this force: no motion gains any.

    The numbers: with $C_n = 2$, a long plate's, a settled sine takes the power of Graham's (1980) $8\,KC^{-1/3}$
    (`oscillating_drag`) within 1.6 % from KC = 1 to 40; nothing else is fitted. Shorter plates have it in proportion to
    $C_n$: in potential flow the velocity at the edge of a disc is $2/\pi$ of that at a long plate's, which leaves it
    $2 (2/\pi)^{8/3} = 0.60$ of the vortex force (Graham's argument), and 0.56 of the steady drag.

    The strips of a web or a soft plate are parts of one plate: h of the distances is that of the whole sheet, and
    strips in a row across it share their vortices.

    Of a thick bar the law is another one (Graham 1980). This is the force of the vortices: what the acceleration takes
    is the added mass of potential flow, another load.
    """

    extra: Float[Array, "2"] = eqx.field(kw_only=True)  # kappa
    distance: Float[Array, "2"] = eqx.field(kw_only=True)  # lambda
    softness: Float[Array, ""] = eqx.field(kw_only=True)  # v_0 [m/s]
    length: Float[Array, ""] | None = eqx.field(kw_only=True)  # l [m]; None: no motion along itself
    rows: tuple[int, ...] = eqx.field(static=True, kw_only=True)  # of stations that share vortices, by station
    whole: Float[Array, "n"] | None = eqx.field(kw_only=True, default=None)  # h of which strips are parts [m]
    dissipative = by_station = mild = False  # the wake gives back some of its energy; its states are quick

    def initial(self) -> Float[Array, "n 2"]:
        """No vortices: two states w [m/s] of each row."""
        return jnp.zeros((max(self.rows) + 1, 2))

    def force(
        self, t: Array, strips: Strips, z: Float[Array, "k 2"], water: Water
    ) -> tuple[Float[Array, "n 6"], Float[Array, "k 2"]]:
        """Wrench on each station [N m, N], and the rates of the states."""
        steady, _ = super().force(t, strips, z, water)
        half = strips.half_width
        upright = half[:, 0] <= half[:, 1]
        height, place = 2 * jnp.max(half, axis=1), np.array(self.rows)
        v, w = self._shared(strips.velocity, height, place), rows(z, place)
        speed = jnp.sqrt(v[:, 1] ** 2 + v[:, 2] ** 2 + self.softness**2)
        lag = jnp.where(upright, v[:, 1], v[:, 2])[:, None] - w
        rates = (speed / (height if self.whole is None else self.whole))[:, None] * lag / self.distance
        if self.length is not None:
            rates -= (2 * jnp.abs(v[:, 0]) / self.length)[:, None] * w
        scale = 0.5 * water.density * wetted(t, strips, water) * strips.weight * self.normal * height * speed
        f = -scale * (lag @ self.extra)
        push = steady.at[:, 4].add(jnp.where(upright, f, 0.0)).at[:, 5].add(jnp.where(upright, 0.0, f))
        return push, rows(rates, np.unique(place, return_index=True)[1])

    def flow(self, strips: Strips) -> Flow:
        """Of the height of the larger side, or of the whole sheet."""
        own = super().flow(strips)
        return own if self.whole is None else own._replace(length=self.whole, height=self.whole)

    def _shared(self, velocity: Float[Array, "n 3"], height: Float[Array, "n"], place: np.ndarray) -> Array:
        """Velocities, of stations that share vortices their mean by the heights."""
        count = max(self.rows) + 1
        if count == place.size:
            return velocity
        alike = jnp.asarray(np.arange(count)[:, None] == place, dtype=float)
        return rows((alike @ (height[:, None] * velocity)) / (alike @ height)[:, None], place)

    def assumed(self, described: PlateDragLoad, water: Water) -> tuple[Assumed, ...]:
        """How much more drag a start has, how soon that fades, and how it moves."""
        assert described.start_up is not None
        heights = " and ".join(f"{float(x):g}" for x in self.distance)
        known = {
            "extra": Assumed("drag at a start, of the steady one", 1 + jnp.sum(self.extra), "from Graham 1980"),
            "distance": Assumed("which fades over", f"{heights} heights", "from Graham 1980"),
            "length": Assumed("its vortices", "move along with it", "no length"),
        }
        return tuple(one for name, one in known.items() if name not in described.start_up.model_fields_set)


def oscillating_drag(keulegan_carpenter: Float[Array, "*n"]) -> Float[Array, "*n"]:
    r"""Drag coefficient of a flat plate that oscillates across itself in still water: $8\,KC^{-1/3}$.

    Graham (1980), by the growth of vortices at sharp edges, with the constant of measured plates at KC below about 10;
    it comes down to a plate's 2 in a steady stream at KC = 64.
    """
    return 8 * keulegan_carpenter ** (-1 / 3)


class LumpedDrag(Load):
    r"""Drag at a rigid body's centre, by axis: $F_i = -\tfrac12 \rho A_i |v_i| v_i$, $M_i = -\rho c_i |w_i| w_i$.

    Of a body that stands out of the water, by the share of its volume under it.
    """

    drag_area: Float[Array, "3"]  # drag areas C_d A along local x, y, z [m2]
    rotational: Float[Array, "3"]  # c [m5]
    dissipative = on_first = mild = True
    described_by = LumpedDragLoad

    @classmethod
    def from_description(cls, described: LumpedDragLoad, part: Carrier) -> "LumpedDrag":
        """Of the moments in water of the reference density."""
        return cls(vector(described.drag_area), vector(described.rotational) / REFERENCE_DENSITY)

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on the centre, zero on other stations."""
        twist = jnp.concatenate([strips.angular_velocity[0], strips.velocity[0]])
        drag = water.density * jnp.concatenate([self.rotational, 0.5 * self.drag_area])
        return strips.at_first(-wetted(t, strips, water)[0] * drag * jnp.abs(twist) * twist), z

    def flow(self, strips: Strips) -> Flow:
        """Of the square root of the largest drag area."""
        area = jnp.max(self.drag_area)
        return Flow(safe_norm(strips.velocity[:1]), jnp.sqrt(jnp.where(area > 0, area, 1.0))[None] * (area > 0))


class StokesDrag(Load):
    r"""Viscous drag per length of a slender round part, in the section's frame with x along the part:

    $$ f = -(\zeta_t v_x,\ \zeta_n v_y,\ \zeta_n v_z), \quad m_x = -4\pi\mu r^2 w_x, \quad
    \zeta_t = \frac{2\pi\mu}{\ln(2l/r) - c}, \quad \zeta_n = \frac{4\pi\mu}{\ln(2l/r) + 1/2} $$

    with the velocity v relative to the water, its viscosity $\mu$ and the radius r, the mean half axis of the section.
    Gray and Hancock (1955): c = 1/2, and l is the wavelength. Lighthill (1976), for a helix that swims without a load:
    c = 0, and l = q = 0.09 of the length of a wave along the helix. Each strip is dragged as if the others were not
    there; the moment is that of a long cylinder in still water. No force out of the water.

    By Lamb (1911) an endless cylinder across a slow stream has the drag $4\pi\mu |v|/(1/2 - \gamma - \ln(Re/8))$ with
    the Reynolds number $Re = \rho |v| 2r/\mu$: that of $\zeta_n$ with l = 2.2 r/Re, where the water's inertia ends the
    flow. From Re = 0.1 on that is nearer than a wave of 22 radii.
    """

    wavelength: Float[Array, ""]  # [m]
    lighthill: bool = eqx.field(static=True)  # his coefficients, else those of Gray and Hancock
    dissipative = by_station = True  # not mild: what is light for the water's viscosity comes to rest at once
    described_by = StokesDragLoad

    @classmethod
    def from_description(cls, described: StokesDragLoad, part: Carrier) -> "StokesDrag":
        """Of a part."""
        return cls(number(described.wavelength), described.coefficients == "lighthill")

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each station [N m, N]."""
        r = strips.radius
        reach = jnp.log(2 * (_LIGHTHILL if self.lighthill else 1.0) * self.wavelength / r)
        along = 2 / (reach - (0.0 if self.lighthill else 0.5))
        across = 4 / (reach + 0.5)
        about = 4 * r**2 * strips.angular_velocity[:, 0]
        vx, vy, vz = strips.velocity.T
        none = jnp.zeros_like(vx)
        wrench = jnp.stack([about, none, none, along * vx, across * vy, across * vz], axis=-1)
        return -(jnp.pi * water.viscosity * wetted(t, strips, water) * strips.weight)[:, None] * wrench, z

    def flow(self, strips: Strips) -> Flow:
        """Of the section's diameter."""
        return Flow(safe_norm(strips.velocity), 2 * strips.radius)


def friction_coefficient(reynolds: Float[Array, "*n"]) -> Float[Array, "*n"]:
    r"""Friction coefficient of one side of a plate by its Reynolds number along the flow.

    The larger one of laminar flow, $1.328/\sqrt{Re}$ (Blasius 1908), and of a boundary layer that turns turbulent at
    5e5, $0.455/(\log_{10} Re)^{2.58} - 1700/Re$ (Prandtl and Schlichting; Schlichting 1979, eq. 21.16).
    """
    reynolds = jnp.maximum(reynolds, 1.0)
    above = jnp.maximum(reynolds, 1e4)
    return jnp.maximum(1.328 / jnp.sqrt(reynolds), 0.455 / jnp.log10(above) ** 2.58 - 1700 / above)


FRICTION_LAW = Assumed("friction", "laminar, turbulent", "Schlichting 1979")


class SkinFriction(Load):
    r"""Friction along a body per length, against its velocity u along its axis through the water.

    Of a body that goes straight ahead it is that of a plate of its length L, $f_1 = \tfrac12 \rho C_f(Re_L) p\,u^2$
    with the perimeter p of the section (see `friction_coefficient`). One that moves across at w as well has a thinner
    boundary layer (Bone; Lighthill 1971), of a yawed cylinder (Taylor 1952)

    $$ f_2 = 2.7\, \rho\, u \sqrt{\nu\, d\, w} $$

    with d, here of the circle with the same perimeter. Both limits are kept: $f = \sqrt{f_1^2 + f_2^2}$.
    """

    length: Float[Array, ""]  # L, of the whole body along the flow [m]
    dissipative = by_station = mild = True
    described_by = SkinFrictionLoad

    @classmethod
    def from_description(cls, described: SkinFrictionLoad, part: Carrier) -> "SkinFriction":
        """Of a part; without a length that of the part."""
        return cls(number(part.length if described.length is None else described.length))

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each station [N m, N]."""
        u, (ry, rz) = strips.velocity[:, 0], strips.half_width.T
        perimeter = jnp.where(strips.round_axes < 1, 4 * (ry + rz), _ellipse_perimeter(ry, rz))
        kinematic = water.viscosity / water.density
        ahead = 0.5 * friction_coefficient(jnp.abs(u) * self.length / kinematic) * perimeter * jnp.abs(u)
        across = jnp.sum(strips.velocity[:, 1:] ** 2, axis=-1)
        w = jnp.sqrt(jnp.where(across > 0, across, 1.0)) * (across > 0)
        squared = ahead**2 + _THINNED**2 * kinematic * perimeter / jnp.pi * w
        rate = jnp.sqrt(jnp.where(squared > 0, squared, 1.0)) * (squared > 0)
        f = -water.density * wetted(t, strips, water) * strips.weight * rate * u
        return jnp.zeros((f.shape[0], 6)).at[:, 3].set(f), z

    def flow(self, strips: Strips) -> Flow:
        """Of the length of the whole body."""
        speed = jnp.abs(strips.velocity[:, 0])
        return Flow(speed, jnp.broadcast_to(self.length, speed.shape))

    def assumed(self, described: SkinFrictionLoad, water: Water) -> tuple[Assumed, ...]:
        """Its law; without a length that of the part."""
        length = (Assumed("length", self.length, "of the part", "m"),) * (described.length is None)
        return *length, FRICTION_LAW, Assumed("moving across", "thinner layer", "Taylor 1952")


def _ellipse_perimeter(a: Float[Array, "n"], b: Float[Array, "n"]) -> Float[Array, "n"]:
    """Of half axes a and b (Ramanujan 1914)."""
    return jnp.pi * (3 * (a + b) - jnp.sqrt((3 * a + b) * (a + 3 * b)))
