r"""Foils: thin fins and wings in sections along their span, with circulation that lags, suction, stall and added mass.

Of a section with the half chord b, at its mid-chord: u is its velocity ahead and w that along its normal n, both
relative to the water, and $\Omega$ its rate of turning about the span e_s = e_c x n, with e_c ahead. The downwash at
the three-quarter chord and its lagged part, with the numbers of `lift_share` and `lag_numbers` and
$U = \sqrt{u^2 + w^2}$, are

$$ v = w - \tfrac12 b\,\Omega, \quad v_e = \kappa \left[ v - \sum_i a_i (v - y_i) \right], \quad
   \dot y_i = b_i \frac{U}{b} (v - y_i) $$

They give, per span, the normal force -N n at the `centre_of_pressure`, a quarter chord of long spans, the leading-edge
suction P e_c, and the couple M e_s that takes away the moment which the added mass $m = k \rho \pi b^2$ has in a stream
(Theodorsen 1935; Garrick 1936; in the axes of a foil that moves at will: Sedov 1965):

$$ N = 2\pi\rho b\,u\,v_e, \quad P = \pi\rho b\,S^2 - m\,w\,\Omega, \quad S = \sqrt2\,g\,v_e + b\,\Omega/\sqrt2,
   \quad M = m\,u\,v $$

Kirchhoff's forces of the added mass come with the equations of motion. Where the water comes from behind, the other
edge leads. A foil may have a share of the lift v_e, and of the suction that pulls ahead, where its file says so. In
steady flow N and P leave the induced drag of an elliptic wing, $C_L^2/(\pi A)$ (see `suction_gain`).

Suction holds up to $S_c = \sqrt2\,U \sin\alpha_s$ with the angle of stall: the suction parameter $S/(\sqrt2\,U)$, of
steady flow $\sin\alpha$, says when the flow leaves the leading edge (Ramesh et al. 2014). What is beyond turns onto the
normal, as the lift of the vortex there (Polhamus 1966). The share x of attached flow goes to
$x_0 = 1/(1 + (S/S_c)^8)$ with a lag of 4.5 chords (Goman and Khrabrov 1994). N has the factor $(1 + \sqrt x)^2/4$ of
Kirchhoff's flow; suction has $c\,x_0^{1/4} \sqrt x$, the vortex $c\,(1 - x_0^{1/4})\,x$, and a plate's drag
$1 - c\,x$ with $c = \cos^2\alpha = u^2/U^2$, since water that comes from the side does not follow the foil.

What comes from the side, $w_s = (1 - c)\,w$, sheds vortices from both edges, and has the drag of a plate's start and
reversal with the numbers of `StartUp`, C the drag coefficient across (see `StartingPlateDrag`):

$$ N_s = \rho b\,C\,(1 - c)\,U \sum_i \kappa_i (w_s - q_i), \quad \dot q_i = \frac{U}{2 \lambda_i b} (w_s - q_i) $$

No motion gains any energy by it, since the wake has $\rho b^2 C \sum_i \kappa_i \lambda_i q_i^2$ per span. At no speed
ahead a foil that does not turn is `plate_drag` with a start-up and its added mass.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Assumed, Flow, Load, SectionedLoad, Stations, Strips, Water, safe_norm, wetted
from nectosome.core.described import number, numbers, vector
from nectosome.core.se3 import cross, dot, skew
from nectosome.description.drag import StartUp
from nectosome.description.foil_planform import FoilLoad, axes_of
from nectosome.description.plates import PlateShape
from nectosome.mechanism import SoftRod
from nectosome.mechanism.shapes.plates import outline_moments, outline_range, outline_widths

from .drag import FRICTION_LAW, friction_coefficient
from .foil_theory import (
    broadside_drag,
    centre_of_pressure,
    form_factor,
    lag_numbers,
    lift_share,
    plate_added_mass_share,
    suction_gain,
)
from .places import Carrier

_START = StartUp()
_SEPARATION_LAG = 4.5  # chords
_SHARP = 0.01  # of the mean chord, the least chord of a section
_BROADSIDE = 0.1  # share of the velocity across at which the flow along the chord has no direction


class OutlinePlanform(NamedTuple):
    """A planform in sections across the span, places from the centre of the plate's area."""

    span: Float[Array, ""]  # [m]
    offset: Float[Array, ""]  # of its middle, along it [m]
    mean_chord: Float[Array, ""]  # [m]
    ratio: Float[Array, ""]  # aspect ratio of lift and added mass
    chord: Float[Array, "k"]  # [m]
    ahead: Float[Array, "k"]  # places of the mid-chords along `ahead` [m]
    along: Float[Array, "k"]  # the same along the span [m]


