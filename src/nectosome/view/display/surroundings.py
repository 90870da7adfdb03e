"""What is around a robot on the stage: dots or a ground under it, the surface over it, the ends of its tank."""

from typing import Any

import numpy as np
import viser
from jaxtyping import Float

from nectosome.description.robot import WaterDescription

_CELLS = [m * 10.0**k for k in range(-4, 4) for m in (1, 2, 5)]  # [m]
_CELL = 0.1  # in lengths of the robot, about
_SECTION, _APART = 5.0, 2.5  # between thick lines, and between dots [cells]; the first in whole steps of the second
_DOTS, _DOT = 4.0, 0.008  # how far dots reach, and how wide one is, in lengths of the robot
_PLANE, _FADES = 200.0, 12.0  # how wide planes are, and where their lines end, in lengths of the robot
_NEAR, _PAPER = np.array((150, 160, 172)), np.array((255, 255, 255))  # dots go from the one over into the other
_THIN, _THICK = (222, 227, 232), (190, 198, 206)  # lines
_WATER, _GROUND = (120, 180, 220), (196, 182, 152)


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
        if water.surface is not None:
            pane = {"plane_color": _WATER, "plane_opacity": 0.25, "position": (0, 0, water.surface - first[2])}
            pane |= {"cell_thickness": 0.0, "section_thickness": 0.0}  # what is under it is looked at through it
            self.nodes["/around/surface"] = scene.add_grid("/around/surface", **plane, **pane)
        for name, x in zip(("low", "high"), water.walls or (), strict=False):
            side = {"dimensions": (0.01 * size, 8 * size, 2 * size), "opacity": 0.3}
            box = scene.add_box(f"/tank/{name}", color=_WATER, position=(x, first[1], first[2]), **side)
            self.nodes[f"/tank/{name}"] = box

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
