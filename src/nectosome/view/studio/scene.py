"""A run on the stage: bodies, forces, way, ground, surface and tank, at one moment after another."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from nectosome.io import RobotDescription
from nectosome.io.description import WaterDescription

from .bodies import MATERIAL, Arrows, Rigid, Soft, arrows_of, bodies_of, colours, rgb, slice_mesh
from .course import Course, Moment

if TYPE_CHECKING:
    import viser
    import xarray as xr

COLOURINGS = ("material", "curvature", "load of the water")
UNITS = {"material": "", "curvature": "1/m", "load of the water": "N/m"}
CAMERAS = {"three-quarter": (-0.7, -1.0, 0.6), "side": (0, -1, 0), "top": (0, -0.01, 1), "front": (-1, -0.01, 0)}
_ROOTS = ("/world", "/around", "/tank")  # of what moves with the run, of the endless ground, of what stands still
_FAR = 1.2  # of the camera, in lengths of the robot
_SEEN = 1e-4  # of the robot's length: what moves by less is not seen
_ARROW = 0.35  # length of the largest force, as a share of the robot's
_BEFORE = 4  # periods whose way is shown
_LARGE = 200.0  # of grids, in lengths of the robot
_CELL, _SECTION = (222, 227, 232), (190, 198, 206)
_WATER, _GROUND, _WAY = (120, 180, 220), (196, 182, 152), (120, 126, 134)
_STEPS = [m * 10.0**k for k in range(-4, 4) for m in (1, 2, 5)]  # of the grid [m]


class Look(NamedTuple):
    """What of a run is shown, and how."""

    colouring: str = COLOURINGS[0]
    forces: bool = False
    way: bool = True
    along: bool = True  # the observer goes along with the body


class Stage:
    """The scene of one browser tab."""

    def __init__(self, scene: "viser.SceneApi"):
        self._scene = scene
        self._nodes: dict[str, Any] = {}
        self._look = Look()
        self._water = WaterDescription()
        self.size, self.middle = 1.0, np.zeros(3)  # of the robot [m], seen from its body at first
        self.largest = 0.0  # what the lightest colour means, in UNITS
        scene.set_up_direction("+z")
        # instead of viser's environment and shadows, which take a browser that draws by software a third of its time
        scene.configure_environment_map(None)
        scene.configure_default_lights(cast_shadow=False)
        scene.add_light_hemisphere("/light", sky_color=(255, 255, 255), ground_color=(150, 165, 180), intensity=1.6)

    def load(self, run: "xr.Dataset", robot: RobotDescription, period: float, look: Look) -> None:
        """Put a run on the stage in place of the last one; with a period [s] it goes on for ever.

        What the last one has as well is changed in place, so that nothing flickers.
        """
        before = (self._look, self._kinds()) if self._nodes else None
        self.course, self._bodies, self.arrows = Course(run, period), bodies_of(run, robot), arrows_of(run)
        corners = np.concatenate([_corners(body) for body in self._bodies.values()] or [self.course.place[:1]])
        self._first = self.course.place[0]
        self.size = float(np.ptp(corners, axis=0).max()) or 1.0
        self.middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0)) - self.course.place[0]
        self._lowest = float(corners[:, 2].min())
        self._water = robot.water
        if before != (look, self._kinds()):
            self.look(look)
            return
        self.largest = self._lightest(look)
        for name, body in self._bodies.items():
            if isinstance(body, Rigid):
                self._nodes[f"/world/{name}"].vertices = _f32(body.vertices)
        if "/world/way" in self._nodes:
            self._nodes["/world/way"].points = self._way()

    def look(self, look: Look) -> None:
        """Show the same run in another way."""
        self._look = look
        self.largest = self._lightest(look)
        for root in _ROOTS:
            if root in self._nodes:
                self._nodes[root].remove()
        self._nodes = {root: self._scene.add_frame(root, show_axes=False) for root in _ROOTS}
        for name, body in self._bodies.items():
            self._add(f"/world/{name}", body)
        if look.way and len(self.course.place) > 1:
            line = {"colors": _WAY, "thickness": 2.0, "thickness_units": "screen"}
            self._nodes["/world/way"] = self._scene.add_line_segments("/world/way", self._way(), **line)
        if look.forces and self.arrows.load.size:
            self._add_arrows(self.arrows)
        self._add_surroundings()

    def at(self, time: float) -> None:
        """Show the moment at a time [s] after the start of the run."""
        self._put(self.course.moment(time, self._look.along))

    def go_on(self, moment: "xr.Dataset", robot: RobotDescription, way: Float[np.ndarray, "n 3"]) -> None:
        """Show one moment more of what goes on from a run on the stage.

        `way` [m] ends there and has as many places as that run has moments. Forces are not drawn.
        """
        self._bodies, self.course.place = bodies_of(moment, robot), way
        self.largest = max(self.largest, self._lightest(self._look))
        if "/world/way" in self._nodes:
            self._nodes["/world/way"].points = self._way()
        self._put(Moment(0, np.eye(3), np.zeros(3), way[-1] if self._look.along else self._first))

    def _put(self, moment: Moment) -> None:
        k, R, d, here = moment
        world = self._nodes["/world"]
        world.wxyz, world.position = Rotation.from_matrix(R).as_quat(scalar_first=True), d - here
        self._nodes["/around"].position, self._nodes["/tank"].position = -self._whole_steps(here), -here
        for name, body in self._bodies.items():
            node = self._nodes[f"/world/{name}"]
            node.position, node.wxyz = body.place[k], body.turn[k]
            if isinstance(body, Soft):
                self._bend(node, body, k)
        if "/world/forces" in self._nodes:
            self._nodes["/world/forces"].points = self._arrow_points(k)

    def _bend(self, node: Any, body: Soft, k: int) -> None:
        """Give a rod its shape. One that keeps it is left alone: the browser takes longer for shapes than for poses."""
        place, turn, size = map(_f32, body.slices(k))
        if (
            max(np.abs(node.batched_positions - place).max(), np.abs(node.batched_scales - size).max())
            > _SEEN * self.size
        ):
            node.batched_positions, node.batched_wxyzs, node.batched_scales = place, turn, size
        values = body.shown(self._look.colouring)
        if values is not None:
            tinted = colours(values[k], self.largest)
            if not np.array_equal(node.batched_colors, tinted):
                node.batched_colors = tinted

    def camera(self, name: str) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Place of a camera of CAMERAS, and what it looks at [m]."""
        way = np.array(CAMERAS[name], dtype=float)
        return self.middle + _FAR * self.size * way / np.linalg.norm(way), self.middle

    def _kinds(self) -> list[tuple[str, int, int]]:
        """What nodes depend on: names, numbers of corners or slices, how many arrows and moments on the way."""
        parts = [
            (name, -1, len(body.vertices)) if isinstance(body, Rigid) else (name, 1, len(body.x))
            for name, body in self._bodies.items()
        ]
        return [*parts, ("", len(self.arrows.load), len(self.course.place))]

    def _lightest(self, look: Look) -> float:
        shown = [body.shown(look.colouring) for body in self._bodies.values() if isinstance(body, Soft)]
        return max((float(values.max()) for values in shown if values is not None), default=0.0)

    def _way(self) -> Float[np.ndarray, "n 2 3"]:
        way = self.course.way(_BEFORE)
        return _f32(np.stack([way[:-1], way[1:]], axis=1))

    def _add(self, name: str, body: Rigid | Soft) -> None:
        if isinstance(body, Rigid):
            mesh = {"color": rgb(body.colour), "side": "double"}
            place = {"position": body.place[0], "wxyz": body.turn[0]}
            self._nodes[name] = self._scene.add_mesh_simple(name, _f32(body.vertices), body.faces, **mesh, **place)
            return
        vertices, faces = slice_mesh()
        place, turn, size = map(_f32, body.slices(0))
        values = body.shown(self._look.colouring)
        one = np.tile(np.array(MATERIAL, np.uint8), (len(place), 1))
        colour = one if values is None else colours(values[0], self.largest)
        batch = {"batched_scales": size, "batched_colors": colour}
        style = {"lod": "off", "side": "double", "position": body.place[0], "wxyz": body.turn[0]}
        self._nodes[name] = self._scene.add_batched_meshes_simple(
            name, _f32(vertices), faces, turn, place, **batch, **style
        )

    def _add_arrows(self, arrows: Arrows) -> None:
        each = np.array([rgb(arrows.colours[i]) for i in arrows.load], np.uint8)
        self._nodes["/world/forces"] = self._scene.add_arrows(
            "/world/forces",
            self._arrow_points(0),
            each,
            shaft_radius=0.006 * self.size,
            head_radius=0.015 * self.size,
            head_length=0.04 * self.size,
        )

    def _arrow_points(self, k: int) -> Float[np.ndarray, "n 2 3"]:
        per_newton = _ARROW * self.size / np.linalg.norm(self.arrows.force, axis=-1).max()
        root = self.arrows.root[k]
        return _f32(np.stack([root, root + per_newton * self.arrows.force[k]], axis=1))

    def _add_surroundings(self) -> None:
        """Ground, surface and ends of the tank, as far as the robot's water has them; else a grid under the robot."""
        water, first = self._water, self._first
        floor = water.floor
        height = (self._lowest - 0.3 * self.size if floor is None else floor) - first[2]
        wide = {"width": _LARGE * self.size, "height": _LARGE * self.size}
        cell = self._cell()
        lines = {"cell_size": cell, "section_size": 5 * cell, "cell_color": _CELL, "section_color": _SECTION}
        fade = {"fade_distance": 12 * self.size, "fade_strength": 1.5}
        ground = {} if floor is None else {"plane_color": _GROUND, "plane_opacity": 0.35}
        self._scene.add_grid("/around/ground", position=(0, 0, height), **wide, **lines, **fade, **ground)
        if water.surface is not None:
            pane = {"plane_color": _WATER, "plane_opacity": 0.25, "position": (0, 0, water.surface - first[2])}
            self._scene.add_grid("/around/surface", **wide, **lines, **fade, **pane)
        for name, x in zip(("low", "high"), water.walls or (), strict=False):
            side = {"dimensions": (0.01 * self.size, 8 * self.size, 2 * self.size), "opacity": 0.3}
            self._scene.add_box(f"/tank/{name}", color=_WATER, position=(x, first[1], first[2]), **side)

    def _cell(self) -> float:
        return min(_STEPS, key=lambda step: abs(np.log(step / (0.1 * self.size))))

    def _whole_steps(self, here: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """How far the ground has come by: all of the way up, the rest of five cells, after which it looks the same."""
        gone = here - self._first
        return np.array([*np.remainder(gone[:2], 5 * self._cell()), gone[2]])


def _corners(body: Rigid | Soft) -> Float[np.ndarray, "n 3"]:
    """Ends of a body at the first moment [m]."""
    own = body.vertices if isinstance(body, Rigid) else body.slices(0).place
    R = Rotation.from_quat(body.turn[0], scalar_first=True).as_matrix()
    return own @ R.T + body.place[0]


def _f32(x: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(x, dtype=np.float32)
