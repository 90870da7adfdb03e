r"""What the water will do about moved parts, estimated before a run from the drives alone.

The robot is held where it starts, and servos follow their motions, those that bend rods too. Where motions alone drive
it, passive hinges and rods keep their shape, so that what they add is left out. Where periodic torques, muscles,
chambers or tendons do, all moves as the first harmonics of the forces on it have it (`forced_motion`). Of each part
that moves, over a period of the drives:

- sweep A, the largest distance between two places of the same corner; frequency f, that of the drives on its way,
- Reynolds number $\rho v l/\mu$ and Keulegan-Carpenter number $2\pi a/l$ as in `flow_numbers`, at the mooring, with the
  chord l of a fin, or the larger size across of anything else,
- the angle of its chord to its path, which half of the time and of the places are beyond, at the mooring and at speed,
- the speed at which the Strouhal number $f A/U$ (Triantafyllou et al. 1993) is 0.3, in the middle of what
  swims: fish, birds and bats have 0.2 to 0.4 (Taylor et al. 2003).
"""

import itertools
import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core.cyclic_curve import CyclicCurve
from nectosome.core.programs.remember import remembered
from nectosome.core.se3 import dot
from nectosome.description import (
    DIRECTIONS,
    STRAIN_NAMES,
    RobotDescription,
    Rod,
    SoftPlate,
    drive_frequencies,
    drive_period,
    without_ramps,
)
from nectosome.description.fields import Curvature
from nectosome.description.loads import ROD
from nectosome.description.rod_fields import DrivenStrain, DrivenStrains
from nectosome.description.signals import OscillationSignal, WaveSignal
from nectosome.description.which_load import PartInWater
from nectosome.mechanism import Robot
from nectosome.units import InputError

from .build import build
from .forced_motion import forced_motion

STROUHAL = 0.3
_TIMES = 64  # of a period
_STRIPS = 0.5 * np.polynomial.legendre.leggauss(5)[0]  # points of loads on a rigid part, from its middle, in its size
_STILL = 1e-6  # m/s


class EstimatedFlow(NamedTuple):
    """The numbers of a part; NaN where one is not defined."""

    piece: PartInWater
    frequency: float  # [Hz]
    sweep: float  # [m]
    reynolds: float
    keulegan_carpenter: float
    angle: float  # at the mooring [rad]
    speed: float  # at the Strouhal number of 0.3 [m/s]; of a robot that is held NaN
    angle_at_speed: float  # [rad]


def estimated_flow(description: RobotDescription) -> dict[str, EstimatedFlow]:
    """The flow about all parts that drives move; none where these have no common period, as of a recording."""
    own = _with_ideal_drives(without_ramps(description))
    forced = _forced(own)
    moving = (_moving(own, forced) if forced else None) or _moving(_without_forces(own), {})
    if moving is None:
        return {}
    (robot, period, frequencies, motion), known = moving, description.in_water
    tree, time = robot.tree, np.arange(_TIMES) * (period / _TIMES)
    root = own.parts[tree.names[0]].joint
    adrift = root.kind != "fixed" and getattr(root, "motion", None) is None
    ahead = motion.rotation[0, 0] @ DIRECTIONS[own.forward] if adrift else None
    found = dict[str, EstimatedFlow]()
    for name, frequency in frequencies.items():
        if name not in known:
            continue
        piece, here = known[name], tree.layout[tree.part(name)].stations
        alone, length = _Motion(*(x[:, here] for x in motion)), np.array([piece.chord])
        if isinstance(own.parts[name], SoftPlate):
            places = corners = alone
        elif isinstance(own.parts[name], Rod):
            half = np.asarray(tree.stations.half_width[here])
            length = 2 * (half[:, piece.along - 1] if piece.row == "fin" else half.max(axis=1))
            places = corners = alone
        else:
            places, corners = _strips(piece, alone), _corners(piece, alone)
        numbers = _flow(piece, places, length, time, period)
        if numbers is None:
            continue
        reynolds, kc = numbers
        reynolds *= float(robot.water.density / robot.water.viscosity)
        sweep = _sweep(corners.position)
        speed = math.nan if ahead is None else frequency * sweep / STROUHAL
        angles = [_angle(piece, places, U) for U in (np.zeros(3), math.nan if ahead is None else speed * ahead)]
        found[name] = EstimatedFlow(piece, frequency, sweep, reynolds, kc, angles[0], speed, angles[1])
    return found