def outline_planform(described: FoilLoad, part: Carrier, s: Float[np.ndarray, "k"]) -> OutlinePlanform:
    """Planform of a foil without a chord of its own, at fractions s of the span: that of the plate that it acts on."""
    shape = part.limb.shape if part.limb.kind == "rigid" else None
    assert isinstance(shape, PlateShape)
    points = jnp.asarray(shape.outline, float)
    moments = outline_moments(points)
    of_span, of_chord = shape.plane.index(described.span_along), shape.plane.index(described.ahead[-1])
    turned = (points - moments.centre)[:, np.array([of_span, of_chord])]
    turned = turned * np.array([1.0, -1.0 if described.ahead[0] == "-" else 1.0])
    start, end = outline_range(turned)
    span = end - start
    along = start + span * s
    chord, ahead = outline_widths(turned, along)
    ratio = span**2 / moments.area if described.aspect_ratio is None else number(described.aspect_ratio)
    return OutlinePlanform(span, 0.5 * (start + end), moments.area / span, ratio, chord, ahead, along)


class Foil(Load):
    """A foil on one part: what its sections have in common."""

    axes: Float[Array, "3 3"]  # rows: ahead, normal, along the span, in the frame of each station
    half_chord: Float[Array, "k"]  # b [m]
    aspect_ratio: Float[Array, ""]
    thickness: Float[Array, ""]  # [m]
    profile_drag: Float[Array, ""] | None  # coefficient; None: by the Reynolds number
    broadside: Float[Array, ""]  # coefficient of the drag across
    lift: Float[Array, ""]  # share of that of thin foils
    suction: Float[Array, ""]  # share of that of ideal flow
    stall: Float[Array, ""]  # alpha_s [rad]
    softness: Float[Array, ""]  # speed below which the flow along the chord has no direction [m/s]
    carries = True

    def initial(self) -> Float[Array, "k 5"]:
        """No wake, and all flow attached: y_1 and y_2 [m/s], x, and q_1 and q_2 [m/s] of each section."""
        return jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0, 0.0, 0.0]), (*self.half_chord.shape, 5))

    def _inertia(self, water: Water) -> Float[Array, "k 6 6"]:
        """Added mass of sections per span about their mid-chords."""
        _, normal, span = self.axes
        m = plate_added_mass_share(self.aspect_ratio) * water.density * jnp.pi * self.half_chord**2
        turning, pushing = jnp.outer(span, span), jnp.outer(normal, normal)
        own = jnp.zeros((*m.shape, 6, 6)).at[:, :3, :3].set((self.half_chord**2 / 8)[:, None, None] * turning)
        return m[:, None, None] * own.at[:, 3:, 3:].set(pushing)

    def _wrench(
        self, turning: Float[Array, "k 3"], velocity: Float[Array, "k 3"], z: Float[Array, "k 5"], water: Water
    ) -> tuple[Float[Array, "k 6"], Float[Array, "k 5"]]:
        """Wrench per span at the mid-chords, and the rates of the states."""
        b, rho = self.half_chord, water.density
        (u, w, _), omega = (velocity @ self.axes.T).T, turning @ self.axes[2]
        U = jnp.sqrt(u**2 + w**2 + self.softness**2)
        leads = u / jnp.sqrt(u**2 + (_BROADSIDE * w) ** 2 + self.softness**2)
        share, rate = lag_numbers(self.aspect_ratio)
        y, x, q = z[:, :2], z[:, 2], z[:, 3:]
        v = w - 0.5 * leads * b * omega
        lag = v[:, None] - y
        lagged = self.lift * lift_share(self.aspect_ratio) * (v - lag @ share)
        S = jnp.sqrt(2.0) * suction_gain(self.aspect_ratio) * lagged + leads * b * omega / jnp.sqrt(2.0)
        most = jnp.sqrt(2.0) * U * jnp.sin(self.stall)
        steady = 1 / (1 + (S / most) ** 8)
        kept, root = steady**0.25, jnp.sqrt(jnp.maximum(x, 1e-12))
        suction = jnp.pi * rho * b * S**2
        m = plate_added_mass_share(self.aspect_ratio) * rho * jnp.pi * b**2
        N = 2 * jnp.pi * rho * b * jnp.abs(u) * lagged * (0.5 + 0.5 * root) ** 2
        along = (u / U) ** 2  # water that comes from the side does not follow the foil
        N += along * suction * (1 - kept) * x * jnp.sign(S)
        starting = ((1 - along) * w)[:, None] - q
        across = (1 - along * x) * jnp.abs(w) * w + (1 - along) * U * (starting @ jnp.asarray(_START.extra))
        across *= rho * b * self.broadside
        ahead = (
            leads * along * self.suction * suction * kept * root
            - m * w * omega
            - rho * b * self._friction(U, water) * U * u
        )
        couple = m * u * v - (1 - 2 * centre_of_pressure(self.aspect_ratio)) * leads * b * N
        moment = couple[:, None] * self.axes[2]
        force = ahead[:, None] * self.axes[0] - (N + across)[:, None] * self.axes[1]
        separates, shed = (steady - x) / (2 * _SEPARATION_LAG), starting / (2 * jnp.asarray(_START.distance))
        rates = jnp.concatenate([rate * lag, separates[:, None], shed], axis=1)
        return jnp.concatenate([moment, force], axis=1), (U / b)[:, None] * rates

    def _flow(self, velocity: Float[Array, "k 3"]) -> Flow:
        """Of the chords of its sections; the angle of attack is that at their mid-chords."""
        u, w, _ = (velocity @ self.axes.T).T
        chord, ratio = 2 * self.half_chord, jnp.broadcast_to(self.aspect_ratio, u.shape)
        stalled = jnp.where(jnp.abs(w) > jnp.tan(self.stall) * jnp.abs(u), 1.0, 0.0)
        speed, across = safe_norm(jnp.stack([u, w], axis=-1)), jnp.stack([w, jnp.zeros_like(w)], axis=-1)
        return Flow(speed, chord, across, chord, u, chord, stalled, ratio)

    def assumed(self, described: FoilLoad, water: Water) -> tuple[Assumed, ...]:
        """Its numbers of finite span, and what its description leaves open."""
        A = self.aspect_ratio
        always = (
            Assumed("lift slope per rad", 2 * jnp.pi * self.lift * lift_share(A), "Helmbold 1942"),
            Assumed("centre of pressure, chords", centre_of_pressure(A), "lattice of rectangles"),
            Assumed("added mass factor", plate_added_mass_share(A), "Pabst 1930"),
            Assumed("lag of lift", "two states", "R. T. Jones 1940"),
            Assumed("starts and reversals", "as a plate", "from Graham 1980"),
        )
        left_open = {
            "aspect_ratio": Assumed("aspect ratio", A, "span over chord"),
            "stall": Assumed("stall", self.stall, "chosen", "rad"),
            "broadside_drag": Assumed("broadside drag", self.broadside, "Viterna 1982"),
            "profile_drag": FRICTION_LAW,
        }
        given = {name for name in left_open if getattr(described, name) is not None} & described.model_fields_set
        return *(one for name, one in left_open.items() if name not in given), *always

    def _friction(self, U: Float[Array, "k"], water: Water) -> Float[Array, "k"] | Float[Array, ""]:
        """Coefficient of the drag along the chord."""
        if self.profile_drag is not None:
            return self.profile_drag
        chord = 2 * self.half_chord
        reynolds = water.density * U * chord / water.viscosity
        return 2 * friction_coefficient(reynolds) * form_factor(self.thickness / chord)


