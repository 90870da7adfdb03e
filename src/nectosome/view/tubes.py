"""The skin of a robot as rings around its parts, from the stations of a run; no plotting here."""

from collections.abc import Collection, Mapping
from itertools import pairwise

import numpy as np
import xarray as xr
from jaxtyping import Float, Int

from nectosome.description import RobotDescription, Rod, parse_robot
from nectosome.units import InputError

from .style import BLUE

AROUND = 12  # points on a ring
STATIONS = ("station_x", "half_width", "position", "rotation")  # what of a run tells where its stations are
_HARD = ("#9aa1aa", "#4f5660", "#c9ced4")  # rigid parts, in turn
_FINER = 3  # rings per interval between a rod's stations, where rings have that many points


def tubes(
    run: xr.Dataset, times: Float[np.ndarray, "t"], around: Mapping[str, int] | None = None
) -> dict[str, Float[np.ndarray, "t rings around 3"]]:
    """Rings [m, world frame] around every part that has a size, at `times` [s], by part.

    Between saved times they follow cubics. Rods are drawn through their stations, rigid parts from end to end; boxes
    and spheroids as such if the run carries its robot, and points as `visible` has them. `around` tells parts whose
    rings have another number of points.
    """
    run, saved = visible(run, description(run)), run["time"].values
    first = max(int(np.searchsorted(saved, times[0])) - 2, 0)
    last = int(np.searchsorted(saved, times[-1])) + 3
    near = run.isel(time=slice(first, last))
    robot = description(run)
    found: dict[str, np.ndarray] = {}
    for part in run["part"].values:
        points = (around or {}).get(str(part), AROUND)
        rings = part_rings(near, str(part), shape_of(robot, str(part)), points)
        if rings is not None:
            found[str(part)] = between(near["time"].values, rings, times)
    return found


def visible(run: xr.Dataset, robot: RobotDescription | None) -> xr.Dataset:
    """A run of a robot that is nothing but points, with balls in their place: of their volume, or of as much water.

    Without the robot, and where anything has a size, the run as it is.
    """
    limbs = {} if robot is None else robot.parts
    points = {name: limb for name, limb in limbs.items() if limb.kind == "rigid" and limb.shape == "point"}
    if robot is None or points.keys() != limbs.keys():
        return run
    sizes = {name: point.volume or (point.mass or 0.0) / robot.water.density for name, point in points.items()}
    r = np.array([(0.75 * sizes[str(part)] / np.pi) ** (1 / 3) for part in run["station_part"].values])
    return run.assign(station_x=("station", r), half_width=(("station", "across"), np.stack([r, r], axis=-1)))


def triangles(rings: int, around: int) -> Int[np.ndarray, "n 3"]:
    """Corners of the triangles of a closed tube, whose vertices are counted ring by ring.

    The first and the last ring close the ends; the walls run between the others.
    """
    ring, k = np.meshgrid(np.arange(1, rings - 2), np.arange(around), indexing="ij")
    a, b = ring * around + k, ring * around + (k + 1) % around
    walls = np.concatenate([np.stack([a, b, b + around], -1), np.stack([a, b + around, a + around], -1)])
    fan = np.stack([np.zeros(around - 2, int), np.arange(1, around - 1), np.arange(2, around)], axis=-1)
    return np.concatenate([walls.reshape(-1, 3), fan[:, ::-1], fan + (rings - 1) * around])


def part_rings(
    run: xr.Dataset, part: str, shape: str = "cylinder", around: int = AROUND
) -> Float[np.ndarray, "t rings around 3"] | None:
    """Rings of one part [m, world frame] at all saved times, both end rings doubled; None for a part without size.

    `around`, a multiple of four, is how many points they have; along a curve they come closer in proportion.
    """
    own = np.flatnonzero(run["station_part"].values == part)
    x, half, position, rotation = (run[name].values for name in STATIONS)
    return rings_of(x[own], half[own], position[:, own], rotation[:, own], shape, around)


