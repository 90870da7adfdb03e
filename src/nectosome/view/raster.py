"""A picture in pixels: what a camera sees is painted by OpenCV from far to near, larger, and shrunk to smooth edges."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from nectosome.io.extras import package

Picture = UInt8[np.ndarray, "h w 3"]  # blue, green, red

FINER = 2  # by which it is larger while it is painted
_SHIFT = 4  # bits of a pixel's fraction in OpenCV's coordinates


class Raster:
    """A picture of `size` [px] to paint on, before water of a colour for each row. Places and lengths are in pixels."""

    def __init__(self, size: tuple[int, int], water: Float[np.ndarray, "h 3"]):
        self._size, self._cv2 = size, package("cv2", "video")
        rows = np.rint(water).astype(np.uint8).repeat(FINER, axis=0)
        self._empty = rows[:, None].repeat(FINER * size[0], axis=1)
        self.image = self._empty.copy()

    def clear(self) -> None:
        """Begin a new picture."""
        self.image = self._empty.copy()

    def picture(self) -> Picture:
        """What was painted."""
        return self._cv2.resize(self.image, self._size, interpolation=self._cv2.INTER_AREA)

    def paint(self, corners: Float[np.ndarray, "n 4 2"], colours: Float[np.ndarray, "n 3"]) -> None:
        """Paint faces one over the other."""
        for face, colour in zip(_fixed(corners), _each(colours), strict=True):
            self._cv2.fillConvexPoly(self.image, face, colour, self._cv2.LINE_8, _SHIFT)

    def darken(self, outlines: Sequence[Float[np.ndarray, "corners 2"]], share: float) -> None:
        """Darken by a share what convex outlines hold, with soft edges."""
        cv2 = self._cv2
        width, height = (n // 2 for n in self._size)  # of the shadow, which is not sharp
        mask = np.zeros((height, width), np.uint8)
        for outline in outlines:
            cv2.fillConvexPoly(mask, np.rint(0.5 * outline - 0.5).astype(np.int32), 255)
        left, top, wide, high = cv2.boundingRect(mask)
        if not high:
            return
        soft = max(height / 90, 1.0)
        edge = int(3 * soft)
        top, bottom = max(top - edge, 0), min(top + high + edge, height)
        left, right = max(left - edge, 0), min(left + wide + edge, width)
        mask = cv2.GaussianBlur(mask[top:bottom, left:right], (0, 0), soft)
        light = cv2.resize(255 - np.rint(share * mask).astype(np.uint8), None, fx=2 * FINER, fy=2 * FINER)
        top, bottom, left, right = (2 * FINER * n for n in (top, bottom, left, right))
        dark = self.image[top:bottom, left:right]
        cv2.multiply(dark, cv2.merge([light] * 3), dst=dark, scale=1 / 255)

    def rule(self, ends: Float[np.ndarray, "n 2 2"], colours: Float[np.ndarray, "n 3"], width: float) -> None:
        """Draw straight lines."""
        wide = max(round(FINER * width), 1)
        for (a, b), colour in zip(_fixed(ends).tolist(), _each(colours), strict=True):
            self._cv2.line(self.image, a, b, colour, wide, self._cv2.LINE_AA, _SHIFT)

    def bar(self, left: float, top: float, width: float, height: float, colour: Float[np.ndarray, "3"]) -> None:
        """Fill a rectangle."""
        a, b = (round(FINER * left), round(FINER * top)), (round(FINER * (left + width)), round(FINER * (top + height)))
        self.image[a[1] : b[1], a[0] : b[0]] = colour

    def text(self, words: str, left: float, low: float, size: float, bold: bool, colour: np.ndarray) -> None:
        """Write words, whose base line begins at a place."""
        place, font = (round(FINER * left), round(FINER * low)), self._cv2.FontFace("sans")
        self._cv2.putText(self.image, words, place, colour.tolist(), font, round(FINER * size), 600 if bold else 400)


def _each(colours: Float[np.ndarray, "n 3"]) -> Iterator[tuple[int, int, int]]:
    """Colours one at a time: thousands of lists that live at once would keep the garbage collector busy."""
    flat = np.rint(colours).astype(np.uint8).ravel().tolist()
    return zip(flat[0::3], flat[1::3], flat[2::3], strict=True)


def _fixed(pixels: np.ndarray) -> np.ndarray:
    """Places as OpenCV counts them, from the middle of the first pixel of the larger picture, in whole parts."""
    return np.round((pixels * FINER - 0.5) * 2**_SHIFT).astype(np.int32)