class _Motion(NamedTuple):
    """Places of a part or of all, over time."""

    rotation: Float[np.ndarray, "t n 3 3"]  # to the world
    position: Float[np.ndarray, "t n 3"]  # [m]
    turning: Float[np.ndarray, "t n 3"]  # in the world [rad/s]
    velocity: Float[np.ndarray, "t n 3"]  # in the world [m/s]

    def at(self, places: Float[np.ndarray, "k 3"]) -> "_Motion":
        """At places of a rigid part, from its centre and in its frame [m]."""
        R, w = self.rotation[:, :1], self.turning[:, :1]
        arm = np.einsum("tnij,kj->tki", R, places)
        n = (arm.shape[0], len(places))
        turned, turning = np.broadcast_to(R, (*n, 3, 3)), np.broadcast_to(w, (*n, 3))
        return _Motion(turned, self.position[:, :1] + arm, turning, self.velocity[:, :1] + np.cross(w, arm))

    def local(self, stream: Any = 0.0) -> Float[np.ndarray, "t n 3"]:
        """Velocities in the frames of the places, on a robot that moves on at the velocity of `stream`."""
        return np.einsum("tnji,tnj->tni", self.rotation, self.velocity + stream)


def _strips(piece: PartInWater, centre: _Motion) -> _Motion:
    """Points along the span of a rigid fin, or along x."""
    axis = piece.span if piece.row == "fin" else 0
    return centre.at(np.eye(3)[axis] * piece.sizes[axis] * _STRIPS[:, None])


def _corners(piece: PartInWater, centre: _Motion) -> _Motion:
    """Corners of a flat rigid part, or ends of a round one."""
    half = 0.5 * np.array(piece.sizes) * [k == 0 or (piece.normal is not None and k != piece.normal) for k in range(3)]
    return centre.at(half * np.array([*itertools.product((-1.0, 1.0), repeat=3)]))


def _sweep(position: Float[np.ndarray, "t k 3"]) -> float:
    """Largest distance between two places of the same point [m]."""
    return float(np.linalg.norm(position[:, None] - position, axis=-1).max())


def _flow(
    piece: PartInWater, places: _Motion, length: Float[np.ndarray, "n"], time: np.ndarray, period: float
) -> tuple[float, float] | None:
    """Speed times length [m2/s] and Keulegan-Carpenter number; None of what hardly moves."""
    local = places.local()
    across = CyclicCurve(np, time, _across(piece, local - local.mean(axis=0)), period)
    swing, amplitude = across.half_range().max(axis=-1), across.half_way().max(axis=-1)
    if swing.max() < _STILL:
        return None
    aside = {"fin": piece.span, "limb": None}.get(piece.row, 0)
    speed = np.linalg.norm(local[..., [k for k in range(3) if k != aside]], axis=-1)
    most = np.argmax(swing**2 * length)
    kc = 2 * np.pi * amplitude / length
    return float((CyclicCurve(np, time, speed, period).largest() * length).max()), float(kc[most])


def _across(piece: PartInWater, local: Float[np.ndarray, "t n 3"]) -> Float[np.ndarray, "t n d"]:
    """Velocities across a flat part, or across the axis of a round one."""
    return local[..., 1:] if piece.normal is None else local[..., piece.normal, None]


def _angle(piece: PartInWater, places: _Motion, stream: Any) -> float:
    """Angle of the chord to the path that half of the time and of the places are beyond; of a body at its last one."""
    if piece.ahead is None or piece.row == "limb":
        return math.nan
    local = places.local(stream)
    angle = np.arctan2(
        np.linalg.norm(_across(piece, local), axis=-1), np.abs(local @ np.array(DIRECTIONS[piece.ahead]))
    )
    return float(np.median(angle if piece.row == "fin" else angle[:, -1]))


def _moving(
    description: RobotDescription, forced: dict[str, float]
) -> tuple[Robot, float, dict[str, float], _Motion] | None:
    """The robot, its period [s], frequencies of what moves, and the motion; None without any that can be found."""
    try:
        period, every = drive_period(description), drive_frequencies(description)
    except InputError:
        return None
    robot, time = build(description), np.arange(_TIMES) * (period / _TIMES)
    bent = tuple(np.tile(x, (_TIMES, 1)) for x in (robot.displacements(robot.start.q), 0.0 * robot.start.v))
    if forced:
        bent = forced_motion(robot, period, sorted({round(f * period) for f in every.values()}), time)
    if bent is None:
        return None
    motion = remembered(_motion, robot, *map(jnp.asarray, (time, *bent)))
    return robot, period, _frequencies(description, forced), _Motion(*map(np.asarray, motion))


