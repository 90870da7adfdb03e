"""Synthetic videos for the tracker, by rays through air, glass and water, with no code of the tracker in it.

Everything about a frame is known exactly: the motion is an input, `RenderCamera.sees` says where a point appears.
"""

from .clip import write_clip
from .film import Film
from .optics import Port, RenderCamera, RenderLens
from .paddle_scene import Bubbles, Floor, Occluder, Paddle, PaddleScene
from .plane import Strip
from .tank_scene import Lamps, RodSolid, TankScene, TankWater

__all__ = [
    "Bubbles",
    "Film",
    "Floor",
    "Lamps",
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
    "write_clip",
]
