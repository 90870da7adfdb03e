"""Which pixels are of which colour, by ranges of hue, saturation and value (Hu et al. 2024, section 3.2)."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8

from nectosome.io.extras import package

from .sheet import Colour

MOST = 8  # colours at once: a pixel's are the bits of a byte


class Groups:
    """Up to eight ranges of colours, looked up for all pixels at once; those that are alike are one group."""

    def __init__(self, wanted: Sequence[Colour]):
        colours: list[Colour] = []
        self.of: list[int] = []  # group of each of them
        for colour in wanted:
            same = (k for k, known in enumerate(colours) if _range(known) == _range(colour))
            self.of.append(next(same, len(colours)))
            if self.of[-1] == len(colours):
                colours.append(colour)
        self.count = len(colours)
        if not 1 <= self.count <= MOST:
            raise ValueError(f"Groups: {self.count} colours; from 1 to {MOST} are possible.")
        self._cv2 = package("cv2", "video")
        table = np.zeros((1, 256, 3), np.uint8)
        level = np.arange(256)
        for k, colour in enumerate(colours):
            low, high = (edge / (2 * math.pi) * 256 for edge in colour.hue)
            # a hue of n stands for n to n + 1 of 256 parts of a turn
            middle = level + 0.5
            hues = (middle >= low) & (middle <= high) if low < high else (middle >= low) | (middle <= high)
            parts = [hues]
            for edges in (colour.saturation, colour.value):
                parts.append((level >= 255 * edges[0] - 0.5) & (level <= 255 * edges[1] + 0.5))
            for channel, part in enumerate(parts):
                table[0, part, channel] |= 1 << k
        self._table = table

    def look(self, image: UInt8[np.ndarray, "height width 3"]) -> UInt8[np.ndarray, "height width"]:
        """Bit k of a pixel is set where it is of the k-th group; `image` is blue, green, red."""
        cv2 = self._cv2
        hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV_FULL)
        found = cv2.LUT(hsv, self._table)
        hue, saturation, value = cv2.split(found)
        return cv2.bitwise_and(cv2.bitwise_and(hue, saturation), value)


def _range(colour: Colour) -> tuple[object, ...]:
    return colour.hue, colour.saturation, colour.value
