"""A run as a camera sees that goes along with it: the robot, its trail, a grid, waves, a scale, stream and time."""

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int

from nectosome.description import WaterDescription
from nectosome.geometry import area_vectors, creased
from nectosome.units import InputError

from .camera import Perspective, axes_towards, colour_of, lit, outlines, seen, walls
from .canvas import Picture, Raster, Vector
from .sea import Sea
from .style import BLACK, ORANGE, SKY
from .tubes import between, colours_of, description, look_of, parted, parts_of, tubes, visible

# where the viewer is, seen from a robot that swims towards -x; of one that swims the other way, mirrored
CAMERAS = {
    "side": (0.0, -1.0, 0.0),
    "top": (0.0, 0.0, 1.0),
    "front": (-1.0, 0.0, 0.25),
    "three-quarter": (-0.55, -0.8, 0.5),
}

_HALF = np.tan(np.radians(15))  # height of the view over its distance, from the middle to the upper edge
_ROOM = 0.72  # of the picture's width and height: what the robot keeps within
_SMOOTH = 0.5  # s, standard deviation of the window over which the camera's path is a mean
_FACE = 5.0  # px, about how large a face is
_PIECES = 20_000  # into how many faces a mesh is cut at most
_CHUNK = 32  # frames whose surfaces are worked out at once
_LOOKED_AT = 60  # saved instants at which the robot is measured, so that it stays in the picture
_SIGHT = 1.5  # how far grid and trail are seen, in distances of the camera
_PANE, _NEAREST = 0.75, 0.15  # radius of the surface, and how near it comes to the eye, in distances of the camera
_PANES, _CORNERS, _CLEAR = 12, 72, 0.035  # how many discs it is, their corners, and how much each covers

_ABOVE, _BELOW = colour_of("#eef6f8"), colour_of("#a9cbd8")  # the water, from the upper to the lower edge
_GRID, _SURFACE, _TRAIL, _INK = (colour_of(text) for text in ("#4f7f93", SKY, ORANGE, BLACK))
_BENT = 4  # pieces of a line of the surface where there are waves
_LENGTHS = [m * 10.0**k for k in range(-9, 9) for m in (1, 2, 5)]  # of grids and scales [m]


class GridPlane(NamedTuple):
    """A plane with a grid on it."""

    normal: int  # the axis across it
    place: float  # along that axis [m]
    colour: Float[np.ndarray, "3"]
    strength: float  # of the lines, from 0 to 1
    directions: int = 2  # in which lines run: squares, or lines along the last of its axes only