def rings_of(
    x: Float[np.ndarray, "n"],
    half: Float[np.ndarray, "n 2"],
    position: Float[np.ndarray, "t n 3"],
    rotation: Float[np.ndarray, "t n 3 3"],
    shape: str,
    around: int = AROUND,
) -> Float[np.ndarray, "t rings around 3"] | None:
    """The same of a part's stations: places along it [m], half axes [m], poses in the world frame."""
    if not np.any(half > 0) or (len(x) == 1 and x[0] == 0):
        return None
    if x[0] == 0:  # a rod's first station is its root; that of a rigid part its centre
        x, position, rotation, half = finer(x, position, rotation, half, around * _FINER // AROUND)
    elif shape == "spheroid":
        x, position, rotation, half = _spheroid(x[0], position[:, :1], rotation[:, :1], half[:1], around + 1)
    else:
        x, position, rotation, half = _to_the_ends(x, position, rotation, half)
    across = half[:, None, :] * _outline(shape, around)  # [rings, around, 2]
    rings = position[:, :, None, :] + np.einsum("tnij,nkj->tnki", rotation[..., 1:], across)
    return np.concatenate([rings[:, :1], rings, rings[:, -1:]], axis=1)


def description(run: xr.Dataset) -> RobotDescription | None:
    """Return the robot that a run carries, or None where it carries none."""
    try:
        return parse_robot(run.attrs.get("robot", ""))
    except InputError:
        return None


def shape_of(robot: RobotDescription | None, part: str) -> str:
    """Shape or section of a part, such as spheroid; a cylinder where it is not known."""
    if robot is None:
        return "cylinder"
    limb = robot.parts.get(part)
    if limb is None:
        return "cylinder"
    shape = limb.section if isinstance(limb, Rod) else limb.shape
    return "spheroid" if shape == "point" else shape


def hard_colour(k: int) -> str:
    """Colour of the k-th rigid part of a robot, a grey."""
    return _HARD[k % len(_HARD)]


def colours_of(run: xr.Dataset, parts: Collection[str], soft: str = BLUE) -> dict[str, str]:
    """Colours of parts by name: `soft` of rods, greys of rigid ones."""
    rods = {name for name in parts if _is_rod(run, name)}
    hard = {name: hard_colour(k) for k, name in enumerate(name for name in parts if name not in rods)}
    return hard | dict.fromkeys(rods, soft)


def _is_rod(run: xr.Dataset, part: str) -> bool:
    return float(run["station_x"].values[run["station_part"].values == part][0]) == 0


def _outline(shape: str, around: int) -> Float[np.ndarray, "around 2"]:
    """Section of half widths 1: a circle, or a square whose corners are among the points."""
    angle = np.pi / 4 + 2 * np.pi * np.arange(around) / around
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return circle / np.max(np.abs(circle), axis=-1, keepdims=True) if shape in ("box", "rectangle") else circle


def hermite(x: np.ndarray, y: np.ndarray, slope: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cubics through the values y [n, ...] at increasing x, with the slopes dy/dx, evaluated at `at` [m]."""
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    more = (slice(None), *[None] * (y.ndim - 1))
    h, u = (x[k + 1] - x[k])[more], ((at - x[k]) / (x[k + 1] - x[k]))[more]
    value = (1 + 2 * u) * (1 - u) ** 2 * y[k] + u**2 * (3 - 2 * u) * y[k + 1]
    return value + h * u * (1 - u) * ((1 - u) * slope[k] - u * slope[k + 1])


def between(saved: np.ndarray, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Values [t, ...] at `times`, by cubics through those at the saved times [n, ...]."""
    if len(saved) < 2:
        return np.repeat(values, len(times), axis=0)
    return hermite(saved, values, np.gradient(values, saved, axis=0), times)


def nearest_rotation(A: np.ndarray) -> np.ndarray:
    """Rotations nearest to matrices [..., 3, 3] that are almost some."""
    U, _, V = np.linalg.svd(A)
    return U @ V


def finer(
    x: np.ndarray, position: np.ndarray, rotation: np.ndarray, half: np.ndarray, pieces: int = _FINER
) -> tuple[np.ndarray, ...]:
    """Stations of a rod and more between them, along cubics tangent to it."""
    parts = [np.linspace(a, b, pieces, endpoint=False) for a, b in pairwise(x)]
    at = np.concatenate([*parts, x[-1:]])
    place, slope = np.moveaxis(position, 1, 0), np.moveaxis(rotation[..., 0], 1, 0)
    turned = np.moveaxis(rotation, 1, 0)
    turned = nearest_rotation(hermite(x, turned, np.gradient(turned, x, axis=0), at))
    widths = np.stack([np.interp(at, x, half[:, i]) for i in range(2)], axis=-1)
    return at, np.moveaxis(hermite(x, place, slope, at), 0, 1), np.moveaxis(turned, 0, 1), widths


def _to_the_ends(x: np.ndarray, position: np.ndarray, rotation: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, ...]:
    """Strips of a rigid part (its centre, if it has none) and its two ends, straight on from the nearest strip."""
    length = 2 * x[0]
    if len(x) > 1:
        x, position, rotation, half = x[1:], position[:, 1:], rotation[:, 1:], half[1:]
    root = position[:, :1] - x[0] * rotation[:, :1, :, 0]
    tip = position[:, -1:] + (length - x[-1]) * rotation[:, -1:, :, 0]
    ends = np.arange(-1, len(x) + 1).clip(0, len(x) - 1)
    x = np.concatenate([[0.0], x, [length]])
    return x, np.concatenate([root, position, tip], axis=1), rotation[:, ends], half[ends]


def _spheroid(
    middle: float, position: np.ndarray, rotation: np.ndarray, half: np.ndarray, sections: int
) -> tuple[np.ndarray, ...]:
    """Sections of a spheroid, from pole to pole."""
    angle = np.linspace(0, np.pi, sections)
    x = middle * (1 - np.cos(angle))
    place = position + (x - middle)[:, None] * rotation[..., 0]
    return x, place, np.repeat(rotation, len(x), axis=1), half * np.sin(angle)[:, None]
