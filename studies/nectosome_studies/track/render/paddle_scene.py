"""A paddle of stiff layers and soft joints in a tank, filmed from above."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, UInt8

from .boxes import PixelBox, apart
from .film import Colour, Film, Mottling, Plate
from .optics import RenderCamera
from .plane import Disc, FlatShape, Point, RenderPlane, Strip, pixel_centres

Ends = Callable[[Float[np.ndarray, "k"]], Float[np.ndarray, "k segments 2 2"]]


@dataclass(frozen=True)
class Paddle:
    """How a paddle looks from above: each layer a rectangle from its start to its end, soft joints between them."""

    colours: Sequence[Colour]  # of the layers from the root on; of one: of all
    thickness: float  # of the layers, across [m]
    joint: Colour = (105.0, 105.0, 100.0)
    joint_share: float = 0.5  # of the thickness, how thick the joints are
    horn: Point | None = None  # centre of the servo's horn, a disc with an arm to the first layer [m]
    horn_radius: float = 0.012  # [m]
    horn_colour: Colour = (45.0, 45.0, 48.0)

    def shapes(self, ends: Float[np.ndarray, "segments 2 2"]) -> list[FlatShape]:
        """Joints, layers over them, horn on top."""
        points: list[list[Point]] = [[(float(x), float(y)) for x, y in layer] for layer in ends]
        colours = list(self.colours) * (len(points) if len(self.colours) == 1 else 1)
        if len(colours) != len(points):
            raise ValueError(f"Paddle.colours has {len(colours)} for {len(points)} layers; give one for each, or one.")
        thin = self.joint_share * self.thickness
        joints = [Strip(a[1], b[0], thin, self.joint) for a, b in pairwise(points)]
        layers = [Strip(a, b, self.thickness, colour) for (a, b), colour in zip(points, colours, strict=True)]
        if self.horn is None:
            return [*joints, *layers]
        arm = Strip(self.horn, points[0][0], 0.8 * self.horn_radius, self.horn_colour)
        return [*joints, *layers, arm, Disc(self.horn, self.horn_radius, self.horn_colour)]


@dataclass(frozen=True)
class Floor:
    """The tank's floor, mottled."""

    z: float  # [m]
    colour: Colour = (96.0, 112.0, 118.0)
    contrast: float = 0.08  # relative standard deviation of its light
    mottling: Mottling = Mottling()  # over x and y [m]


@dataclass(frozen=True)
class Occluder:
    """An opaque bar over the paddle, in the plane of the paddle's top."""

    bar: Strip
    during: tuple[float, float] | None = None  # frames of these times have it, the last not [s]; None: all

    def shown(self, t: float) -> bool:
        """Whether the frame of a time [s] has it."""
        return self.during is None or self.during[0] <= t < self.during[1]


@dataclass(frozen=True)
class Bubbles:
    """Bright discs that drift through the picture, over the paddle, straight on and each at its own speed."""

    count: int
    radius: float = 0.004  # [m], of the largest; the smallest are half of it
    speed: float = 0.05  # [m/s], of the fastest
    colour: Colour = (225.0, 232.0, 235.0)
    seed: int = 0

    def shapes(self, t: float, low: Float[np.ndarray, "2"], high: Float[np.ndarray, "2"]) -> list[FlatShape]:
        """At a time [s], in a region of x and y [m]; what leaves it on one side comes back on the other."""
        chance = np.random.default_rng(self.seed)
        start, heading = chance.uniform(0, 1, (self.count, 2)), chance.uniform(0, 2 * np.pi, self.count)
        radius, speed = chance.uniform(0.5, 1, (2, self.count))
        radius = self.radius * radius
        low, high = low - self.radius, high + self.radius  # out of sight
        shift = self.speed * t * speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        at = low + (start * (high - low) + shift) % (high - low)
        return [Disc((float(x), float(y)), float(r), self.colour) for (x, y), r in zip(at, radius, strict=True)]


class PaddleScene:
    """A paddle that moves in a horizontal plane over a tank's floor, seen by a fixed camera.

    What is drawn of it is its outline in that plane: neither its sides nor shadows.
    """

    def __init__(
        self,
        camera: RenderCamera,
        film: Film,
        ends: Ends,
        paddle: Paddle,
        floor: Floor,
        z: float = 0.0,
        occluder: Occluder | None = None,
        bubbles: Bubbles | None = None,
        parts: int = 8,
    ):
        """`ends` gives x and y [m] of the start and end of each layer over times [s], in the plane at the height z."""
        self.camera, self.film, self.ends, self.paddle = camera, film, ends, paddle
        self.plane = RenderPlane(camera, z, parts)
        self.bubbles, self.occluder = bubbles, occluder
        self._low, self._high = (f(self.plane.centres, axis=(0, 1)) for f in (np.nanmin, np.nanmax))
        # the mottling is smooth over a pixel: one ray through its centre does
        relative = 1 + floor.contrast * np.nan_to_num(floor.mottling(pixel_centres(camera, floor.z).reshape(-1, 2)))
        light = np.maximum(relative, 0)[:, None] * np.asarray(floor.colour)
        self._floor = light.reshape(camera.size[1], camera.size[0], 3).astype(np.float32)
        bars: list[FlatShape] = [] if occluder is None else [occluder.bar]
        self._bar = list(zip(bars, self.plane.boxes(bars), strict=True))
        self._plates: dict[bool, Plate] = {}

    def _plate(self, barred: bool) -> Plate:
        """The scene at rest, without the bar and with it."""
        if barred not in self._plates:
            whole = PixelBox(0, self._floor.shape[0], 0, self._floor.shape[1])
            light = self.plane.painted(self._floor, whole, self._bar) if barred else self._floor
            self._plates[barred] = Plate(self.film, light)
        return self._plates[barred]

    def frame(self, t: float) -> UInt8[np.ndarray, "h w 3"]:
        """The picture, red, green and blue, whose exposure time has its middle at a time [s]."""
        barred = self.occluder is not None and self.occluder.shown(t)
        instants = self.film.exposure(t)
        scenes = self._placed(instants, self.ends(instants))
        boxes = apart((box for scene in scenes for _, box in scene), 2 * self.film.reach)
        over = self._bar if barred else []
        changes = []
        for box in boxes:
            ground = self._floor[box.slices]
            light = sum(self.plane.painted(ground, box, [*scene, *over]) for scene in scenes)
            changes.append((box, light / len(scenes)))
        return self._plate(barred).exposed(t, changes)

    def _placed(
        self, instants: Float[np.ndarray, "k"], ends: Float[np.ndarray, "k segments 2 2"]
    ) -> list[list[tuple[FlatShape, PixelBox]]]:
        """What moves at each instant, from below upwards, and the pixels it may touch."""
        scenes = [self.paddle.shapes(e) for e in ends]
        if self.bubbles is not None:
            for scene, t in zip(scenes, instants, strict=True):
                scene += self.bubbles.shapes(t, self._low, self._high)
        boxes = iter(self.plane.boxes([shape for scene in scenes for shape in scene]))
        return [[(shape, next(boxes)) for shape in scene] for scene in scenes]
