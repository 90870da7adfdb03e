"""A picture in lines and faces that stay sharp at any size: what a camera sees as SVG."""

from collections.abc import Sequence
from html import escape

import numpy as np
from jaxtyping import Float

_SEAM = 1.0  # px, drawn around faces in their own colour, since viewers leave gaps between neighbours


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
        self._drawn.append(f'<text x="{left:g}" y="{low:g}" {font}>{escape(words)}</text>')


def _path(places: Float[np.ndarray, "n 2"]) -> str:
    """Straight from place to place."""
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in places.tolist())


def _hex(colour: Float[np.ndarray, "3"]) -> str:
    """Colour of blue, green, red, as "#0072b2"."""
    blue, green, red = np.rint(colour).astype(int).tolist()
    return f"#{red:02x}{green:02x}{blue:02x}"
