"""The skin of a robot as rings around its parts, or the faces of meshes, from the stations of a run; no plotting."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from itertools import cycle, pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int

from nectosome.description import Rigid, RobotDescription, Rod, SoftPlate, robot_of_run
from nectosome.geometry import Triangles
from nectosome.mechanism.rods import gauss
from nectosome.mechanism.shapes import shape_of
from nectosome.mechanism.webs import APART
from nectosome.units import InputError

from .style import BLUE

AROUND = 12  # points on a ring
_HARD = ("#9aa1aa", "#4f5660", "#c9ced4")  # rigid parts, in turn
_FINER = 3  # rings per interval between a rod's stations, where rings have that many points


class TubeStations(NamedTuple):
    """The stations of a part, in the world frame."""

    x: Float[np.ndarray, "n"]  # along the part [m]: at first 0, the root of a rod, or the centre of a rigid part
    half: Float[np.ndarray, "*t n 2"]  # half axes of the section [m], of sheets at each time
    position: Float[np.ndarray, "t n 3"]  # [m]
    rotation: Float[np.ndarray, "t n 3 3"]
    station: Int[np.ndarray, "n"]  # of the run, that of each or the nearest one

    @property
    def rod(self) -> bool:
        """Whether the part is a rod."""
        return float(self.x[0]) == 0

    @property
    def sheet(self) -> bool:
        """Whether it is a strip of a sheet."""
        return self.half.ndim == 3


class PartLook(NamedTuple):
    """How a part is drawn: by its surface about its first station, else by sections; `profile` as of `RigidShape`."""

    square: bool = False  # whether its sections are rectangles
    profile: Callable[[int], tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]] | None] = lambda n: None
    surface: Triangles | None = None


def parts_of(run: xr.Dataset, robot: RobotDescription | None = None) -> dict[str, TubeStations]:
    """TubeStations of the parts that have a size, by part; of a known robot's webs for each gap, as `bell.1`, of its
    soft plates for each strip along them, as `fin.1`."""
    x, half, position, rotation = (run[name].values for name in ("station_x", "half_width", "position", "rotation"))
    parts: dict[str, TubeStations] = {}
    for part in map(str, run["part"].values):
        own = np.flatnonzero(run["station_part"].values == part)
        if robot is not None and part in robot.webs:
            gaps = own.reshape(len(robot.webs[part].gaps), -1, 2)
            for k, pairs in enumerate(gaps, start=1):
                parts[f"{part}.{k}"] = _gap(x, half[own[0], 1], position[:, pairs], rotation[:, pairs], pairs)
        elif robot is not None and isinstance(limb := robot.parts.get(part), SoftPlate):
            parts |= {f"{part}.{k}": strip for k, strip in _strips(limb, x, half, position, rotation, own)}
        elif np.any(half[own] > 0) and (len(own) > 1 or x[own[0]] != 0):
            parts[part] = TubeStations(x[own], half[own], position[:, own], rotation[:, own], own)
    return parts


def _strips(
    plate: SoftPlate, x: np.ndarray, half: np.ndarray, position: np.ndarray, rotation: np.ndarray, own: np.ndarray
) -> Iterator[tuple[int, TubeStations]]:
    """Strips side by side of a soft plate, whose stations are `own`, each along a row of Gauss points.

    Neighbours meet halfway between where both would end.
    """
    along, across = plate.points
    s, w = gauss(across, ())
    grid = own[1 : 1 + along * across].reshape(along, across)
    wide, before = 2 * half[grid, 0], np.cumsum(w) - w
    place, y = position[:, grid], rotation[:, grid][..., 1]
    low, high = (place + (wide * (end - s) / w)[..., None] * y for end in (before, before + w))
    meet = 0.5 * (high[:, :, :-1] + low[:, :, 1:])  # where two strips do
    edges = np.concatenate([low[:, :, :1], meet, high[:, :, -1:]], axis=2)
    for k, here in enumerate(grid.T):
        one, other = edges[:, :, k], edges[:, :, k + 1]
        y = (other - one) / np.linalg.norm(other - one, axis=-1, keepdims=True)
        z = np.cross(rotation[:, here][..., 0], y)
        z /= np.linalg.norm(z, axis=-1, keepdims=True)
        halves = 0.5 * np.linalg.norm(other - one, axis=-1)
        sizes = np.stack([halves, np.broadcast_to(half[here, 1], halves.shape)], axis=-1)
        turned = np.stack([np.cross(y, z), y, z], axis=-1)
        yield k + 1, _to_edges(x[here], float(x[own[-1]]), sizes, 0.5 * (one + other), turned, here)


def _gap(
    x: np.ndarray, thin: float, strips: np.ndarray, rotation: np.ndarray, pairs: Int[np.ndarray, "n 2"]
) -> TubeStations:
    """A gap of a web, by its pairs of strips across, straight on to the roots and tips of its limbs."""
    way, rotation = strips[:, :, 1] - strips[:, :, 0], nearest_rotation(rotation.mean(axis=2))
    wide = np.sum(way * rotation[..., 1], axis=-1) / (2 * APART)
    half, at = np.stack([wide, np.full_like(wide, thin)], axis=-1), x[pairs[:, 0]]
    length = at[0] + at[-1]  # strips stand evenly about the middle of their limbs
    return _to_edges(at, length, half, strips.mean(axis=2), rotation, pairs[:, 0])


def _to_edges(
    at: Float[np.ndarray, "n"],
    length: float,
    half: Float[np.ndarray, "*t n 2"],
    middle: Float[np.ndarray, "t n 3"],
    rotation: Float[np.ndarray, "t n 3 3"],
    station: Int[np.ndarray, "n"],
) -> TubeStations:
    """A strip of a sheet, straight on from its first and last place to its ends at 0 and its length [m]."""
    ends = np.array([0.0, length])
    places = np.concatenate([ends[:1], at, ends[1:]])

    def to_ends(values: np.ndarray) -> np.ndarray:
        first, last = ((values[..., b, :] - values[..., a, :]) / (at[b] - at[a]) for a, b in ((0, 1), (-2, -1)))
        before, after = values[..., 0, :] + (ends[0] - at[0]) * first, values[..., -1, :] + (ends[1] - at[-1]) * last
        return np.concatenate([before[..., None, :], values, after[..., None, :]], axis=-2)

    nearest = np.arange(-1, len(at) + 1).clip(0, len(at) - 1)
    return TubeStations(places, np.maximum(to_ends(half), 0.0), to_ends(middle), rotation[:, nearest], station[nearest])


def tubes(
    run: xr.Dataset, times: Float[np.ndarray, "t"], around: Mapping[str, int] | None = None
) -> dict[str, Float[np.ndarray, "t rings around 3"]]:
    """Rings [m, world frame] around every part that has a size, at `times` [s], by part; of meshes and plates faces.

    Between saved times they follow cubics. Rods are drawn through their stations, rigid parts from end to end; boxes
    and spheroids as such if the run carries its robot, and points as `visible` has them. `around` tells parts whose
    rings have another number of points.
    """
    robot = description(run)
    near = near_times(visible(run, robot), times)
    arrays: dict[str, np.ndarray] = {}
    for part, stations in parts_of(near, robot).items():
        look = look_of(robot, part)
        if look.surface is None:
            rings = rings_of(stations, look, (around or {}).get(part, AROUND))
        else:
            turned = np.einsum("tij,mkj->tmki", stations.rotation[:, 0], look.surface.corners)
            rings = stations.position[:, :1, None] + turned
        arrays[part] = between(near["time"].values, rings, times)
    return arrays


def visible(run: xr.Dataset, robot: RobotDescription | None) -> xr.Dataset:
    """A run of a robot that is nothing but points, with balls in their place: of their volume, or of as much water.

    Without the robot, and where anything has a size, the run as it is.
    """
    limbs = {} if robot is None else robot.parts
    points = {name: limb for name, limb in limbs.items() if limb.kind == "rigid" and limb.form == "point"}
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


def rings_of(stations: TubeStations, look: PartLook, around: int = AROUND) -> Float[np.ndarray, "t rings around 3"]:
    """Rings of a part [m, world frame] at all times of its stations, both end rings doubled.

    `around`, a multiple of four, is how many points they have; along a curve they come closer in proportion.
    """
    x, half, position, rotation, _ = stations
    if stations.rod:
        x, position, rotation, half = finer(x, position, rotation, half, around * _FINER // AROUND, stations.sheet)
    elif (profile := look.profile(around + 1)) is not None:
        position = position[:, :1] + x[0] * (profile[0] - 1)[:, None] * rotation[:, :1, :, 0]
        rotation, half = np.repeat(rotation[:, :1], around + 1, axis=1), half[:1] * profile[1][:, None]
    else:
        x, position, rotation, half = _to_the_ends(x, position, rotation, half)
    across = half[..., None, :] * _outline(look.square, around)  # [*t, rings, around, 2]
    across = np.broadcast_to(across, (len(position), *across.shape[-3:]))
    rings = position[:, :, None, :] + np.einsum("tnij,tnkj->tnki", rotation[..., 1:], across)
    return np.concatenate([rings[:, :1], rings, rings[:, -1:]], axis=1)


def description(run: xr.Dataset) -> RobotDescription | None:
    """Return the robot that a run carries, or None where it carries none."""
    with suppress(InputError):
        return robot_of_run(run.attrs.get("robot", ""))
    return None


def look_of(robot: RobotDescription | None, part: str) -> PartLook:
    """How a part of a robot is drawn: as a cylinder where the part is not known."""
    whole = part.partition(".")[0]  # of the strips of a sheet
    if robot is not None and whole in robot.webs:
        return PartLook(square=True)
    limb = None if robot is None else robot.parts.get(whole)
    if limb is None or not isinstance(limb, Rigid):
        return PartLook(square=isinstance(limb, SoftPlate) or (isinstance(limb, Rod) and limb.section == "rectangle"))
    shape = shape_of(limb)
    return PartLook(shape.square, shape.profile, shape.surface())


def colours_of(parts: Mapping[str, TubeStations], soft: str = BLUE) -> dict[str, str]:
    """Colours of parts by name: `soft` of rods, greys in turn of rigid ones."""
    greys = cycle(_HARD)
    return {name: soft if stations.rod else next(greys) for name, stations in parts.items()}


def _outline(square: bool, around: int) -> Float[np.ndarray, "around 2"]:
    """Section of half widths 1: a circle, or a square whose corners are among the points."""
    angle = np.pi / 4 + 2 * np.pi * np.arange(around) / around
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return circle / np.max(np.abs(circle), axis=-1, keepdims=True) if square else circle


def hermite(x: np.ndarray, y: np.ndarray, slope: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cubics through the values y [n, ...] at increasing x, with the slopes dy/dx, evaluated at `at` [m]."""
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    more = (slice(None), *[None] * (y.ndim - 1))
    h, u = (x[k + 1] - x[k])[more], ((at - x[k]) / (x[k + 1] - x[k]))[more]
    value = (1 + 2 * u) * (1 - u) ** 2 * y[k] + u**2 * (3 - 2 * u) * y[k + 1]
    return value + h * u * (1 - u) * ((1 - u) * slope[k] - u * slope[k + 1])


