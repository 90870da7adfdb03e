"""LED markers in dark water, filmed through a port."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.ndimage import maximum_filter, minimum_filter

from .boxes import PixelBox, apart, around, split
from .film import Colour, Film, Mottling, Plate
from .optics import RenderCamera, Vector

_ROWS = 64  # of pixels traced at a time
_SMALL = 4.0  # [px]: what is no larger is traced by all parts of its pixels, since no pixel's centre need be in it

Markers = Callable[[Float[np.ndarray, "k"]], Float[np.ndarray, "k m 3"]]


@dataclass(frozen=True)
class Ball:
    """A sphere that glows."""

    centre: Float[np.ndarray, "3"]  # [m]
    radius: float  # [m]
    colour: Colour

    def spine(self) -> Float[np.ndarray, "n 3"]:
        """Points [m] about which balls of its radius are about the solid: its centre."""
        return self.centre[None]

    def met(self, origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """How far along unit rays it is met [m], else infinite: the nearer root of |o + t d - c|^2 = r^2."""
        away = self.centre - origins
        along = np.einsum("ij,ij->i", away, rays)
        return _entered(along, away - along[:, None] * rays, self.radius)


@dataclass(frozen=True)
class RodSolid:
    """An opaque round rod with round ends."""

    start: Vector  # [m]
    end: Vector
    radius: float  # [m]
    colour: Colour = (3.0, 5.0, 6.0)

    def spine(self) -> Float[np.ndarray, "n 3"]:
        """Points [m] about which balls of its radius are about the solid, closely enough for a curved image of it."""
        return np.linspace(self.start, self.end, 17)

    def met(self, origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """How far along unit rays it is met [m], infinite where it is missed; exact in what is hidden.

        At the ray's point closest to the axis, less half the chord there of a ball. The ray is closest to the line of
        the axis at s = (w.u - (d.u)(w.d)) / (1 - (d.u)^2) from the start, with w from there to the ray's origin, and to
        the axis itself at s held to its ends.
        """
        axis = np.subtract(self.end, self.start)
        length = float(np.linalg.norm(axis))
        u = axis / length
        w = origins - np.asarray(self.start)
        wu, wd, du = w @ u, np.einsum("ij,ij->i", w, rays), rays @ u
        s = np.clip((wu - du * wd) / np.maximum(1 - du**2, 1e-12), 0, length)
        along = s * du - wd
        return _entered(along, w + along[:, None] * rays - s[:, None] * u, self.radius)


def _entered(along: Float[np.ndarray, "n"], aside: Float[np.ndarray, "n 3"], radius: float) -> Float[np.ndarray, "n"]:
    """How far along rays they enter balls [m], `aside` of whose centres they pass after `along`; else infinite."""
    under = radius**2 - np.einsum("ij,ij->i", aside, aside)
    with np.errstate(invalid="ignore"):
        return np.where((under > 0) & (along > 0), along - np.sqrt(np.maximum(under, 0)), np.inf)


Solid = Ball | RodSolid


class Placed(NamedTuple):
    """A solid, the pixels it may touch, and about how thin it is in the image [px]."""

    solid: Solid
    box: PixelBox
    thin: float


@dataclass(frozen=True)
class TankWater:
    """Dark water: a faint haze of light scattered back."""

    haze: Colour = (6.0, 14.0, 18.0)
    contrast: float = 0.3  # relative standard deviation of the haze
    mottling: Mottling = Mottling(0.5, 2.0, 8)  # over the image, whose width is 1


@dataclass(frozen=True)
class Lamps:
    """Glowing balls: their radius [m] and their colours, one for each or one for all."""

    radius: float
    colours: Sequence[Colour]

    def balls(self, centres: Float[np.ndarray, "m 3"]) -> list[Ball]:
        """At places [m]."""
        colours = list(self.colours) * (len(centres) if len(self.colours) == 1 else 1)
        if len(colours) != len(centres):
            raise ValueError(f"Lamps.colours has {len(colours)} for {len(centres)} markers; give one for each, or one.")
        return [Ball(c, self.radius, x) for c, x in zip(centres, colours, strict=True)]


class TankScene:
    """Markers that move and markers at rest, seen by one camera; other cameras see the same by scenes of their own.

    Rays are traced against all that is near, the nearest hides the others. A halo is the film's `veil`.
    """

    def __init__(
        self,
        camera: RenderCamera,
        film: Film,
        markers: Markers,
        lamps: Lamps,
        still: Float[np.ndarray, "n 3"] | None = None,
        still_lamps: Lamps | None = None,
        water: TankWater | None = None,
        bar: RodSolid | None = None,
        parts: int = 8,
    ):
        """`markers` gives centres [m] of those that move over times [s]; `still` are those at rest.

        `parts` n: where an edge may cross a pixel it is traced by n x n rays. With 8, the centre of light of a marker
        of 3 px radius is right to a standard error of 0.006 px, of 1.5 px to 0.012 px.
        """
        self.camera, self.film, self.markers, self.lamps = camera, film, markers, lamps
        self.water, self.parts = water or TankWater(), parts
        rest: list[Solid] = [] if bar is None else [bar]
        if still is not None:
            rest = [*(still_lamps or lamps).balls(np.asarray(still, float)), *rest]
        self._rest = self._placed(rest)
        self._dark = self._haze()
        self._plate = Plate(film, self._at_rest())

    def frame(self, t: float) -> UInt8[np.ndarray, "h w 3"]:
        """The picture, red, green and blue, whose exposure time has its middle at a time [s]."""
        instants = self.film.exposure(t)
        moving = [self.lamps.balls(at) for at in self.markers(instants)]
        placed = self._placed([ball for balls in moving for ball in balls])
        scenes = [placed[k : k + len(moving[0])] for k in range(0, len(placed), max(len(moving[0]), 1))]
        boxes = apart((box for scene in scenes for _, box, _ in scene), 2 * self.film.reach)
        return self._plate.exposed(t, [(box, self._traced(box, scenes)) for box in boxes])

    def _placed(self, solids: Sequence[Solid]) -> list[Placed]:
        """With the pixels they may touch, and about how thin they are in the image [px]."""
        if not solids:
            return []
        spines = [solid.spine() for solid in solids]
        # the silhouette is a circle of points about each that lie across the line of sight: these six are around it
        six = 1.25 * np.concatenate([np.zeros((1, 3)), self.camera.axes, -self.camera.axes])
        around_all = [at[:, None] + s.radius * six for s, at in zip(solids, spines, strict=True)]
        points = np.concatenate(around_all).reshape(-1, 3)
        pixels = np.split(self.camera.project(points), np.cumsum([7 * len(at) for at in spines])[:-1])
        placed = []
        for solid, of_one in zip(solids, pixels, strict=True):
            sevens = of_one.reshape(-1, 7, 2)
            wide = np.linalg.norm(sevens[:, 1:] - sevens[:, :1], axis=-1).max(axis=1)
            thin = float(np.min(wide, where=np.isfinite(wide), initial=np.inf))
            placed.append(Placed(solid, around(of_one, 2.0, self.camera.size), thin))
        return placed

    def _haze(self) -> Float[np.ndarray, "h w 3"]:
        width, height = self.camera.size
        shade = self.water.mottling(PixelBox(0, height, 0, width).pixels / width).reshape(height, width, 1)
        return (np.maximum(1 + self.water.contrast * shade, 0) * np.asarray(self.water.haze)).astype(np.float32)

    def _at_rest(self) -> Float[np.ndarray, "h w 3"]:
        light = self._dark.copy()
        for box in apart((box for _, box, _ in self._rest), 0):
            for top in range(box.top, box.bottom, _ROWS):
                strip = box._replace(top=top, bottom=min(top + _ROWS, box.bottom))
                light[strip.slices] = self._traced(strip, [[]])
        return light

    def _traced(self, box: PixelBox, scenes: Sequence[Sequence[Placed]]) -> Float[np.ndarray, "a b 3"]:
        """Mean light of a box over instants, each with what moves; what is at rest is added."""
        wide = box.grown(2, self.camera.size)  # edges are found by what is seen two pixels on
        near = [[s for s in (*self._rest, *scene) if not s[1].cut(wide).empty] for scene in scenes]
        dark = self._dark[wide.slices].reshape(-1, 3)
        pixels = wide.pixels
        rays = self.camera.rays(pixels)
        seen = [_first(solids, *rays) for solids in near]
        light = np.mean([_light(solids, label, dark) for solids, label in zip(near, seen, strict=True)], axis=0)
        # where there is an edge at one instant, all instants take the same rays
        edge = np.any([_edges(wide, solids, label) for solids, label in zip(near, seen, strict=True)], axis=0)
        if edge.any():
            n2 = self.parts**2
            fine = self.camera.rays(split(pixels[edge], self.parts).reshape(-1, 2))
            behind = np.repeat(dark[edge], n2, axis=0)
            total = sum(_light(solids, _first(solids, *fine), behind) for solids in near)
            light[edge] = np.reshape(total, (-1, n2, 3)).mean(axis=1) / len(near)
        return light.reshape(*wide.shape, 3)[box.inside(wide)]


def _first(
    solids: Sequence[Placed], origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"]
) -> Int[np.ndarray, "n"]:
    """Number from 1 on of the solid that each ray meets first, 0 of none."""
    label, far = np.zeros(len(rays), int), np.full(len(rays), np.inf)
    for k, (solid, _, _) in enumerate(solids, 1):
        away = solid.met(origins, rays)
        nearer = away < far
        label[nearer], far[nearer] = k, away[nearer]
    return label


def _light(
    solids: Sequence[Placed], label: Int[np.ndarray, "n"], dark: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """Light of each ray: of the solid that it meets, or else of the dark."""
    table = np.array([(0.0, 0.0, 0.0), *(solid.colour for solid, _, _ in solids)], np.float32)
    return np.where(label[:, None] > 0, table[label], dark)


def _edges(box: PixelBox, solids: Sequence[Placed], label: Int[np.ndarray, "n"]) -> Bool[np.ndarray, "n"]:
    """Pixels that an edge may cross: where two pixels on, something else is seen, and all about what is small."""
    image = label.reshape(box.shape)
    edge = maximum_filter(image, 5, mode="nearest") != minimum_filter(image, 5, mode="nearest")
    for _, touched, thin in solids:
        if thin < _SMALL:
            edge[touched.cut(box).inside(box)] = True
    return edge.ravel()
