"""Beats of foils in PteraSoftware, an unsteady ring-vortex lattice with a free wake (C. Urban; MIT), an extra.

Its axes are x to the rear, y along the span and z up. Time steps are those it takes by itself, as long as the water
needs along a panel. Its velocities and rates of circulation are differences over the last step, and its vortices have
cores of 3 % of the chord: half the step brings forces about 5 deg earlier. The case `long` holds it against theory.
"""

from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from nectosome.units import InputError

from .flapping import PHASES, FoilBeat, harmonic, periodic_curve

PACKAGE = "pterasoftware"
_BEATS = 3  # the last one is compared; the wake is kept for two
CHORDWISE, SPANWISE = 8, 18  # panels
_GAP = 5e-4  # between the root and the plane of symmetry, where one is [m]: the package asks for one
_TIP = 0.98  # of the span, where a foil without a chord at its tip ends


class LatticeForces(NamedTuple):
    """Forces of both wings, where there is an image, at `PHASES` of a beat; and by strips of the span."""

    lift: Float[np.ndarray, "p"]  # [N]
    thrust: Float[np.ndarray, "p"]  # [N]
    power: Float[np.ndarray, "p"]  # [W]
    ends: Float[np.ndarray, "strip + 1"]  # of the strips along the span [m]
    strip_lift: Complex[np.ndarray, "strip"]  # first harmonic [N]
    strip_thrust: Float[np.ndarray, "strip"]  # mean [N]

    def by_bands(self, edges: tuple[float, ...]) -> Complex[np.ndarray, "band"]:
        """First harmonic of the lift of bands of the span [N]; strips that lie in two are shared by their width."""
        summed = np.append(0.0, np.cumsum(self.strip_lift))
        return np.diff(np.interp(np.append(edges[:-1], self.ends[-1]), self.ends, summed))


def lattice(beat: FoilBeat, free_wake: bool = True) -> LatticeForces:
    """Forces over the last of three beats. Raises InputError where the package is missing."""
    try:
        ptera = import_module(PACKAGE)
    except ModuleNotFoundError as error:
        raise InputError(f"the package {PACKAGE} is missing: pip install './nectosome/studies[vortex]'.") from error
    phase = np.arange(PHASES) / PHASES
    lift, thrust, power = (periodic_curve(values)(phase) for values in _run(ptera, beat, steps(beat), free_wake))
    return LatticeForces(lift.sum(axis=1), thrust.sum(axis=1), power, _ends(beat), harmonic(lift), thrust.mean(axis=0))


def steps(beat: FoilBeat) -> int:
    """Time steps of a beat: in one the water goes as far as a panel of the root is long."""
    chord = beat.planform.trailing[0] - beat.planform.leading[0]
    return round(CHORDWISE * beat.speed / (beat.frequency * chord))


def _ends(beat: FoilBeat) -> Float[np.ndarray, "strip + 1"]:
    planform = beat.planform
    pointed = planform.trailing[-1] - planform.leading[-1] < 0.1 * (planform.trailing[0] - planform.leading[0])
    return np.linspace(0.0, (_TIP if pointed else 1.0) * planform.x[-1], SPANWISE + 1)


def _run(ptera: Any, beat: FoilBeat, count: int, free_wake: bool) -> tuple[np.ndarray, ...]:
    """Lift and thrust by strips, and power, over the last beat at evenly spread phases."""
    airplane = ptera.geometry.airplane.Airplane(wings=[_wing(ptera, beat)])
    moves = [_movement(ptera, beat, wing) for wing in airplane.wings]
    point = ptera.operating_point.OperatingPoint(
        rho=beat.density, nu=beat.viscosity / beat.density, vCg__E=beat.speed, alpha=0.0
    )
    movement = ptera.movements.movement.Movement(
        airplane_movements=[
            ptera.movements.airplane_movement.AirplaneMovement(base_airplane=airplane, wing_movements=moves)
        ],
        operating_point_movement=ptera.movements.operating_point_movement.OperatingPointMovement(
            base_operating_point=point
        ),
        delta_time=1 / beat.frequency / count,
        num_steps=_BEATS * count,
        max_wake_cycles=2,
    )
    problem = ptera.problems.UnsteadyProblem(movement=movement)
    solver = ptera.unsteady_ring_vortex_lattice_method.UnsteadyRingVortexLatticeMethodSolver(unsteady_problem=problem)
    solver.run(prescribed_wake=not free_wake, calculate_streamlines=False, show_progress=False)
    last = problem.steady_problems[-count:]
    force, moment = (
        np.array([[[[getattr(p, name) for p in row] for row in w.panels] for w in s.airplanes[0].wings] for s in last])
        for name in ("forces_GP1", "moments_GP1_CgP1")
    )  # (step, wing, chord, strip, axis)
    strips = (1 + beat.mirrored) * force[:, 0].sum(axis=1)  # an image carries the same
    return strips[..., 2], -strips[..., 0], _power(beat, force[:, 0].sum(axis=(1, 2)), moment[:, 0].sum(axis=(1, 2)))