class RigidFoil(Foil, SectionedLoad):
    """A foil on a rigid part, its sections seen from the part's centre.

    In the surface each section has the share of its own that is under water, a box of its chord, its thickness and what
    it has of the span. Lift slope, lag and suction stay those of the whole span.
    """

    place: Float[Array, "k 3"]  # of the mid-chords [m]
    width: Float[Array, "k"]  # of the sections along the span [m]
    offset: Float[Array, ""] | None = None  # of the middle of the span from the centre along it [m]; None: no
    on_first = True
    described_by = FoilLoad

    @classmethod
    def from_description(cls, described: FoilLoad, part: Carrier) -> Foil:
        """Of its planform; on a rod a `RodFoil`."""
        ahead, span = (jnp.asarray(axis) for axis in axes_of(described))
        if isinstance(part.body, SoftRod):
            s = np.asarray(part.body.nodes)
            return RodFoil(**_given(described, part, ahead, span, s))
        points, weights = np.polynomial.legendre.leggauss(described.sections)
        s = 0.5 * (points + 1)
        if described.chord is None:
            form = outline_planform(described, part, s)
            own = _numbers(described, form.ratio, ahead, span, form.chord, form.mean_chord)
            place = form.ahead[:, None] * ahead + form.along[:, None] * span
            return cls(**own, place=place, width=0.5 * form.span * weights, offset=form.offset)
        length = number(described.span_on(part.limb))
        own = _given(described, part, part.at_centre(ahead), part.at_centre(span), s)
        middle = jnp.zeros(s.size)
        if described.leading_edge is not None:
            middle = _along_span(described.leading_edge, s) - own["half_chord"]
        axes = own["axes"]
        place = middle[:, None] * axes[0] + (length * (s - 0.5))[:, None] * axes[2]
        return cls(**own, place=place, width=0.5 * length * weights)

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """Added mass of all sections at the centre."""
        there = self._at_centre("ij", water)
        return jnp.pad(there[None], ((0, strips.weight.shape[0] - 1), (0, 0), (0, 0)))

    def section_inertia(self, water: Water) -> Float[Array, "k 6 6"]:
        """Added mass of each section at the centre."""
        return self._at_centre("kij", water)

    def _at_centre(self, out: str, water: Water) -> Float[Array, "..."]:
        """Added mass at the centre, of each section k or of all, by the indices that are left."""
        one = jnp.broadcast_to(jnp.eye(6), (*self.width.shape, 6, 6))
        twists = one.at[:, 3:, :3].set(jnp.swapaxes(skew(self.place), 1, 2))  # of the sections, by that of the centre
        return jnp.einsum(f"k,kai,kab,kbj->{out}", self.width, twists, self._inertia(water), twists)

    def sections(self, strips: Strips) -> Strips:
        """Boxes along the span, side by side, with a place of quadrature in each."""
        ahead, normal, along = self.axes
        ends = jnp.cumsum(self.width)
        middle = ends - 0.5 * (self.width + ends[-1])
        if self.offset is not None:
            middle = middle + self.offset
        place = self.place + (middle - self.place @ along)[:, None] * along
        own, turning = jnp.stack([along, ahead, normal]), strips.angular_velocity[0]
        k = self.width.shape[0]
        half_width = jnp.stack([self.half_chord, jnp.broadcast_to(0.5 * self.thickness, (k,))], axis=1)
        boxes = Stations.along(middle, self.width, half_width, jnp.zeros(k), jnp.zeros((k, 6, 6)), 0.0)
        return Strips(
            **vars(boxes),
            rotation=jnp.broadcast_to(strips.rotation[0] @ own.T, (k, 3, 3)),
            position=strips.position[0] + dot(strips.rotation[0], place),
            angular_velocity=jnp.broadcast_to(own @ turning, (k, 3)),
            velocity=(strips.velocity[0] + cross(turning, place)) @ own.T,
        )

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench at the centre."""
        wrench, rates = self._wrench(*self._motion(strips), z, water)
        share = wetted(t, strips, water)[0] if water.surface is None else wetted(t, self.sections(strips), water)
        wrench = (share * self.width)[:, None] * wrench
        moment = wrench[:, :3] + cross(self.place, wrench[:, 3:])
        return strips.at_first(jnp.sum(jnp.concatenate([moment, wrench[:, 3:]], axis=1), axis=0)), rates

    def flow(self, strips: Strips) -> Flow:
        """Of its sections."""
        return self._flow(self._motion(strips)[1])

    def _motion(self, strips: Strips) -> tuple[Float[Array, "k 3"], Float[Array, "k 3"]]:
        """Angular velocities and velocities of the mid-chords."""
        turning = jnp.broadcast_to(strips.angular_velocity[0], self.place.shape)
        return turning, strips.velocity[0] + cross(turning, self.place)


class RodFoil(Foil):
    """A foil along a rod, with a section at each station."""

    def inertia(self, strips: Strips, water: Water) -> Float[Array, "n 6 6"]:
        """Added mass of the sections."""
        return strips.weight[:, None, None] * self._inertia(water)

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrenches on the stations."""
        wrench, rates = self._wrench(strips.angular_velocity, strips.velocity, z, water)
        return (wetted(t, strips, water) * strips.weight)[:, None] * wrench, rates

    def flow(self, strips: Strips) -> Flow:
        """Of its sections."""
        return self._flow(strips.velocity)