def near_times(run: xr.Dataset, times: Float[np.ndarray, "t"]) -> xr.Dataset:
    """The saved times of a run that `between` needs for `times` [s]."""
    saved = run["time"].values
    first, last = max(int(np.searchsorted(saved, times[0])) - 2, 0), int(np.searchsorted(saved, times[-1])) + 3
    return run.isel(time=slice(first, last))


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
    x: np.ndarray,
    position: np.ndarray,
    rotation: np.ndarray,
    half: np.ndarray,
    pieces: int = _FINER,
    sheet: bool = False,
) -> tuple[np.ndarray, ...]:
    """TubeStations of a rod and more between them, along cubics tangent to it; strips of a sheet may go aslant."""
    parts = [np.linspace(a, b, pieces, endpoint=False) for a, b in pairwise(x)]
    at = np.concatenate([*parts, x[-1:]])
    place, tangent = np.moveaxis(position, 1, 0), np.moveaxis(rotation[..., 0], 1, 0)
    turned = np.moveaxis(rotation, 1, 0)
    if sheet:
        across = turned[..., 1]
        aside = np.sum(np.gradient(place, x, axis=0, edge_order=2) * across, axis=-1, keepdims=True)
        tangent = tangent + aside * across
    turned = nearest_rotation(hermite(x, turned, np.gradient(turned, x, axis=0), at))
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    u = ((at - x[k]) / (x[k + 1] - x[k]))[:, None]
    widths = (1 - u) * half[..., k, :] + u * half[..., k + 1, :]
    return at, np.moveaxis(hermite(x, place, tangent, at), 0, 1), np.moveaxis(turned, 0, 1), widths


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