def _power(beat: FoilBeat, force: Float[np.ndarray, "t 3"], moment: Float[np.ndarray, "t 3"]) -> Float[np.ndarray, "t"]:
    """What heave and turn take, from the force and moment about the origin of one foil."""
    phase = np.arange(len(force)) / len(force)
    angle, heave, surge = (periodic_curve(values) for values in (beat.angle, beat.heave, beat.surge))
    rate, climb = beat.frequency * angle(phase, 1), beat.frequency * heave(phase, 1)
    if beat.turn == "flap":
        turning = moment[:, 0] - _GAP * force[:, 2]  # about the root
    else:  # about the hinge, which lies at x = hinge - surge, z = heave
        turning = moment[:, 1] - heave(phase) * force[:, 0] + (beat.hinge - surge(phase)) * force[:, 2]
    return -(1 + beat.mirrored) * (turning * rate + force[:, 2] * climb)


def _wing(ptera: Any, beat: FoilBeat) -> Any:
    ends, planform = _ends(beat), beat.planform
    leading, trailing = (np.interp(ends, planform.x, edge) for edge in (planform.leading, planform.trailing))
    steps = np.diff(np.stack([leading, ends], axis=1), axis=0, prepend=[[leading[0], 0.0]])
    sections = [
        ptera.geometry.wing_cross_section.WingCrossSection(
            airfoil=ptera.geometry.airfoil.Airfoil(name="naca0012"),  # its mean line is flat
            num_spanwise_panels=1 if k < SPANWISE else None,
            chord=float(trailing[k] - leading[k]),
            Lp_Wcsp_Lpp=(float(steps[k, 0]), float(steps[k, 1]), 0.0),
            control_surface_symmetry_type="symmetric" if beat.mirrored else None,
            spanwise_spacing="uniform" if k < SPANWISE else None,
        )
        for k in range(SPANWISE + 1)
    ]
    angles = _about_root(beat)[0]
    image: dict[str, Any] = {}
    if beat.mirrored:
        image = {"symmetric": True, "symmetryNormal_G": (0.0, 1.0, 0.0), "symmetryPoint_G_Cg": (0.0, 0.0, 0.0)}
    return ptera.geometry.wing.Wing(
        wing_cross_sections=sections,
        Ler_Gs_Cgs=(-float(beat.surge[0]), _GAP if beat.mirrored else 0.0, float(beat.heave[0])),
        angles_Gs_to_Wn_ixyz=angles,
        num_chordwise_panels=CHORDWISE,
        chordwise_spacing="uniform",
        **image,
    )


def _about_root(beat: FoilBeat) -> tuple[tuple[float, float, float], int]:
    """Angles at the phase 0 about the axes [deg], and which of them turns."""
    start = float(np.rad2deg(beat.angle[0]))
    return ((start, 0.0, 0.0), 0) if beat.turn == "flap" else ((0.0, start, 0.0), 1)


def _movement(ptera: Any, beat: FoilBeat, wing: Any) -> Any:
    """Motion as the package wants it: about the start, with an amplitude of 1 over an angle of 2 pi."""
    period, still = 1 / beat.frequency, ("sine",) * 3
    along, turn = list(still), list(still)
    size, angle = np.zeros(3), np.zeros(3)
    for axis, values in ((0, -beat.surge), (2, beat.heave)):
        size[axis], along[axis] = _spacing(values)
    which = _about_root(beat)[1]
    angle[which], turn[which] = _spacing(np.rad2deg(beat.angle))
    still_sections = [
        ptera.movements.wing_cross_section_movement.WingCrossSectionMovement(base_wing_cross_section=section)
        for section in wing.wing_cross_sections
    ]
    return ptera.movements.wing_movement.WingMovement(
        base_wing=wing,
        wing_cross_section_movements=still_sections,
        ampLer_Gs_Cgs=tuple(size),
        periodLer_Gs_Cgs=tuple(period * (size > 0)),
        spacingLer_Gs_Cgs=tuple(along),
        ampAngles_Gs_to_Wn_ixyz=tuple(angle),
        periodAngles_Gs_to_Wn_ixyz=tuple(period * (angle > 0)),
        spacingAngles_Gs_to_Wn_ixyz=tuple(turn),
        rotationPointOffset_Gs_Ler=(beat.hinge, 0.0, 0.0),
    )


def _spacing(values: Float[np.ndarray, "k"]) -> tuple[float, Any]:
    """Half of the range of a curve, and the curve from its start in units of that."""
    size = float(np.ptp(periodic_curve(values)(np.linspace(0, 1, 1001)))) / 2
    if size == 0:
        return 0.0, "sine"
    curve = periodic_curve((values - values[0]) / size)
    return size, lambda angle: float(curve(angle / (2 * np.pi) % 1.0))


def settings() -> str:
    """How a replay is made, in words."""
    return f"{CHORDWISE} by {SPANWISE} panels a wing, free wake of two beats, third beat, a step per length of a panel"