def _given(described: FoilLoad, part: Carrier, ahead: Array, span: Array, s: np.ndarray) -> dict[str, Any]:
    """Numbers of a `Foil` whose description gives its chords, with sections at fractions s of its span."""
    ratio, chord = number(described.ratio(part.limb)), _along_span(described.chords, s)
    return _numbers(described, ratio, ahead, span, chord, number(described.mean_chord))


def _numbers(
    described: FoilLoad, ratio: Array, ahead: Array, span: Array, chord: Float[Array, "k"], mean_chord: Array
) -> dict[str, Any]:
    """Numbers of a `Foil` with these chords."""
    drag, broadside = described.profile_drag, described.broadside_drag
    return {
        "axes": jnp.stack([ahead, cross(span, ahead), span]),
        # sharp ends keep a chord, since their wake would be gone at once
        "half_chord": 0.5 * jnp.maximum(chord, _SHARP * mean_chord),
        "aspect_ratio": ratio,
        "profile_drag": None if drag is None else number(drag),
        "broadside": broadside_drag(ratio) if broadside is None else number(broadside),
        **numbers(described, "thickness", "lift", "suction", "stall", "softness"),
    }


def _along_span(values: Any, s: np.ndarray) -> Float[Array, "k"]:
    """Values that are evenly spaced along the span, at its fractions s."""
    return jnp.interp(jnp.asarray(s), jnp.linspace(0.0, 1.0, len(values)), vector(values))