class Scene:
    """What there is to see of a run until `end` [s], from one of `CAMERAS`, or from (x, y, z) of what is looked at.

    Pictures have `size` [px].

    The camera keeps its direction and its distance, such that the robot stays in the picture at all times, and goes
    along with the middle of the robot, smoothed. `note` is written beside the time, which has so many `decimals`.
    Raises InputError where no part has a size.
    """

    def __init__(
        self,
        run: xr.Dataset,
        end: float,
        size: tuple[int, int],
        camera: str | tuple[float, float, float],
        note: str = "",
        decimals: int = 2,
    ):
        self._size, self._note, self._decimals = size, note, decimals
        robot = description(run)
        self._run = run = visible(run, robot)
        self._title = robot.name if robot is not None else str(run.attrs.get("title", ""))
        saved = run["time"].values
        self._instants = _evenly(float(saved[0]), end)
        self._camera_path = _smoothed(between(saved, _middle(run), self._instants), self._instants)
        known = max(int(np.searchsorted(saved, end, side="right")), 1)
        some = run.isel(time=np.unique(np.linspace(0, known - 1, _LOOKED_AT).astype(int)))
        times = some["time"].values
        rough = tubes(some, times)
        if not rough:
            raise InputError("no part of this robot has a size, so that there is nothing to see.")
        points = np.concatenate([rings.reshape(len(times), -1, 3) for rings in rough.values()], axis=1)
        if isinstance(camera, str):
            x, y, z = CAMERAS[camera]
            back = self._camera_path[-1, 0] - self._camera_path[0, 0] > 0.05 * np.ptp(points[0], axis=0).max()
            camera = (-x if back else x, y, z)
        self._axes = axes_towards(camera)
        self._away, shift = _framed((points - self._along(times)[:, None]) @ self._axes.T, size)
        self._camera_path += shift @ self._axes
        self._focal = 0.5 * size[1] / _HALF

        per_metre = self._focal / self._away
        surfaces = {name: look_of(robot, name).surface for name in rough}
        self._meshes = {name: creased(surface).faces for name, surface in surfaces.items() if surface is not None}
        self._around = {name: _around(rings[0], per_metre) for name, rings in rough.items()}
        first = tubes(run, times[:1], self._around)
        self._cuts = {name: _cuts(rings[0], per_metre) for name, rings in first.items() if name not in self._meshes}
        self._pieces = {name: _pieces(first[name][0], per_metre) for name in self._meshes}
        self._colours = {name: colour_of(text) for name, text in colours_of(parts_of(run, robot)).items()}
        self._sea = Sea(WaterDescription() if robot is None else robot.water)
        self._planes = self._planes_of(points, robot.water if robot is not None else None)
        self._lattice = _lattice(self._step, _SIGHT * self._away)
        path = between(saved, run["position"].values[:, 0], self._instants)
        passed = np.cumsum(np.linalg.norm(np.diff(path, axis=0, prepend=path[:1]), axis=1)) * per_metre / 3
        kept = np.diff(np.floor(passed), prepend=-1) > 0  # one point every three pixels
        self._passed, self._path = self._instants[kept], path[kept]
        share = (np.arange(size[1]) + 0.5)[:, None] / size[1]
        self._water = _ABOVE + (_BELOW - _ABOVE) * share

    def pictures(self, times: Float[np.ndarray, "t"]) -> Iterator[Picture]:
        """One picture for each of the times [s], which increase; memory does not grow with their number."""
        canvas = Raster(self._size, self._water)
        for instant in self._at(times):
            canvas.clear()
            self._draw(canvas, *instant)
            yield canvas.picture()

    def svg(self, time: float) -> str:
        """The picture of one time [s] in lines and faces that stay sharp at any size."""
        canvas = Vector(self._size, self._water)
        for instant in self._at(np.array([time])):
            self._draw(canvas, *instant)
        return canvas.svg()

    def _at(self, times: Float[np.ndarray, "t"]) -> Iterator[tuple[float, dict[str, np.ndarray], np.ndarray]]:
        """Each time, the rings of all parts, and the place of the body."""
        for k in range(0, len(times), _CHUNK):
            some = times[k : k + _CHUNK]
            parts = tubes(self._run, some, self._around)
            places = between(self._run["time"].values, self._run["position"].values[:, 0], some)
            for i, time in enumerate(some):
                yield float(time), {name: rings[i] for name, rings in parts.items()}, places[i]

    def camera(self, time: float) -> Perspective:
        """Camera at a time [s]."""
        return Perspective(self._target(time) + self._away * self._axes[2], self._axes, self._focal, self._size)

    def _draw(self, canvas: Raster | Vector, time: float, parts: Mapping[str, np.ndarray], place: np.ndarray) -> None:
        camera = self.camera(time)
        floor, *surfaces = self._planes
        self._draw_plane(canvas, camera, floor, time)
        if floor.normal == 2:
            bodies = (body for name, rings in parts.items() for body in self._bodies(name, rings))
            canvas.darken(outlines(camera, (rings * (1, 1, 0) + (0, 0, floor.place) for rings in bodies)), 0.2)
        each = [(self._colours[name], *self._faces(name, rings)) for name, rings in parts.items()]
        faces = np.concatenate([some for _, some, _ in each])
        colours = np.concatenate([lit(some, colour, camera, normal) for colour, some, normal in each])
        ribbon, tints = self._trail(camera, time, place)
        line = np.zeros((0, 2, 3))
        for surface in surfaces:
            faces, colours, line = parted(self._from_waves(faces, time, -1), colours, surface.place)
            faces, line = self._from_waves(faces, time), self._from_waves(line, time)
        faces, colours = np.concatenate([faces, ribbon]), np.concatenate([colours, tints])
        for surface in surfaces:  # it hides nothing of what is on the viewer's side of it
            level = self._from_waves(faces, time, -1)[..., 2].mean(axis=1)
            nearer = (level > surface.place) == (camera.eye[2] > surface.place)
            canvas.paint(*seen(camera, faces[~nearer], colours[~nearer]))
            self._draw_surface(canvas, camera, surface, time, line)
            faces, colours = faces[nearer], colours[nearer]
        canvas.paint(*seen(camera, faces, colours))
        self._write(canvas, time)

    def _from_waves(self, points: np.ndarray, time: float, sign: float = 1.0) -> np.ndarray:
        """Points raised by the height of the waves over each, or lowered."""
        return points + sign * self._sea.rise(time, points)[..., None] * np.array([0.0, 0.0, 1.0])

    def _bodies(self, name: str, rings: np.ndarray) -> Iterable[np.ndarray]:
        """Rings of bodies that are convex between each two of them: those of a part, or each triangle of a mesh."""
        return rings[:, [[0, 1], [2, 2]]] if name in self._meshes else (rings,)

    def _faces(self, name: str, rings: np.ndarray) -> tuple[Float[np.ndarray, "n 4 3"], np.ndarray | None]:
        """Faces of a part, and their normals where these are not those of the faces: of a mesh, smooth but at edges."""
        if name not in self._meshes:
            return walls(_refined(rings, self._cuts[name])), None
        corner, pieces = self._meshes[name], self._pieces[name]
        area = np.repeat(area_vectors(rings), 3, axis=0)
        normal = np.stack([np.bincount(corner.ravel(), x) for x in area.T], axis=-1)[corner]
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), np.finfo(float).tiny)
        return (pieces @ rings[:, None]).reshape(-1, 4, 3), (pieces.mean(axis=1) @ normal).reshape(-1, 3)

    # --- where the camera is ------------------------------------------------------------------------------------------

    def _along(self, times: np.ndarray) -> Float[np.ndarray, "t 3"]:
        return np.stack([np.interp(times, self._instants, self._camera_path[:, i]) for i in range(3)], axis=-1)

    def _target(self, time: float) -> Float[np.ndarray, "3"]:
        return self._along(np.array([time]))[0]

    # --- what is around the robot -------------------------------------------------------------------------------------

    @property
    def _step(self) -> float:
        """Length of the grid's squares [m]."""
        return max(length for length in _LENGTHS if length <= self._away / 6)

    def _planes_of(self, points: np.ndarray, water: WaterDescription | None) -> list[GridPlane]:
        """A floor, that of the water if it is near, or a wall behind the robot; and the water's surface if it is near.

        A wall is for level cameras, and for what moves more up or down than along; not for what comes or goes.
        """
        low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
        moved, back = np.ptp(self._camera_path, axis=0), self._axes[2]
        gap, near = 0.06 * self._away, 0.5 * self._away
        normal = int(np.argmax(np.abs(back[:2])))
        climbs = moved[2] > max(moved[0], moved[1], near)
        if water is not None and water.floor is not None and abs(low[2] - water.floor) < near:
            first = GridPlane(2, water.floor, _GRID, 0.4)
        elif (abs(back[2]) < 0.1 or climbs) and abs(back[2]) < 0.9 and moved[normal] < near:
            first = GridPlane(normal, low[normal] - gap if back[normal] > 0 else high[normal] + gap, _GRID, 0.4)
        else:
            first = GridPlane(2, low[2] - gap, _GRID, 0.4)
        if water is None or water.surface is None or water.surface - high[2] > near:
            return [first]
        return [first, GridPlane(2, water.surface, _SURFACE, 0.8, directions=2 if self._sea.waves else 1)]

    def _draw_plane(self, canvas: Raster | Vector, camera: Perspective, plane: GridPlane, time: float) -> None:
        target = self._target(time)
        within = [k for k in range(3) if k != plane.normal]
        pieces = self._lattice[: plane.directions].reshape(-1, 2, 2)
        lines = np.full((len(pieces), 2, 3), plane.place)
        lines[..., within] = pieces + np.floor(target[within] / self._step) * self._step
        strength = plane.strength * self._faded(lines.mean(axis=1)[:, within] - target[within])
        if plane.colour is _SURFACE and self._sea.waves:
            share = np.linspace(0, 1, _BENT + 1)[:, None]
            bent = lines[:, :1] + share * (lines[:, 1:] - lines[:, :1])
            lines = self._from_waves(np.stack([bent[:, :-1], bent[:, 1:]], axis=2).reshape(-1, 2, 3), time)
            strength = strength.repeat(_BENT)
        pixels, depth = camera.project(lines)
        near = np.all(depth > 0.1 * self._away, axis=1) & (strength > 0.01)
        near &= np.all((pixels.max(axis=1) > 0) & (pixels.min(axis=1) < self._size), axis=1)
        colours = self._in_water(pixels[near].mean(axis=1), plane.colour, strength[near])
        canvas.rule(pixels[near], colours, self._pixels(1.2))

    def _draw_surface(
        self, canvas: Raster | Vector, camera: Perspective, surface: GridPlane, time: float, line: np.ndarray
    ) -> None:
        """A clear pane, round and fading outwards, its lines, and the line where it cuts the robot."""
        target, back = self._target(time), self._axes[2]
        rise = surface.place - target[2]
        level = max(float(np.hypot(back[0], back[1])), 1e-9)
        reach = min(_PANE * self._away, ((1 - _NEAREST) * self._away - rise * back[2]) / level)
        if reach > 0:
            angle = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
            circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
            radii = reach * np.sqrt(np.arange(_PANES, 0, -1) / _PANES)
            pane = self._from_waves([*target[:2], surface.place] + radii[:, None, None] * circle, time)
            pixels, _ = camera.project(pane)
            canvas.glaze(pixels, surface.colour, _CLEAR)
        self._draw_plane(canvas, camera, surface, time)
        canvas.rule(camera.project(line)[0], np.full((len(line), 3), 255.0), self._pixels(2.5))

    def _trail(self, camera: Perspective, time: float, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Faces of a ribbon along the body's path so far, turned to the viewer, and their colours."""
        path = np.concatenate([self._path[self._passed < time], place[None]])
        away = path - self._target(time)
        path = path[self._faded(away) > 0]
        if len(path) < 2:
            return np.zeros((0, 4, 3)), np.zeros((0, 3))
        towards = camera.eye - path
        side = np.cross(np.gradient(path, axis=0), towards)
        pixels, depth = camera.project(path)
        width = 0.5 * 3.0 * self._size[1] / 720 * depth / camera.focal
        side *= (width / np.maximum(np.linalg.norm(side, axis=1), np.finfo(float).tiny))[:, None]
        a, b = path + side, path - side
        strength = 0.9 * self._faded(path - self._target(time))
        return np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=1), self._in_water(pixels, _TRAIL, strength)[1:]

    def _faded(self, away: np.ndarray) -> np.ndarray:
        """How much is seen of what is so far from where the camera looks [m]: from 1 to 0."""
        share = np.sum(away**2, axis=-1) / (_SIGHT * self._away) ** 2
        return np.clip(1 - share, 0, 1) ** 2

    def _in_water(self, pixels: np.ndarray, colour: np.ndarray, strength: np.ndarray) -> np.ndarray:
        """A colour as it looks before the water at the pixels, as far as it is seen."""
        rows = np.clip(pixels[:, 1], 0, self._size[1] - 1).astype(int)
        return self._water[rows] + strength[:, None] * (colour - self._water[rows])

    # --- what is written ----------------------------------------------------------------------------------------------

    def _pixels(self, size: float) -> float:
        """Pixels of a length that is `size` px in a picture 720 px high."""
        return size * self._size[1] / 720

    def _write(self, canvas: Raster | Vector, time: float) -> None:
        """Name, time and scale; the scale is that of the point that the camera looks at."""
        edge, size = self._pixels(36), max(self._pixels(25), 9)
        canvas.text(self._title, edge, edge + size / 2, size, True, _INK)
        words = f"{time:.{self._decimals}f} s" + (f"   {self._note}" if self._note else "")
        canvas.text(words, edge, edge + 2 * size, size, False, _INK)
        per_metre = self._focal / self._away
        length = max(x for x in _LENGTHS if x * per_metre <= 0.2 * self._size[0])
        low = self._size[1] - edge
        canvas.bar(edge, low - self._pixels(4.5), length * per_metre, self._pixels(4.5), _INK)
        said = f"{1e3 * length:g} mm" if length < 0.1 else f"{1e2 * length:g} cm" if length < 1 else f"{length:g} m"
        canvas.text(said, edge, low - self._pixels(14), size, False, _INK)
        if self._sea.streams:
            self._write_stream(canvas, self._sea.velocity(time, self._target(time)), edge, size)

    def _write_stream(self, canvas: Raster | Vector, c: Float[np.ndarray, "3"], edge: float, size: float) -> None:
        """Speed of the water where the camera looks, and an arrow along it as it is seen."""
        speed = float(np.linalg.norm(c))
        right, low = self._size[0] - edge, self._size[1] - edge
        canvas.text(f"water {speed:.2g} m/s", right - 7.5 * size, low, size, False, _INK)
        along = self._axes[:2] @ c / max(speed, 1e-12) * (1, -1)
        length = float(np.hypot(*along))
        if length < 0.05:  # towards the viewer, or away
            return
        arm, ahead = 2.5 * size * along, along / length
        side, middle = np.array([-ahead[1], ahead[0]]), np.array([right - 3.8 * size, low - 2.3 * size])
        tip, head = middle + 0.5 * arm, 0.5 * size * min(1.0, 2 * length)
        ends = [(middle - 0.5 * arm, tip), *((tip, tip - head * (ahead + 0.6 * turn * side)) for turn in (-1, 1))]
        canvas.rule(np.array(ends), np.tile(_INK, (3, 1)), self._pixels(3))


