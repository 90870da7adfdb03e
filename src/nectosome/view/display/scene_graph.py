"""A run on the stage: bodies, forces, path, ground, surface, waves, stream and tank, one instant after another."""

from typing import Any, NamedTuple

import numpy as np
import viser
import xarray as xr
from jaxtyping import Float, Int
from plotly.colors import hex_to_rgb
from scipy.spatial.transform import Rotation

from nectosome.description import RobotDescription
from nectosome.description.water import WaterDescription
from nectosome.view.sea import Sea

from .bodies import Arrows, RigidMesh, Slices, Soft, arrows_of, bodies_of, colours, disc_mesh, linear, slice_mesh
from .playback import Instant, Playback

_CELLS = [m * 10.0**k for k in range(-4, 4) for m in (1, 2, 5)]  # [m]
_CELL = 0.1  # in lengths of the robot, about
_SECTION, _APART = 5.0, 2.5  # between thick lines, and between dots [cells]; the first in whole steps of the second
_DOTS, _DOT = 4.0, 0.008  # how far dots reach, and how wide one is, in lengths of the robot
_PLANE, _FADES = 200.0, 12.0  # how wide planes are, and where their lines end, in lengths of the robot
_NEAR, _PAPER = np.array((150, 160, 172)), np.array((255, 255, 255))  # dots go from the one over into the other
_THIN, _THICK = (222, 227, 232), (190, 198, 206)  # lines
_WATER, _GROUND = (120, 180, 220), (196, 182, 152)
COLOURINGS = ("material", "curvature", "load of the water")
_ROOTS = ("/world", "/around", "/tank")  # parents of the moving robot, of the endless ground, of the tank
_FAR = 1.2  # of the camera, in lengths of the robot
_TALL = 0.9  # width of a picture over its height, below which the camera goes further away
_LOOKED_AT = 9  # instants that a camera takes in
_SEEN = 1e-4  # of the robot's length: what moves by less is not seen
_ARROW = 0.35  # length of the largest force, as a share of the robot's
_BEFORE = 4  # periods whose path is shown
_STREAM = 0.4  # length of the arrow of a stream, and how far it is above the body, in lengths of the robot
_REACH, _LINES = 2.0, 17  # how far the lines of waves go, in lengths of the robot, and how many along x and along y
_CORNERS = 49  # of a path at most: one takes a browser that draws by software as long as a dozen triangles
_PATH = (120, 126, 134)