def parted(
    faces: Float[np.ndarray, "n 4 3"], colours: Float[np.ndarray, "n 3"], height: float
) -> tuple[Float[np.ndarray, "m 4 3"], Float[np.ndarray, "m 3"], Float[np.ndarray, "k 2 3"]]:
    """Faces and their colours, cut where they cross the level `height` [m], and the line along which they do.

    Each face that crosses is taken as two triangles. A triangle a b c with a alone on its side is cut into a triangle
    at a and the rest between b and c.
    """
    over = faces[..., 2] > height
    crosses = over.any(axis=1) & ~over.all(axis=1)
    triangles = faces[crosses][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    tints = colours[crosses].repeat(2, axis=0)
    over = triangles[..., 2] > height
    cut = over.any(axis=1) & ~over.all(axis=1)
    alone = np.argmax(over == (over.sum(axis=1) == 1)[:, None], axis=1)
    turned = np.take_along_axis(triangles, ((alone[:, None] + np.arange(3)) % 3)[..., None], axis=1)[cut]
    a, b, c = np.moveaxis(turned, 1, 0)
    ab, ac = (a + ((height - a[:, 2]) / (x[:, 2] - a[:, 2]))[:, None] * (x - a) for x in (b, c))
    pieces = [
        faces[~crosses],
        triangles[~cut][:, [0, 1, 2, 2]],
        np.stack([a, ab, ac, ac], 1),
        np.stack([ab, b, c, ac], 1),
    ]
    return (
        np.concatenate(pieces),
        np.concatenate([colours[~crosses], tints[~cut], tints[cut], tints[cut]]),
        np.stack([ab, ac], axis=1),
    )
