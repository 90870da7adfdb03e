"""Synthetic videos of what a tracker is to find, by rays through air, glass and water: nothing of the tracker is in it.

Everything about a frame is known exactly: the motion is handed in, `Camera.sees` says where a point appears.
"""

from .clip import write_clip
from .film import Film
from .mottling import Mottling
from .optics import Port, RenderCamera, RenderLens
from .paddle_scene import Bubbles, Floor, Occluder, Paddle, PaddleScene
from .shapes import Disc, Strip
from .solids import RodSolid
from .tank_scene import Lamps, TankScene, TankWater, WaterMirror

__all__ = [
    "Bubbles",
    "Disc",
    "Film",
    "Floor",
    "Lamps",
    "Mottling",
    "Occluder",
    "Paddle",
    "PaddleScene",
    "Port",
    "RenderCamera",
    "RenderLens",
    "RodSolid",
    "Strip",
    "TankScene",
    "TankWater",
    "WaterMirror",
    "write_clip",
]
