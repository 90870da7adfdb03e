"""A run as bodies for a scene: rigid parts as meshes that move, soft ones as slices; no drawing here."""

from copy import copy
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int
from plotly.colors import hex_to_rgb, sequential
from scipy.spatial.transform import Rotation

from nectosome.description import RobotDescription
from nectosome.geometry import creased
from nectosome.view.style import BLUE, source_lines

from ..tubes import PartLook, TubeStations, colours_of, finer, look_of, parts_of, rings_of, triangles, visible

AROUND = 12  # corners of a slice
_ROUND = 24  # of a rigid part, which is drawn once
_OVERLAP = 1.06  # of slices, so that no gap shows between them
_PIECES = 3  # slices between two stations of a rod
_STEP = 0.02  # of a rod's width
_NO_FORCE = 1e-3  # of the largest: no arrow
_LEFT_OUT = ("weight", "buoyancy")  # of what the water does
_SCALE = np.array([hex_to_rgb(colour) for colour in sequential.Viridis])


class RigidMesh(NamedTuple):
    """A part that keeps its shape: a mesh in the frame of its first station."""

    place: Float[np.ndarray, "t 3"]  # [m]
    turn: Float[np.ndarray, "t 4"]  # quaternion, scalar first
    vertices: Float[np.ndarray, "n 3"]  # [m]
    faces: Int[np.ndarray, "m 3"]
    colour: str
    flat: bool  # whether its faces meet at edges

    def moved(self, by: Float[np.ndarray, "t 3"]) -> "RigidMesh":
        """Return the same elsewhere, at each instant by so much [m]."""
        return self._replace(place=self.place + by)

    def corners(self, k: int) -> Float[np.ndarray, "n 3"]:
        """Corners at instant k, in the world [m]."""
        return Rotation.from_quat(self.turn[k], scalar_first=True).apply(self.vertices) + self.place[k]


class Slices(NamedTuple):
    """Cylinders of length, width and height 1 along x, put and stretched."""

    place: Float[np.ndarray, "k 3"]  # [m]
    turn: Float[np.ndarray, "k 4"]
    size: Float[np.ndarray, "k 3"]  # along, across y, across z [m]

    @property
    def ends(self) -> "Slices":
        """The first and the last one, moved outwards by half of their length: where discs close the rod."""
        turn, size = self.turn[[0, -1]], self.size[[0, -1]]
        out = 0.5 * size * [[-1, 0, 0], [1, 0, 0]]
        return Slices(self.place[[0, -1]] + Rotation.from_quat(turn, scalar_first=True).apply(out), turn, size)