class Surroundings:
    """The endless ground and surface, nodes under /around, and the tank, nodes under /tank.

    The ground lies at `height` [m] in the world, and is looked at from `first` [m]. Where the water has none there are
    dots, since lines on a plane take a browser that draws by software five times as long.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        water: WaterDescription,
        size: float,
        height: float,
        first: Float[np.ndarray, "3"],
    ):
        cell = min(_CELLS, key=lambda cell: abs(np.log(cell / (_CELL * size))))
        self.nodes: dict[str, Any] = {}
        self._first, self.spacing = first, (_APART if water.floor is water.surface is None else _SECTION) * cell
        lines = {"cell_size": cell, "section_size": _SECTION * cell}
        style = {"cell_color": _THIN, "section_color": _THICK, "fade_distance": _FADES * size, "fade_strength": 1.5}
        plane = {"width": _PLANE * size, "height": _PLANE * size} | lines | style
        if water.floor is None:
            place, colour = _dots(_APART * cell, _DOTS * size, height - first[2])
            dots = {"point_size": _DOT * size, "point_shape": "circle"}
            self.nodes["/around/ground"] = scene.add_point_cloud("/around/ground", place, colour, **dots)
        else:
            ground = {"plane_color": _GROUND, "plane_opacity": 0.35, "position": (0, 0, height - first[2])}
            self.nodes["/around/ground"] = scene.add_grid("/around/ground", **plane, **ground)
        self._sea, self._size, self._level = Sea(water), size, 0.0 if water.surface is None else water.surface
        if self._sea.waves:
            lines = {"colors": _WATER, "thickness": 1.5, "thickness_units": "screen"}
            self.nodes["/tank/waves"] = scene.add_line_segments("/tank/waves", self._waves(0.0, first), **lines)
        elif water.surface is not None:
            pane = {"plane_color": _WATER, "plane_opacity": 0.25, "position": (0, 0, water.surface - first[2])}
            pane |= {"cell_thickness": 0.0, "section_thickness": 0.0}  # what is under it is looked at through it
            self.nodes["/around/surface"] = scene.add_grid("/around/surface", **plane, **pane)
        for name, x in zip(("low", "high"), water.walls or (), strict=False):
            side = {"dimensions": (0.01 * size, 8 * size, 2 * size), "opacity": 0.3}
            box = scene.add_box(f"/tank/{name}", color=_WATER, position=(x, first[1], first[2]), **side)
            self.nodes[f"/tank/{name}"] = box

        if self._sea.streams:
            shares = {"shaft_radius": 0.008, "head_radius": 0.02, "head_length": 0.05}  # of the robot's length
            sizes: Any = {name: share * size for name, share in shares.items()}
            arrow, self._fastest = np.zeros((1, 2, 3), np.float32), 0.0
            self.nodes["/tank/stream"] = scene.add_arrows("/tank/stream", arrow, _WATER, **sizes)

    def at(self, time: float, here: Float[np.ndarray, "3"]) -> None:
        """Show waves and stream of a time [s] around a place [m]; the arrow is longest where the water is fastest."""
        if "/tank/waves" in self.nodes:
            self.nodes["/tank/waves"].points = self._waves(time, here)
        if "/tank/stream" in self.nodes:
            c = self._sea.velocity(time, here)
            self._fastest = max(self._fastest, float(np.linalg.norm(c)), np.finfo(float).tiny)
            arm = 0.5 * _STREAM * self._size / self._fastest * c
            middle = here + self._size * np.array([0.0, 0.0, _STREAM])
            self.nodes["/tank/stream"].points = _f32(np.stack([middle - arm, middle + arm])[None])

    def _waves(self, time: float, here: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 2 3"]:
        """Lines of the surface around a place, along x and along y [m]."""
        reach, step = _REACH * self._size, 2 * _REACH * self._size / (_LINES - 1)
        middle = np.round(here[:2] / step) * step
        across, along = np.linspace(-reach, reach, _LINES), np.linspace(-reach, reach, _LINES)
        x, y = np.meshgrid(across, along, indexing="ij")
        points = np.stack([middle[0] + x, middle[1] + y, np.full_like(x, self._level)], axis=-1)
        points[..., 2] += self._sea.rise(time, points)
        each = (np.stack([p[:, :-1], p[:, 1:]], axis=2).reshape(-1, 2, 3) for p in (points, points.swapaxes(0, 1)))
        return _f32(np.concatenate([*each]))

    def gone(self, here: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """By how much the ground has moved, seen from `here` [m]: upwards fully, sideways modulo its spacing."""
        path = here - self._first
        return np.array([*np.remainder(path[:2], self.spacing), path[2]])


def _dots(apart: float, reach: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Places [m] and colours of dots on a plane, so far apart; the farther the fainter."""
    n = round(reach / apart)
    x, y = (axis.ravel() for axis in np.meshgrid(apart * np.arange(-n, n + 1), apart * np.arange(-n, n + 1)))
    faint = np.hypot(x, y) / reach
    place = np.stack([x, y, np.full_like(x, height)], axis=-1)[faint < 1]
    near = (1 - faint[faint < 1, None]) ** 1.5
    return place.astype(np.float32), (near * _NEAR + (1 - near) * _PAPER).astype(np.uint8)


UNITS = {"material": "", "curvature": "1/m", "load of the water": "N/m"}
CAMERAS = {"three-quarter": (-0.7, -1.0, 0.6), "side": (0, -1, 0), "top": (0, -0.01, 1), "front": (-1, -0.01, 0)}


class Look(NamedTuple):
    """What of a run is shown, and how."""

    colouring: str = COLOURINGS[0]
    forces: bool = False
    path: bool = True
    along: bool = True  # the camera goes along with the body


