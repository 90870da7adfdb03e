r"""How a body of a closed surface floats: draught, trim and heel at rest, metacentres, righting arms.

At rest the energy $\Pi = E(d, u) + V_m (c \cdot u - d)$ over $\rho g$ is least: E of the raised water
(`loads/hydrostatics.py`) and the body's weight, with the volume $V_m = m/\rho$ of its mass of water and its centre of
mass c. With the first moment $V b$ of the volume V under water its derivatives are $V - V_m$ by the depth d, and
$V_m c - V b$ along the two tilts of the vector u upwards. The second derivatives are exact, too: Newton's method takes
a few steps.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float

from nectosome.core import Status
from nectosome.geometry.triangles import Triangles
from nectosome.loads.hydrostatics import Immersed, immersed, raised
from nectosome.units import InputError

_MOST_STEPS = 100
_BALANCED = 1e-10  # forces over the weight, and their levers over the body's size
_NEUTRAL = 1e-9  # stiffness against tilting over the weight and the body's size, below which it is rounding
_UPRIGHT = np.array([0.0, 0.0, 1.0])
_LONGEST = 0.2  # step: tilt [rad], and depth over the body's size

_immersed, _raised = jax.jit(immersed), jax.jit(raised)


@dataclass(frozen=True)
class Floating:
    """A body at rest at the surface. Axes: x ahead, y to port, z up."""

    status: Status  # SOLVED; NO_EQUILIBRIUM: all else says where it got to
    why: str  # there is no equilibrium; "" where there is
    draught: float  # depth of the lowest point [m]
    trim: float  # bow up [rad]
    heel: float  # to starboard, port side up [rad]
    depth: float  # of the body's origin [m]
    up: Float[np.ndarray, "3"]  # unit vector in the body's axes
    volume: float  # under water [m3]
    buoyancy: Float[np.ndarray, "3"]  # its centre, in the body's axes [m]
    waterplane: float  # area [m2]
    metacentric_heights: tuple[float, float]  # against heel and against trim [m]; stable where both are above 0


def floating(
    triangles: Triangles,
    mass: float,
    centre: Float[np.ndarray, "3"],
    density: float = 1000.0,
    up: Float[np.ndarray, "3"] | None = None,
) -> Floating:
    """Stable floating position of a body of a mass [kg] and centre of mass [m], near the attitude of `up` (z).

    A body that is unstable there turns over to where it is stable. Raises InputError for masses and densities that are
    not above 0.
    """
    if not (0 < mass < np.inf and 0 < density < np.inf):
        raise InputError(f"a mass of {mass:g} kg in water of {density:g} kg/m3: both must be above 0.")
    size, whole = _size(triangles), float(_at(triangles, _deep(triangles), _UPRIGHT).volume)
    volume, upward = mass / density, _UPRIGHT if up is None else up / np.linalg.norm(up)
    if volume >= whole * (1 - 1e-9):
        water = f"that of the water it can displace, {density * whole:.4g} kg"
        why = f"it sinks: its mass, {mass:.4g} kg, is not below {water}"
        return _floating(triangles, _deep(triangles), upward, centre, volume, why)
    depth = _depth(triangles, volume, upward)
    for _ in range(_MOST_STEPS):
        force, stiffness, axes = _derivatives(triangles, depth, upward, centre, volume)
        balanced = np.abs(force) < _BALANCED * volume * np.array([1, size, size])
        tilting = _tilting(stiffness)
        values, vectors = np.linalg.eigh(tilting)
        if balanced.all() and values[0] >= -_NEUTRAL * volume * size:
            return _floating(triangles, depth, upward, centre, volume, "")
        # a way down in any case; from the top of a hill along the steeper side
        step = np.array([0.0, *(0.05 * vectors[:, 0])]) if balanced.all() else _downhill(force, stiffness, size)
        depth, upward = _taken(triangles, depth, upward, centre, volume, step, axes, force)
    return _floating(triangles, depth, upward, centre, volume, f"no place of rest found in {_MOST_STEPS} steps")


def righting_arms(
    triangles: Triangles,
    mass: float,
    centre: Float[np.ndarray, "3"],
    heels: Iterable[float],
    density: float = 1000.0,
    trim: float = 0.0,
) -> Float[np.ndarray, "heels"]:
    """GZ [m]: lever of the weight and the uplift at each heel [rad], above 0 where it turns the body back.

    The body sinks or rises so that it displaces its mass; its trim [rad] is held. Raises InputError for a body that
    sinks.
    """
    volume, arms = mass / density, []
    for heel in heels:
        up = np.array([np.sin(trim), np.cos(trim) * np.sin(heel), np.cos(trim) * np.cos(heel)])
        found = _at(triangles, _depth(triangles, volume, up), up)
        port, _ = _tilts(up)
        arms.append(float((centre - np.asarray(found.moment) / float(found.volume)) @ port))
    return np.array(arms)


def _at(triangles: Triangles, depth: float, up: np.ndarray) -> Immersed:
    return _immersed(triangles.vertices, triangles.faces, depth, up)


def _size(triangles: Triangles) -> float:
    return float(np.linalg.norm(np.ptp(triangles.vertices, axis=0)))


def _deep(triangles: Triangles) -> float:
    """Depth of the origin at which all of the body is under water, whatever its attitude [m]."""
    return float(np.linalg.norm(triangles.vertices, axis=1).max()) * 1.01


def _tilts(up: np.ndarray) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Unit vectors along which `up` moves by heel, towards the port side, and by trim, towards the bow."""
    port = np.cross(up, [1.0, 0.0, 0.0])
    if np.linalg.norm(port) < 1e-6:  # the bow points up: no heel
        port = np.array([0.0, 1.0, 0.0])
    port = port / np.linalg.norm(port)
    return port, np.cross(port, up)