class Soft:
    """A rod as slices across it, in the frame of its root, which is at `place` [m] with `turn` at all instants.

    Slices are computed when they are shown: most instants never are.
    """

    def __init__(self, stations: TubeStations, forces: Float[np.ndarray, "t loads n 3"], colour: str):
        self.x, half, position, rotation, _ = stations
        self._half = np.broadcast_to(half, (len(position), *half.shape[-2:]))
        self._sheet = stations.sheet
        self._pieces = 3 * _PIECES if self._sheet else _PIECES  # a web goes from narrow to wide
        self._forces, self.colour = forces, colour  # of the water [N/m]
        root = rotation[:, 0]
        self.place, self.turn = position[:, 0], _quaternions(root)
        self._position = np.einsum("tji,tnj->tni", root, position - position[:, :1])
        self._rotation = np.einsum("tji,tnjk->tnik", root, rotation)

    def moved(self, by: Float[np.ndarray, "t 3"]) -> "Soft":
        """Return the same elsewhere, at each instant by so much [m]."""
        other = copy(self)
        other.place = self.place + by
        return other

    def corners(self, k: int) -> Float[np.ndarray, "n 3"]:
        """Middles of the slices at instant k, in the world [m]."""
        return Rotation.from_quat(self.turn[k], scalar_first=True).apply(self.slices(k).place) + self.place[k]

    def slices(self, k: int) -> Slices:
        """Slices at instant k, in the frame of the root."""
        now = self._position[k : k + 1], self._rotation[k : k + 1], self._half[k]
        _, place, R, widths = finer(self.x, *now, self._pieces, self._sheet)
        bend = np.linalg.norm(np.diff(R[0, :, :, 0], axis=0), axis=1)  # rad, from one end of a slice to the other
        along = np.linalg.norm(np.diff(place[0], axis=0), axis=1) * _OVERLAP
        along += bend * widths[:-1].max(axis=1)  # the outside of a bend is longer
        size = np.concatenate([along[:, None], widths[:-1] + widths[1:]], axis=1)
        return Slices(0.5 * (place[0, :-1] + place[0, 1:]), _halfway(_quaternions(R[0])), size)

    @property
    def stepped(self) -> bool:
        """Whether slices differ so much from the next ones that one sees in between them."""
        widths = self.slices(0).size[:, 1:]
        return bool((np.abs(np.diff(widths, axis=0)) > _STEP * widths.max()).any())

    def shown(self, colouring: str) -> Float[np.ndarray, "t k"] | None:
        """Values of a colouring for the slices at all instants; None for the colour of the material."""
        if colouring == "curvature":
            return self._bending
        return self._load if colouring == "load of the water" else None

    @cached_property
    def _bending(self) -> Float[np.ndarray, "t k"]:
        """Curvature [1/m]."""
        at, _, R, _ = finer(self.x, self._position, self._rotation, self._half[0], self._pieces)
        turned = Rotation.from_matrix(np.swapaxes(R[:, :-1], -1, -2).reshape(-1, 3, 3) @ R[:, 1:].reshape(-1, 3, 3))
        return np.linalg.norm(turned.as_rotvec()[:, 1:], axis=1).reshape(R.shape[0], -1) / np.diff(at)

    @cached_property
    def _load(self) -> Float[np.ndarray, "t k"]:
        """What the water does along the rod [N/m]."""
        at = finer(self.x, self._position[:1], self._rotation[:1], self._half[0], self._pieces)[0]
        force = np.linalg.norm(np.nan_to_num(self._forces).sum(axis=1), axis=-1)
        middle = 0.5 * (at[:-1] + at[1:])
        return np.stack([np.interp(middle, self.x, row) for row in force])


class Arrows(NamedTuple):
    """What each load does to each part, from the middle of the part, in the colour of the load."""

    names: tuple[str, ...]  # of the loads
    colours: tuple[str, ...]  # of the loads
    root: Float[np.ndarray, "t n 3"]  # [m]
    force: Float[np.ndarray, "t n 3"]  # [N]
    load: Int[np.ndarray, "n"]  # which load an arrow is of


def bodies_of(run: xr.Dataset, robot: RobotDescription | None, soft: str = BLUE) -> dict[str, RigidMesh | Soft]:
    """Bodies of all parts that have a size, by part; of an unknown robot all that is rigid is a cylinder.

    Those of points are as `visible` has them.
    """
    run = visible(run, robot)
    parts, forces = parts_of(run, robot), _forces(run)
    bodies: dict[str, RigidMesh | Soft] = {}
    for (part, stations), colour in zip(parts.items(), colours_of(parts, soft).values(), strict=True):
        if stations.rod:
            bodies[part] = Soft(stations, forces[:, :, stations.station], colour)
        else:
            bodies[part] = _rigid(stations, look_of(robot, part), colour)
    return bodies


def _forces(run: xr.Dataset) -> Float[np.ndarray, "t loads n 3"]:
    """What each load of the water does along rods [N/m]; nothing where the run does not tell it."""
    if "line_force" not in run:
        return np.zeros((1, 1, run.sizes["station"], 3))
    return run["line_force"].values[:, [name not in _LEFT_OUT for name in run["load"].values]]


