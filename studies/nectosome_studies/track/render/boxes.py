"""Boxes of pixels: the parts of an image that are drawn anew; and points spread over a pixel."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class PixelBox(NamedTuple):
    """Rows and columns of an image, each from the first up to but without the last."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns to index an image with."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.bottom - self.top, self.right - self.left

    @property
    def empty(self) -> bool:
        """Whether no pixel is in it."""
        return self.bottom <= self.top or self.right <= self.left

    def widened(self, by: int) -> "PixelBox":
        """With so many pixels more on each side."""
        return PixelBox(self.top - by, self.bottom + by, self.left - by, self.right + by)

    def grown(self, by: int, size: tuple[int, int]) -> "PixelBox":
        """With so many pixels more on each side, within an image of a width and a height."""
        return self.widened(by).cut(PixelBox(0, size[1], 0, size[0]))

    def cut(self, by: "PixelBox") -> "PixelBox":
        """What it has in common with another."""
        return PixelBox(
            max(self.top, by.top), min(self.bottom, by.bottom), max(self.left, by.left), min(self.right, by.right)
        )

    def joined(self, other: "PixelBox") -> "PixelBox":
        """The smallest box around both."""
        return PixelBox(
            min(self.top, other.top),
            max(self.bottom, other.bottom),
            min(self.left, other.left),
            max(self.right, other.right),
        )

    def inside(self, other: "PixelBox") -> tuple[slice, slice]:
        """Rows and columns to index an image of `other` with, which it lies in."""
        return (
            slice(self.top - other.top, self.bottom - other.top),
            slice(self.left - other.left, self.right - other.left),
        )

    @property
    def pixels(self) -> Float[np.ndarray, "pixels 2"]:
        """Its pixels' centres, row after row [px]."""
        rows, columns = np.mgrid[self.top : self.bottom, self.left : self.right]
        return np.stack([columns.ravel(), rows.ravel()], axis=-1).astype(float)


def split(pixels: Float[np.ndarray, "k 2"], n: int) -> Float[np.ndarray, "k n2 2"]:
    """n x n points spread evenly over each of some pixels, which are given by their whole numbers [px].

    The grid is turned a little, so that an edge along rows or columns passes all its n^2 points one by one, and then
    shifted within each pixel (around its sides), always the same for the same pixel: no edge is along the grid of all
    the pixels that it crosses, and errors of the means over neighbouring pixels differ.
    """
    part = np.arange(n) / n
    v, u = np.meshgrid(part, part, indexing="ij")
    grid = np.stack([(u + v / n).ravel(), (v - u / n).ravel()], axis=-1)
    # multiples of the irrational numbers of the R2 sequence (Roberts 2018), by row and column
    u, v = pixels.T[..., None]
    shift = np.concatenate([0.7548776662 * u + 0.3287 * v * v, 0.5698402910 * v + 0.6180339887 * u * u], axis=-1)
    return pixels[:, None, :] + (grid + shift[:, None, :]) % 1 - 0.5


def around(pixels: Float[np.ndarray, "n 2"], by: float, size: tuple[int, int]) -> PixelBox:
    """The pixels of an image of a width and a height within a distance `by` [px] of the box about points."""
    pixels = pixels[np.all(np.isfinite(pixels), axis=1)]
    if not pixels.size:
        return PixelBox(0, 0, 0, 0)
    limit = np.array(size, float)
    left, top = np.floor(np.clip(pixels.min(axis=0) - by + 0.5, 0, limit)).astype(int)
    right, bottom = np.ceil(np.clip(pixels.max(axis=0) + by + 0.5, 0, limit)).astype(int)
    return PixelBox(int(top), int(bottom), int(left), int(right))


def apart(boxes: Iterable[PixelBox], gap: int) -> list[PixelBox]:
    """Boxes that hold all pixels of some, joined until more than `gap` pixels lie between any two; no empty ones."""
    found: list[PixelBox] = []
    for new in boxes:
        if new.empty:
            continue
        while near := [box for box in found if not box.cut(new.widened(gap)).empty]:
            for box in near:
                found.remove(box)
                new = new.joined(box)
        found.append(new)
    return found
