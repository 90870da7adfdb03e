"""A horizontal plane as a camera sees it: where its rays meet the plane, and shapes painted onto it by these rays."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from .boxes import PixelBox, around, split
from .film import Colour
from .optics import RenderCamera
from .shapes import FlatShape

_ROWS = 64  # of pixels traced at a time, so that memory does not grow with the image


def met(camera: RenderCamera, pixels: Float[np.ndarray, "n 2"], z: float) -> Float[np.ndarray, "n 2"]:
    """Where rays meet the plane at a height z: x, y [m]; nan where they never do."""
    origins, directions = camera.rays(pixels)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (z - origins[:, 2]) / directions[:, 2]
        return origins[:, :2] + directions[:, :2] * np.where(along > 0, along, np.nan)[:, None]


class RenderPlane:
    """A fixed camera over a plane at a height z [m], all in the water.

    The rays through the centres of all pixels are traced once, and those through n x n parts of a pixel when an edge
    first crosses it; both are kept. Nothing is projected or interpolated: an edge is where rays pass it.
    """

    def __init__(self, camera: RenderCamera, z: float, parts: int = 8):
        """`parts` n of a pixel along each side where an edge crosses it."""
        self.camera, self.z, self.parts = camera, z, parts
        width, height = camera.size
        rows = [PixelBox(top, min(top + _ROWS, height), 0, width) for top in range(0, height, _ROWS)]
        self.centres = np.concatenate([met(camera, r.pixels, z) for r in rows]).reshape(height, width, 2)
        self._x, self._y = np.ascontiguousarray(self.centres[..., 0]), np.ascontiguousarray(self.centres[..., 1])
        self._half = self._half_pixels()
        self._parts = np.empty((0, 2, parts * parts))  # of the pixels that an edge ever crossed, and some room
        self._kept = 0
        self._row = np.full(height * width, -1)  # where in these a pixel is

    def _half_pixels(self) -> Float[np.ndarray, "h w"]:
        """No point of a pixel is farther than this from its centre, in the plane [m]."""
        half = np.zeros(self.centres.shape[:2])
        for axis in (0, 1):
            if self.centres.shape[axis] > 1:
                steps = np.linalg.norm(np.diff(self.centres, axis=axis), axis=-1)
                ends = np.stack([np.take(steps, [0], axis), np.take(steps, [-1], axis)])
                wide = np.maximum(np.concatenate([ends[0], steps], axis), np.concatenate([steps, ends[1]], axis))
                half = half + 0.5 * wide
        return 1.1 * half  # the sum of the half sides is more than the half diagonal; a tenth more for curved maps

    def boxes(self, shapes: Sequence[FlatShape]) -> list[PixelBox]:
        """The pixels that each shape may touch."""
        if not shapes:
            return []
        outlines = [shape.outline() for shape in shapes]
        xy = np.concatenate(outlines)
        pixels = self.camera.aims(np.column_stack([xy, np.full(len(xy), self.z)]))
        ends = np.cumsum([len(o) for o in outlines])[:-1]
        return [around(of_one, 2.0, self.camera.size) for of_one in np.split(pixels, ends)]

    def painted(
        self,
        ground: Float[np.ndarray, "a b 3"],
        box: PixelBox,
        shapes: Sequence[tuple[FlatShape, PixelBox]],
        lights: dict[Colour, Float[np.ndarray, "3"]],
    ) -> Float[np.ndarray, "a b 3"]:
        """Light of a box: its ground's under shapes, painted one over the other, given with the pixels they may touch.

        `lights` gives that of each colour. Pixels that an edge crosses take the mean over n x n rays.
        """
        table = np.array([np.zeros(3), *lights.values()], np.float32)
        number = {colour: k for k, colour in enumerate(lights, 1)}
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
            light[at][beyond < 0] = table[number[shape.colour]]
            # what covers a pixel wholly hides the edges below
            crossed[at] = (np.abs(beyond) <= half) | (crossed[at] & ~(beyond < -half))
        if crossed.any():
            light[crossed] = self._mixed(ground[crossed], crossed, box, seen, table, number)
        return light

    def _mixed(
        self,
        ground: Float[np.ndarray, "k 3"],
        crossed: Bool[np.ndarray, "a b"],
        box: PixelBox,
        shapes: Sequence[tuple[FlatShape, PixelBox]],
        table: Float[np.ndarray, "c 3"],
        number: dict[Colour, int],
    ) -> Float[np.ndarray, "k 3"]:
        """Mean light of the pixels that edges cross."""
        rows, columns = np.nonzero(crossed)
        rows, columns = rows + box.top, columns + box.left
        xy = self._traced(rows * self.camera.size[0] + columns)
        label = np.zeros((len(xy), self.parts**2), np.int16)
        for shape, within in shapes:
            near = (rows >= within.top) & (rows < within.bottom) & (columns >= within.left) & (columns < within.right)
            x, y = xy[near].swapaxes(0, 1)
            label[near] = np.where(shape.beyond(x, y) < 0, number[shape.colour], label[near])
        # how often each pixel has each colour
        kinds, n = len(table), len(label)
        often = np.bincount((label + kinds * np.arange(n)[:, None]).ravel(), minlength=n * kinds).reshape(n, kinds)
        shares = often.astype(np.float32) / label.shape[1]
        return shares[:, :1] * ground + shares @ table

    def _traced(self, pixels: Int[np.ndarray, "k"]) -> Float[np.ndarray, "k 2 n2"]:
        """Where the rays through the parts of pixels, numbered row by row, meet the plane [m]."""
        new = pixels[self._row[pixels] < 0]
        if new.size:
            width = self.camera.size[0]
            at = split(np.stack([new % width, new // width], axis=-1).astype(float), self.parts).reshape(-1, 2)
            kept = self._kept + new.size
            if kept > len(self._parts):
                self._parts = np.concatenate([self._parts[: self._kept], np.empty((kept, *self._parts.shape[1:]))])
            xy = met(self.camera, at, self.z).reshape(-1, self.parts**2, 2)
            self._parts[self._kept : kept] = xy.swapaxes(1, 2)
            self._row[new] = np.arange(self._kept, kept)
            self._kept = kept
        return self._parts[self._row[pixels]]