def _derivatives(
    triangles: Triangles, depth: float, up: np.ndarray, centre: np.ndarray, volume: float
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"], Float[np.ndarray, "2 3"]]:
    """First and second derivatives of the energy by depth, heel and trim, and the directions of the tilts."""
    found, axes = _at(triangles, depth, up), np.stack(_tilts(up))
    lever = volume * centre - np.asarray(found.moment)
    tilting = axes @ np.asarray(found.waterplane_second) @ axes.T - (up @ lever) * np.eye(2)
    across = -axes @ np.asarray(found.waterplane_moment)
    stiffness = np.block([[np.asarray(found.waterplane).reshape(1, 1), across[None]], [across[:, None], tilting]])
    return np.array([float(found.volume) - volume, *(axes @ lever)]), stiffness, axes


def _tilting(stiffness: np.ndarray) -> Float[np.ndarray, "2 2"]:
    """Stiffness against tilts of a body that rises and sinks freely."""
    area, across = max(stiffness[0, 0], np.finfo(float).tiny), stiffness[0, 1:]
    return stiffness[1:, 1:] - np.outer(across, across) / area


def _downhill(force: np.ndarray, stiffness: np.ndarray, size: float) -> Float[np.ndarray, "3"]:
    """Newton's step with all stiffnesses taken as positive, of a bounded length."""
    scale = np.array([size, 1.0, 1.0])
    values, vectors = np.linalg.eigh(stiffness * np.outer(scale, scale))
    values = np.maximum(np.abs(values), 1e-6 * np.abs(values).max())
    step = -vectors @ ((vectors.T @ (scale * force)) / values)
    return scale * step * min(1.0, _LONGEST / np.abs(step).max())


def _taken(
    triangles: Triangles,
    depth: float,
    up: np.ndarray,
    centre: np.ndarray,
    volume: float,
    step: np.ndarray,
    axes: np.ndarray,
    force: np.ndarray,
) -> tuple[float, Float[np.ndarray, "3"]]:
    """Depth and vector upwards after a step, halved until the energy falls by a tenth of what it should."""

    def energy(depth: float, up: np.ndarray) -> float:
        return float(_raised(triangles.vertices, triangles.faces, depth, up)) + volume * (float(centre @ up) - depth)

    before, rounding = energy(depth, up), 1e-13 * volume * _size(triangles)
    share, shortest = 1.0, 2.0**-12
    while True:
        tilt = share * step[1:]
        angle = np.linalg.norm(tilt)
        turned = np.cos(angle) * up + np.sinc(angle / np.pi) * (tilt @ axes)
        new = float(depth + share * step[0]), turned / np.linalg.norm(turned)
        if share < shortest or energy(*new) <= before + 0.1 * share * min(force @ step, 0.0) + rounding:
            return new
        share *= 0.5


def _depth(triangles: Triangles, volume: float, up: np.ndarray) -> float:
    """Depth of the origin at which this volume is under water, by Newton's method between bounds."""
    heights = triangles.vertices @ up
    low, high = float(heights.min()), float(heights.max())
    if not 0 < volume < float(_at(triangles, high, up).volume):
        raise InputError("the body sinks, or has no mass: no draught displaces its mass of water.")
    depth = 0.5 * (low + high)
    for _ in range(_MOST_STEPS):
        found = _at(triangles, depth, up)
        excess, area = float(found.volume) - volume, float(found.waterplane)
        low, high = (low, depth) if excess > 0 else (depth, high)
        if abs(excess) < 1e-14 * volume or high - low < 1e-15 * (abs(low) + abs(high)):
            break
        depth = depth - excess / area if area > 0 else low
        depth = depth if low < depth < high else 0.5 * (low + high)
    return float(depth)


def _floating(
    triangles: Triangles, depth: float, up: np.ndarray, centre: np.ndarray, volume: float, why: str
) -> Floating:
    found = _at(triangles, depth, up)
    heights = np.diag(_tilting(_derivatives(triangles, depth, up, centre, volume)[1])) / volume
    return Floating(
        status=Status.NO_EQUILIBRIUM if why else Status.SOLVED,
        why=why,
        draught=float(depth - (triangles.vertices @ up).min()),
        trim=float(np.arcsin(np.clip(up[0], -1, 1))),
        heel=float(np.arctan2(up[1], up[2])),
        depth=depth,
        up=up,
        volume=float(found.volume),
        buoyancy=np.asarray(found.moment) / float(found.volume),
        waterplane=float(found.waterplane),
        metacentric_heights=(float(heights[0]), float(heights[1])),
    )
