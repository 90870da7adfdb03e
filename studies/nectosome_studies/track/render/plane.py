"""Flat opaque shapes in a horizontal plane, painted by the rays of a camera that meet the plane."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from .boxes import PixelBox, around, split
from .film import Colour
from .optics import RenderCamera

_ROWS = 64  # of pixels traced at a time, so that memory does not grow with the image

Point = tuple[float, float]  # x, y in the world [m]


@dataclass(frozen=True)
class Strip:
    """A rectangle along the line from its start to its end."""

    start: Point
    end: Point
    width: float  # [m]
    colour: Colour

    def outline(self) -> Float[np.ndarray, "n 2"]:
        """Points along both long sides, close enough for the curves that a lens makes of them [m]."""
        (x0, y0), along, _ = self._frame()
        steps = np.linspace(0, 1, 9)[:, None]
        line = [x0, y0] + steps * (np.asarray(self.end) - self.start)
        aside = 0.5 * self.width * np.array([-along[1], along[0]])
        return np.concatenate([line + aside, line - aside])

    def beyond(self, x: Float[np.ndarray, "..."], y: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """How far outside the edge points lie, below 0 inside [m]: max(|s - L/2| - L/2, |n| - W/2), s along, n across.

        Beside a corner it is less than the distance.
        """
        (x0, y0), (c, s), length = self._frame()
        x, y = x - x0, y - y0
        return np.maximum(np.abs(c * x + s * y - 0.5 * length) - 0.5 * length, np.abs(c * y - s * x) - 0.5 * self.width)

    def _frame(self) -> tuple[Point, Float[np.ndarray, "2"], float]:
        along = np.asarray(self.end, float) - self.start
        length = float(np.hypot(*along))
        return self.start, along / length if length else np.array([1.0, 0.0]), length


@dataclass(frozen=True)
class Disc:
    """A round spot."""

    centre: Point
    radius: float  # [m]
    colour: Colour

    def outline(self) -> Float[np.ndarray, "n 2"]:
        """The corners of an octagon around it [m]."""
        angle = np.arange(8) * np.pi / 4
        return self.centre + self.radius / np.cos(np.pi / 8) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def beyond(self, x: Float[np.ndarray, "..."], y: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """How far outside the edge points lie, below 0 inside [m]."""
        return np.hypot(x - self.centre[0], y - self.centre[1]) - self.radius


FlatShape = Strip | Disc  # its `beyond` nowhere grows faster than by 1 a metre


def plane_points(camera: RenderCamera, pixels: Float[np.ndarray, "n 2"], z: float) -> Float[np.ndarray, "n 2"]:
    """Points x, y [m] where the rays of pixels meet the plane at a height z [m]; nan where they never do."""
    origins, directions = camera.rays(pixels)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (z - origins[:, 2]) / directions[:, 2]
        return origins[:, :2] + directions[:, :2] * np.where(along > 0, along, np.nan)[:, None]


def pixel_centres(camera: RenderCamera, z: float) -> Float[np.ndarray, "h w 2"]:
    """Points x, y [m] where the rays through the centres of all pixels meet the plane at a height z [m]."""
    width, height = camera.size
    rows = [PixelBox(top, min(top + _ROWS, height), 0, width) for top in range(0, height, _ROWS)]
    return np.concatenate([plane_points(camera, r.pixels, z) for r in rows]).reshape(height, width, 2)


class RenderPlane:
    """A fixed camera over a plane at a height z [m], all in the water.

    The rays through the centres of all pixels are traced once, and those through n x n parts of a pixel when an edge
    first crosses it; both are kept. Nothing is projected or interpolated: an edge is where rays pass it.
    """

    def __init__(self, camera: RenderCamera, z: float, parts: int = 8):
        """`parts` n of a pixel along each side where an edge crosses it."""
        self.camera, self.z, self.parts = camera, z, parts
        self.centres = pixel_centres(camera, z)
        self._x, self._y = np.ascontiguousarray(self.centres[..., 0]), np.ascontiguousarray(self.centres[..., 1])
        self._half = self._half_pixels()
        self._parts = np.empty((0, 2, parts * parts))  # of the pixels that an edge ever crossed, and some room
        self._kept = 0
        self._row = np.full(self._x.size, -1)  # where in these a pixel is

    def _half_pixels(self) -> Float[np.ndarray, "h w"]:
        """No point of a pixel is farther than this from its centre, in the plane [m]."""
        half = np.zeros(self.centres.shape[:2])
        for axis in (0, 1):
            if self.centres.shape[axis] > 1:
                steps = np.linalg.norm(np.diff(self.centres, axis=axis), axis=-1)
                padded = np.pad(steps, [(1, 1) if k == axis else (0, 0) for k in (0, 1)], mode="edge")
                half = half + 0.5 * np.maximum(np.delete(padded, -1, axis), np.delete(padded, 0, axis))
        return 1.1 * half  # the sum of the half sides is more than the half diagonal; a tenth more for curved maps

    def boxes(self, shapes: Sequence[FlatShape]) -> list[PixelBox]:
        """The pixels that each shape may touch."""
        if not shapes:
            return []
        outlines = [shape.outline() for shape in shapes]
        xy = np.concatenate(outlines)
        pixels = self.camera.project(np.column_stack([xy, np.full(len(xy), self.z)]))
        ends = np.cumsum([len(o) for o in outlines])[:-1]
        return [around(of_one, 2.0, self.camera.size) for of_one in np.split(pixels, ends)]

    def painted(
        self,
        ground: Float[np.ndarray, "a b 3"],
        box: PixelBox,
        shapes: Sequence[tuple[FlatShape, PixelBox]],
    ) -> Float[np.ndarray, "a b 3"]:
        """Light of a box: its ground's under shapes, painted one over the other, given with the pixels they may touch.

        Pixels that an edge crosses take the mean over n x n rays.
        """
        light = ground.copy()
        crossed = np.zeros(box.shape, bool)
        seen: list[tuple[FlatShape, PixelBox]] = []
        for shape, touched in shapes:
            within = touched.cut(box)
            if within.empty:
                continue
            seen.append((shape, within))
            beyond = shape.beyond(self._x[within.slices], self._y[within.slices])
            half = self._half[within.slices]
            at = within.inside(box)
            light[at][beyond < 0] = shape.colour
            # what covers a pixel wholly hides the edges below
            crossed[at] = (np.abs(beyond) <= half) | (crossed[at] & ~(beyond < -half))
        if crossed.any():
            light[crossed] = self._mixed(ground[crossed], crossed, box, seen)
        return light

    def _mixed(
        self,
        ground: Float[np.ndarray, "k 3"],
        crossed: Bool[np.ndarray, "a b"],
        box: PixelBox,
        shapes: Sequence[tuple[FlatShape, PixelBox]],
    ) -> Float[np.ndarray, "k 3"]:
        """Mean light of the pixels that edges cross."""
        rows, columns = np.nonzero(crossed)
        rows, columns = rows + box.top, columns + box.left
        xy = self._traced(rows * self.camera.size[0] + columns)
        colours = list(dict.fromkeys(shape.colour for shape, _ in shapes))
        label = np.zeros((len(xy), self.parts**2), np.int16)  # 0 is the ground
        for shape, within in shapes:
            near = (rows >= within.top) & (rows < within.bottom) & (columns >= within.left) & (columns < within.right)
            x, y = xy[near].swapaxes(0, 1)
            label[near] = np.where(shape.beyond(x, y) < 0, 1 + colours.index(shape.colour), label[near])
        # how often each pixel has each colour
        kinds, n = 1 + len(colours), len(label)
        often = np.bincount((label + kinds * np.arange(n)[:, None]).ravel(), minlength=n * kinds).reshape(n, kinds)
        shares = often.astype(np.float32) / label.shape[1]
        return shares[:, :1] * ground + shares[:, 1:] @ np.array(colours, np.float32)

    def _traced(self, pixels: Int[np.ndarray, "k"]) -> Float[np.ndarray, "k 2 n2"]:
        """Where the rays through the parts of pixels, numbered row by row, meet the plane [m]."""
        new = pixels[self._row[pixels] < 0]
        if new.size:
            width = self.camera.size[0]
            at = split(np.stack([new % width, new // width], axis=-1).astype(float), self.parts).reshape(-1, 2)
            kept = self._kept + new.size
            if kept > len(self._parts):
                self._parts = np.concatenate([self._parts[: self._kept], np.empty((kept, *self._parts.shape[1:]))])
            xy = plane_points(self.camera, at, self.z).reshape(-1, self.parts**2, 2)
            self._parts[self._kept : kept] = xy.swapaxes(1, 2)
            self._row[new] = np.arange(self._kept, kept)
            self._kept = kept
        return self._parts[self._row[pixels]]
