"""Synthetic videos of what a tracker is to find, by rays through air, glass and water: nothing of the tracker is in it.

Everything about a frame is known exactly: the motion is handed in, `Camera.sees` says where a point appears.
"""

from .clip import write_clip
from .film import Film
from .mottling import Mottling
from .optics import Camera, Lens, Port
from .paddle_scene import Bubbles, Floor, Occluder, Paddle, PaddleScene
from .shapes import Disc, Strip
from .solids import Rod
from .tank_scene import Lamps, Mirror, TankScene, Water

__all__ = [
    "Bubbles",
    "Camera",
    "Disc",
    "Film",
    "Floor",
    "Lamps",
    "Lens",
    "Mirror",
    "Mottling",
    "Occluder",
    "Paddle",
    "PaddleScene",
    "Port",
    "Rod",
    "Strip",
    "TankScene",
    "Water",
    "write_clip",
]