def _rigid(stations: TubeStations, look: PartLook, colour: str) -> RigidMesh:
    place, R = stations.position[:, 0], stations.rotation[:, 0]
    if look.surface is not None:
        vertices, faces = creased(look.surface)
    else:
        (rings,) = rings_of(
            stations._replace(position=stations.position[:1], rotation=stations.rotation[:1]), look, _ROUND
        )
        vertices = (rings.reshape(-1, 3) - place[0]) @ R[0]
        faces = triangles(rings.shape[0], rings.shape[1])
    return RigidMesh(place, _quaternions(R), vertices, faces, colour, flat=look.square and look.surface is None)


def _quaternions(R: Float[np.ndarray, "*n 3 3"]) -> Float[np.ndarray, "*n 4"]:
    return Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(scalar_first=True).reshape(*R.shape[:-2], 4)


def _halfway(turn: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n-1 4"]:
    """Quaternions halfway between each and the next."""
    one, other = turn[:-1], turn[1:]
    middle = one + np.sign(np.sum(one * other, axis=1, keepdims=True)) * other
    return middle / np.linalg.norm(middle, axis=1, keepdims=True)


def arrows_of(run: xr.Dataset) -> Arrows:
    """Arrows of all loads that push a part at any time; none of what is no motion."""
    if "load_force" not in run:
        none = np.zeros((run.sizes["time"], 0, 3))
        return Arrows((), (), none, none, np.zeros(0, int))
    force = np.nan_to_num(run["load_force"].values)  # [t, load, part, axis]
    load, part = np.nonzero(np.abs(force).max(axis=(0, 3)) > _NO_FORCE * np.abs(force).max())
    middles = [
        run["position"].values[:, run["station_part"].values == name].mean(axis=1) for name in run["part"].values
    ]
    names = [str(name) for name in run["load"].values]
    lines, used = source_lines(names), sorted(set(load.tolist()))
    return Arrows(
        tuple(names[i] for i in used),
        tuple(lines[i]["color"] for i in used),
        np.stack([middles[p] for p in part], axis=1) if part.size else np.zeros((len(force), 0, 3)),
        force[:, load, part],
        np.searchsorted(used, load),
    )


def slice_mesh() -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "m 3"]]:
    """Wall of a cylinder along x, of length, width and height 1, about 0.

    Its ends are open, since discs would show as steps wherever a rod is tapered.
    """
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    ring = 0.5 * np.stack([np.zeros(AROUND), np.cos(angle), np.sin(angle)], axis=-1)
    ends = np.array([[-0.5, 0, 0], [0.5, 0, 0]])
    rings = np.concatenate([ring + ends[0], ring + ends[1]])
    k = np.arange(AROUND)
    a, b = k, (k + 1) % AROUND
    return rings, np.concatenate([np.stack([a, b, b + AROUND], -1), np.stack([a, b + AROUND, a + AROUND], -1)])


def disc_mesh() -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "m 3"]]:
    """Disc across x, of width and height 1, about 0."""
    ring, k = slice_mesh()[0][:AROUND] * [0, 1, 1], np.arange(1, AROUND - 1)
    return ring, np.stack([np.zeros_like(k), k, k + 1], axis=-1)


def colours(values: Float[np.ndarray, "*n"], largest: float) -> Int[np.ndarray, "*n 3"]:
    """Colours [0..255] of values from 0 to `largest`, dark to light."""
    share = np.clip(values / largest if largest > 0 else np.zeros_like(values), 0, 1) * (len(_SCALE) - 1)
    return np.stack([np.interp(share, np.arange(len(_SCALE)), _SCALE[:, c]) for c in range(3)], -1).astype(np.uint8)


def linear(colour: Int[np.ndarray, "*n 3"]) -> Int[np.ndarray, "*n 3"]:
    """Colours [0..255] of sRGB as shares of light, which viser takes them for where many things have one each."""
    share = colour / 255
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.round(255 * light).astype(np.uint8)
