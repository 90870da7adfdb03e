"""What a picture is painted on: pixels, painted larger by OpenCV and shrunk, or SVG, which stays sharp at any size."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from nectosome.io.extras import package

from .markup import plain

Picture = UInt8[np.ndarray, "h w 3"]  # blue, green, red

FINER = 2  # by which a raster is larger while it is painted
_SHIFT = 4  # bits of a pixel's fraction in OpenCV's coordinates
_SEAM = 1.0  # px, drawn around faces in their own colour, since viewers of SVG leave gaps between neighbours


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

    def glaze(self, outlines: Float[np.ndarray, "n corners 2"], colour: Float[np.ndarray, "3"], share: float) -> None:
        """Lay a share of a colour over what each outline holds; they are convex, and each holds the next one."""
        cv2 = self._cv2
        mask = np.zeros(self.image.shape[:2], np.uint8)
        for k, outline in enumerate(_fixed(outlines), start=1):
            cv2.fillConvexPoly(mask, outline, round(255 * (1 - (1 - share) ** k)), cv2.LINE_AA, _SHIFT)
        left, top, wide, high = cv2.boundingRect(mask)
        if not high:
            return
        mask, under = (x[top : top + high, left : left + wide] for x in (mask, self.image))
        cv2.multiply(under, cv2.merge([255 - mask] * 3), dst=under, scale=1 / 255)
        cv2.add(under, cv2.merge([cv2.multiply(mask, float(x), scale=1 / 255) for x in colour]), dst=under)

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


class Vector:
    """A picture of `size` [px] to draw on, with the methods of `Raster`, before water from one colour to another."""

    def __init__(self, size: tuple[int, int], water: Float[np.ndarray, "h 3"]):
        self._size, self._water = size, water
        self._drawn: list[str] = []

    def svg(self) -> str:
        """What was drawn."""
        width, height = self._size
        box = f'width="{width}" height="{height}"'
        shade = f'<filter id="soft"><feGaussianBlur stdDeviation="{max(height / 45, 2):g}"/></filter>'
        stops = "".join(f'<stop offset="{k}" stop-color="{_hex(self._water[-k])}"/>' for k in (0, 1))
        water = f'<linearGradient id="water" x1="0" y1="0" x2="0" y2="1">{stops}</linearGradient>'
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" {box} viewBox="0 0 {width} {height}">\n'
            f"<defs>{shade}{water}</defs>\n"
            f'<rect {box} fill="url(#water)"/>\n' + "\n".join(self._drawn) + "\n</svg>\n"
        )

    def paint(self, corners: Float[np.ndarray, "n 4 2"], colours: Float[np.ndarray, "n 3"]) -> None:
        """Paint faces one over the other."""
        faces = (
            f'<path d="{_path(face)}Z" fill="{ink}" stroke="{ink}"/>'
            for face, ink in zip(corners, map(_hex, colours), strict=True)
        )
        self._drawn.append(f'<g stroke-width="{_SEAM}" stroke-linejoin="round">{"".join(faces)}</g>')

    def darken(self, outlines: Sequence[Float[np.ndarray, "corners 2"]], share: float) -> None:
        """Darken by a share what convex outlines hold, with soft edges."""
        path = "".join(f"{_path(outline)}Z" for outline in outlines)
        self._drawn.append(f'<g opacity="{share:g}"><path d="{path}" filter="url(#soft)"/></g>')

    def glaze(self, outlines: Float[np.ndarray, "n corners 2"], colour: Float[np.ndarray, "3"], share: float) -> None:
        """Lay a share of a colour over what each outline holds; they are convex, and each holds the next one."""
        paths = "".join(f'<path d="{_path(outline)}Z"/>' for outline in outlines)
        self._drawn.append(f'<g fill="{_hex(colour)}" fill-opacity="{share:g}">{paths}</g>')

    def rule(self, ends: Float[np.ndarray, "n 2 2"], colours: Float[np.ndarray, "n 3"], width: float) -> None:
        """Draw straight lines."""
        lines = (f'<path d="{_path(e)}" stroke="{c}"/>' for e, c in zip(ends, map(_hex, colours), strict=True))
        self._drawn.append(f'<g stroke-width="{width:g}">{"".join(lines)}</g>')

    def bar(self, left: float, top: float, width: float, height: float, colour: Float[np.ndarray, "3"]) -> None:
        """Fill a rectangle."""
        box = f'x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}"'
        self._drawn.append(f'<rect {box} fill="{_hex(colour)}"/>')

    def text(self, words: str, left: float, low: float, size: float, bold: bool, colour: np.ndarray) -> None:
        """Write words, whose base line begins at a place."""
        weight = 600 if bold else 400
        font = f'font-family="sans-serif" font-size="{size:g}" font-weight="{weight}" fill="{_hex(colour)}"'
        self._drawn.append(f'<text x="{left:g}" y="{low:g}" {font}>{plain(words)}</text>')


def _each(colours: Float[np.ndarray, "n 3"]) -> Iterator[tuple[int, int, int]]:
    """Colours one at a time: thousands of lists that live at once would keep the garbage collector busy."""
    flat = np.rint(colours).astype(np.uint8).ravel().tolist()
    return zip(flat[0::3], flat[1::3], flat[2::3], strict=True)


def _fixed(pixels: np.ndarray) -> np.ndarray:
    """Places as OpenCV counts them, from the middle of the first pixel of the larger picture, in whole parts."""
    return np.round((pixels * FINER - 0.5) * 2**_SHIFT).astype(np.int32)


def _path(places: Float[np.ndarray, "n 2"]) -> str:
    """Straight from place to place."""
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in places.tolist())


def _hex(colour: Float[np.ndarray, "3"]) -> str:
    """Colour of blue, green, red, as "#0072b2"."""
    blue, green, red = np.rint(colour).astype(int).tolist()
    return f"#{red:02x}{green:02x}{blue:02x}"