class Stage:
    """The scene of one browser tab."""

    def __init__(self, scene: viser.SceneApi):
        self._scene = scene
        self._nodes: dict[str, Any] = {}
        self._look = Look()
        self._water = WaterDescription()
        self.size = 1.0  # of the robot as it is at first [m]
        self.largest = 0.0  # what the lightest colour means, in UNITS
        scene.set_up_direction("+z")
        # instead of viser's environment and shadows, which take a browser that draws by software a third of its time
        scene.configure_environment_map(None)
        scene.configure_default_lights(cast_shadow=False)
        scene.add_light_hemisphere("/light", sky_color=(255, 255, 255), ground_color=(150, 165, 180), intensity=1.6)

    def load(self, run: xr.Dataset, robot: RobotDescription | None, period: float, look: Look) -> None:
        """Put a run on the stage in place of the last one; with a period [s] it continues for ever."""
        water = WaterDescription() if robot is None else robot.water
        self.put(Playback.of(run, period), bodies_of(run, robot), arrows_of(run), water, look)

    def put(
        self,
        playback: Playback,
        bodies: dict[str, RigidMesh | Soft],
        arrows: Arrows,
        water: WaterDescription,
        look: Look,
    ) -> None:
        """Put bodies on the stage in place of the last ones. Nodes that both have are changed in place: no flicker."""
        before = (self._look, self._kinds()) if self._nodes else None
        self.playback, self._bodies, self.arrows = playback, bodies, arrows
        self._first = self.playback.place[0]
        corners = self._corners(0)
        self.size = float(np.ptp(corners, axis=0).max()) or 1.0
        self._lowest = float(corners[:, 2].min() + self._first[2])
        self._water = water
        if before != (look, self._kinds()):
            self.look(look)
            return
        self.largest = self._lightest(look)
        for name, body in self._bodies.items():
            node = self._nodes[f"/world/{name}"]
            if isinstance(body, RigidMesh) and self._is_seen(node.vertices, body.vertices):
                node.vertices = _f32(body.vertices)
        if "/world/path" in self._nodes:
            self._nodes["/world/path"].points = self._path()

    def look(self, look: Look) -> None:
        """Show the same run with another look.

        A node is replaced by the one of its name, not removed before: the browser keeps the pose of a node that is
        removed and comes back at once, and viser sends no pose that a new node has anyway.
        """
        self._look = look
        self.largest = self._lightest(look)
        before = self._nodes
        self._nodes = {root: self._scene.add_frame(root, show_axes=False) for root in _ROOTS}
        for name, body in self._bodies.items():
            self._add(f"/world/{name}", body)
        if look.path and len(self.playback.place) > 1:
            line = {"colors": _PATH, "thickness": 2.0, "thickness_units": "screen"}
            self._nodes["/world/path"] = self._scene.add_line_segments("/world/path", self._path(), **line)
        if look.forces and self.arrows.load.size:
            self._add_arrows(self.arrows)
        height = self._lowest - 0.3 * self.size if self._water.floor is None else self._water.floor
        self._around = Surroundings(self._scene, self._water, self.size, height, self._first)
        self._nodes |= self._around.nodes
        gone = before.keys() - self._nodes.keys()
        for name in gone:
            if name.rpartition("/")[0] not in gone:  # else it goes with what it sits on
                before[name].remove()

    def write(self, name: str, words: str, place: Float[np.ndarray, "3"]) -> None:
        """Write words at a place [m] in the world."""
        self._scene.add_label(f"/world/{name}", words, position=place, anchor="bottom-center")

    def at(self, time: float) -> None:
        """Show the instant at a time [s] after the start of the run."""
        self._show(self.playback.instant(time, self._look.along), self.playback.begins + time)

    def go_on(self, instant: xr.Dataset, robot: RobotDescription, path: Float[np.ndarray, "n 3"]) -> None:
        """Show the next instant of a live run, which continues a run on the stage.

        `path` [m] ends there and has as many places as that run has instants. Forces are not drawn.
        """
        self._bodies, self.playback.place = bodies_of(instant, robot), path
        self.largest = max(self.largest, self._lightest(self._look))
        if "/world/path" in self._nodes:
            self._nodes["/world/path"].points = self._path()
        here = path[-1] if self._look.along else self._first
        self._show(Instant(0, np.eye(3), np.zeros(3), here), float(instant["time"].values[-1]))

    def _show(self, instant: Instant, time: float) -> None:
        k, R, d, here = instant
        self._around.at(time, here)
        world = self._nodes["/world"]
        world.wxyz, world.position = Rotation.from_matrix(R).as_quat(scalar_first=True), d - here
        self._nodes["/around"].position, self._nodes["/tank"].position = -self._around.gone(here), -here
        for name, body in self._bodies.items():
            node = self._nodes[f"/world/{name}"]
            node.position, node.wxyz = body.place[k], body.turn[k]
            if isinstance(body, Soft):
                self._bend(f"/world/{name}", body, k)
        if "/world/forces" in self._nodes:
            node = self._nodes["/world/forces"]
            node.position, node.points = self.playback.place[k], self._arrow_points(k)

    def _bend(self, name: str, body: Soft, k: int) -> None:
        """Give a rod its shape. One that keeps it is left alone: the browser takes longer for shapes than for poses."""
        for part, slices, tint in self._batches(body, k):
            node = self._nodes[name + part]
            if self._is_seen(node.batched_positions, slices.place) or self._is_seen(node.batched_scales, slices.size):
                node.batched_positions, node.batched_wxyzs, node.batched_scales = map(_f32, slices)
            node.batched_colors = tint

    def _batches(self, body: Soft, k: int) -> list[tuple[str, Slices, Int[np.ndarray, "n 3"]]]:
        """A rod at instant k: its slices and the discs that close it, each with colours."""
        slices, values = body.slices(k), body.shown(self._look.colouring)
        material = np.tile(np.array(hex_to_rgb(body.colour), np.uint8), (len(slices.place), 1))
        tint = linear(material if values is None else colours(values[k], self.largest))
        return [("", slices, tint), ("/ends", slices.ends, tint[[0, -1]])]

    def _is_seen(self, was: np.ndarray, now: np.ndarray) -> bool:
        """Whether the change of places or sizes [m] can be seen."""
        return bool(np.abs(now - was).max() > _SEEN * self.size)

    def camera(self, name: str, aspect: float = 1.0) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Place of a camera of CAMERAS from which all instants are seen, and the point that it looks at [m].

        `aspect` is the width of its pictures over their height.
        """
        corners = self.corners()
        size, direction = float(np.ptp(corners, axis=0).max()) or 1.0, np.array(CAMERAS[name], dtype=float)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        away = _FAR * size * max(1.0, _TALL / aspect)
        return middle + away * direction / np.linalg.norm(direction), middle

    def corners(self) -> Float[np.ndarray, "n 3"]:
        """Corners of all bodies at several instants, in the frame that goes along [m]."""
        instants = np.linspace(0, self._instants - 1, _LOOKED_AT).round().astype(int)
        return np.concatenate([self._corners(k) for k in np.unique(instants)])

    @property
    def _instants(self) -> int:
        """At how many instants bodies are known, the last ones of the playback; at one only of a live run."""
        return min((len(body.place) for body in self._bodies.values()), default=len(self.playback.place))

    def _corners(self, k: int) -> Float[np.ndarray, "n 3"]:
        """Corners of all bodies at instant k, in the frame that goes along [m]."""
        here = self.playback.place[k - self._instants]
        corners = [body.corners(k) for body in self._bodies.values()] or [here[None]]
        return np.concatenate(corners) - here

    def _kinds(self) -> list[tuple[str, int, int]]:
        """What nodes depend on: names, numbers of corners or slices, how many arrows and instants on the path."""
        parts = [
            (name, -1, len(body.vertices)) if isinstance(body, RigidMesh) else (name, 1, len(body.x))
            for name, body in self._bodies.items()
        ]
        return [*parts, ("", len(self.arrows.load), len(self.playback.place))]

    def _lightest(self, look: Look) -> float:
        shown = [body.shown(look.colouring) for body in self._bodies.values() if isinstance(body, Soft)]
        return max((float(values.max()) for values in shown if values is not None), default=0.0)

    def _path(self) -> Float[np.ndarray, "n 2 3"]:
        path = self.playback.path(_BEFORE)
        path = path[np.linspace(0, len(path) - 1, min(len(path), _CORNERS)).round().astype(int)]
        return _f32(np.stack([path[:-1], path[1:]], axis=1))

    def _add(self, name: str, body: RigidMesh | Soft) -> None:
        if isinstance(body, RigidMesh):
            mesh = {"color": hex_to_rgb(body.colour), "flat_shading": body.flat}
            place = {"position": body.place[0], "wxyz": body.turn[0]}
            self._nodes[name] = self._scene.add_mesh_simple(name, _f32(body.vertices), body.faces, **mesh, **place)
            return
        for part, slices, tint in self._batches(body, 0):
            place, turn, size = map(_f32, slices)
            vertices, faces = disc_mesh() if part else slice_mesh()
            style: Any = {"lod": "off", "side": "double" if part or body.stepped else "front"}
            self._nodes[name + part] = self._scene.add_batched_meshes_simple(
                name + part, _f32(vertices), faces, turn, place, batched_scales=size, batched_colors=tint, **style
            )
        self._nodes[name].position, self._nodes[name].wxyz = body.place[0], body.turn[0]

    def _add_arrows(self, arrows: Arrows) -> None:
        each = linear(np.array([hex_to_rgb(arrows.colours[i]) for i in arrows.load], np.uint8))
        shares = {"shaft_radius": 0.006, "head_radius": 0.015, "head_length": 0.04}  # of the robot's length
        sizes: Any = {name: share * self.size for name, share in shares.items()}
        self._nodes["/world/forces"] = self._scene.add_arrows("/world/forces", self._arrow_points(0), each, **sizes)

    def _arrow_points(self, k: int) -> Float[np.ndarray, "n 2 3"]:
        """From the body's place: the browser draws where a node is sooner than what is in it."""
        per_newton = _ARROW * self.size / np.linalg.norm(self.arrows.force, axis=-1).max()
        root = self.arrows.root[k] - self.playback.place[k]
        return _f32(np.stack([root, root + per_newton * self.arrows.force[k]], axis=1))


def _f32(x: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(x, dtype=np.float32)