def _middle(run: xr.Dataset) -> Float[np.ndarray, "t 3"]:
    """Middle of the box around all stations and their sections at each saved time [m]."""
    place, reach = run["position"].values, run["half_width"].values.max(axis=1)[:, None]
    return 0.5 * ((place - reach).min(axis=1) + (place + reach).max(axis=1))


def _evenly(start: float, end: float) -> Float[np.ndarray, "n"]:
    """Times between which the camera's path and the trail are straight [s]."""
    step = min(1 / 60, max(end - start, 1e-9) / 100)
    return np.linspace(start, end, int(np.ceil((end - start) / step)) + 1 if end > start else 2)


def _smoothed(path: Float[np.ndarray, "n 3"], instants: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
    """Gaussian mean of a path, continued beyond its ends by its reflection about the end."""
    step = instants[1] - instants[0]
    if step == 0:
        return path
    reach = int(np.ceil(3 * _SMOOTH / step))
    weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / _SMOOTH) ** 2)
    longer = np.pad(path, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    return np.stack([np.convolve(x, weight / weight.sum(), mode="valid") for x in longer.T], axis=-1)


def _framed(seen: Float[np.ndarray, "t n 3"], size: tuple[int, int]) -> tuple[float, Float[np.ndarray, "3"]]:
    """Distance of the camera [m], and where it looks, so that points (right, up, back) stay in the picture.

    It is no nearer than the points are deep, since they would look distorted.
    """
    middle = 0.5 * (seen.min(axis=(0, 1)) + seen.max(axis=(0, 1)))
    away = 0.0
    for _ in range(8):  # what is near looks larger: the middle of what is seen is not that of the points
        right, up, back = np.moveaxis(seen - middle, -1, 0)
        across = np.maximum(np.abs(right) * size[1] / size[0], np.abs(up))
        away = max(float(np.max(back + across / (_HALF * _ROOM))), float(back.max() + np.ptp(back)))
        for k, slope in enumerate((right / (away - back), up / (away - back))):
            middle[k] += 0.5 * away * (slope.min() + slope.max())
    return away, middle


def _around(rings: Float[np.ndarray, "rings around 3"], per_metre: float) -> int:
    """How many points a ring of a part has: a multiple of four, so that a square has its corners among them."""
    return 4 * int(np.clip(np.ceil(_girth(rings) * per_metre / _FACE / 4), 4, 20))


def _cuts(rings: Float[np.ndarray, "rings around 3"], per_metre: float) -> Int[np.ndarray, "rings-1"]:
    """Into how many faces each stretch between two rings is cut, so that the largest are about as long as wide."""
    face = max(_FACE / per_metre, _girth(rings) / rings.shape[1])
    apart = np.linalg.norm(np.diff(_capped(rings), axis=0), axis=-1).max(axis=-1)
    return np.clip(np.ceil(apart / face), 1, 200).astype(int)


def _pieces(corners: Float[np.ndarray, "m 3 3"], per_metre: float) -> Float[np.ndarray, "k 4 3"]:
    """Weights of the corners of triangles for the corners of the faces, too small to show, into which each is cut."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    n = int(np.clip(np.ceil(np.quantile(edges, 0.9) * per_metre / _FACE), 1, np.sqrt(_PIECES / len(corners))))
    found = []
    for i in range(n):
        for j in range(n - i):
            a, b, c, d = ((i + k, j + m) for k, m in ((0, 0), (1, 0), (1, 1), (0, 1)))
            found += [(a, b, d, d), (b, c, d, d)] if i + j < n - 1 else [(a, b, d, d)]
    at = np.array(found) / n
    return np.concatenate([1 - at.sum(axis=-1, keepdims=True), at], axis=-1)


def _girth(rings: Float[np.ndarray, "rings around 3"]) -> float:
    """Length around the widest ring, about [m]."""
    return 2 * np.pi * float(np.max(np.linalg.norm(rings - rings.mean(axis=1, keepdims=True), axis=-1)))


def _refined(rings: Float[np.ndarray, "rings around 3"], cuts: Int[np.ndarray, "rings-1"]) -> np.ndarray:
    """Rings with more between them, from the middle of one end to the middle of the other."""
    ends = _capped(rings)
    at = np.concatenate([np.arange(n) / n + i for i, n in enumerate(cuts)] + [[len(cuts)]])
    k = np.minimum(at.astype(int), len(cuts) - 1)
    share = (at - k)[:, None, None]
    return (1 - share) * ends[k] + share * ends[k + 1]


def _capped(rings: Float[np.ndarray, "rings around 3"]) -> np.ndarray:
    """Rings whose first and last, which are there twice, are drawn together into their middles."""
    ends = rings.copy()
    ends[[0, -1]] = rings[[0, -1]].mean(axis=1, keepdims=True)
    return ends


def _lattice(step: float, reach: float) -> Float[np.ndarray, "2 n 2 2"]:
    """Pieces of a grid in a plane, half a square long, out to `reach` [m]: along its last axis, and along its first."""
    count = int(np.ceil(reach / step)) + 1
    across, along = np.meshgrid(np.arange(-count, count + 1), np.arange(-2 * count, 2 * count) / 2, indexing="ij")
    pieces = np.stack([np.stack([across, along], -1), np.stack([across, along + 0.5], -1)], axis=-2).reshape(-1, 2, 2)
    return step * np.stack([pieces, pieces[..., ::-1]])