def _with_ideal_drives(description: RobotDescription) -> RobotDescription:
    """The robot with ideal drives in place of servos."""
    for name, part in description.parts.items():
        joint = part.joint
        if getattr(joint, "servo", None) is not None:
            joint = joint.model_copy(update={"servo": None})
        given: dict[str, Any] = {"joint": joint}
        if isinstance(part, Rod) and part.drive.given:
            bent = {key: _bent(one, part.length) for key, one in part.drive.given.items()}
            motion = part.motion.model_copy(update={key: wave for key, wave in bent.items() if wave is not None})
            strains = {**part.strains, **dict.fromkeys(bent, 0)}  # a rod has one that is free; it keeps still
            strains = {key: strains[key] for key in STRAIN_NAMES if key in strains}
            given |= {"motion": motion, "drive": DrivenStrains(), "strains": strains}
        description = description.with_part(name, **given)
    return description.model_copy(update={"batteries": {}})


def _without_forces(description: RobotDescription) -> RobotDescription:
    """The robot that motions alone move, whatever acts on it."""
    for name, part in description.parts.items():
        undriven = {part.joint.drive_field: None} if hasattr(part.joint, part.joint.drive_field) else {}
        description = description.with_part(name, loads={}, joint=part.joint.model_copy(update=undriven))
    return description.model_copy(update={"pairs": {}, "tendons": {}})


def _forced(description: RobotDescription) -> dict[str, float]:
    """Frequency of each part that a periodic force moves: of its joint, inside a rod, of a tendon [Hz].

    None of a robot with motors, whose speed is their own, and where a drive is a recording.
    """
    found = dict[str, float]()
    try:
        every = drive_frequencies(description)
    except InputError:
        return found
    if any(part.powered for part in description.parts.values()):
        return found
    for name, part in description.parts.items():
        place = description.place_of(name)
        within = [f"{place}.loads.{key}." for key, load in part.loads.items() if load.on == ROD]
        own = [f for path, f in every.items() if path.startswith((f"{place}.joint.{part.joint.drive_field}.", *within))]
        if own:
            found[name] = max(own)
    moved = _frequencies(description, {})
    for tendon in description.tendons.values():
        if tendon.pulled_by is not None and tendon.pulled_by.part in moved:
            found |= dict.fromkeys(tendon.over, moved[tendon.pulled_by.part])
    return found


def _bent(drive: DrivenStrain, length: float) -> WaveSignal[Curvature] | None:
    """The curvature of a rod whose servo goes to and fro, as a sine; None of other motions, which hold the rod."""
    shaft = drive.motion
    if not isinstance(shaft, OscillationSignal):
        return None
    by = drive.ratio / length
    numbers = {"amplitude": by * shaft.amplitude, "offset": by * shaft.offset, "frequency": shaft.frequency}
    return WaveSignal[Curvature](kind="wave", phase=shaft.phase, envelope=drive.envelope, **numbers)


def _frequencies(description: RobotDescription, forced: dict[str, float]) -> dict[str, float]:
    """Frequency of each part that a motion or a force moves, the highest one on its way [Hz]."""
    found, every = dict[str, float](), drive_frequencies(description)
    for name, part in description.parts.items():
        place = description.place_of(name)
        own = [f for path, f in every.items() if path.startswith((f"{place}.joint.motion.", f"{place}.motion."))]
        if own or name in forced or part.on in found:
            found[name] = max([*own, forced.get(name, 0.0), found.get(part.on, 0.0)])
    return found


def _motion(
    robot: Robot, time: Float[Array, "t"], displacements: Float[Array, "t n"], velocities: Float[Array, "t n"]
) -> tuple[Array, Array, Array, Array]:
    """Rotations and positions [m] of all stations, angular velocities and velocities, in the world."""
    tree = robot.tree

    def at(t: Array, d: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        q, v, _ = tree.complete(t, robot.coordinates(d), v)
        shape = tree.shape(q)
        twist = tree.twists(shape, v)
        R = shape.rotation
        return R, shape.position, dot(R, twist[:, :3]), dot(R, twist[:, 3:])

    return jax.vmap(at)(time, displacements, velocities)
