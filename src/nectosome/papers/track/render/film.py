"""What becomes of light in a camera: open time, defocus, exposure, uneven light, tone, grain, eight bits.

Light is in counts of a linear sensor at gain 1, 0 to 255 and beyond. All that mixes light (the open time, the parts of
a pixel, defocus, veil) happens before all that bends it (clipping, tone, grain, rounding), as in a camera.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, UInt8
from scipy.ndimage import gaussian_filter

from .boxes import PixelBox

Colour = tuple[float, float, float]  # red, green, blue as in a picture file, 0 to 255

_GRAINS = 1 << 21  # numbers that the grain of all frames is drawn from


@dataclass(frozen=True)
class Film:
    r"""A camera's sensor and settings; the defaults leave light as it is, but for eight bits.

    Counts of a pixel on which the light L falls:

    $$ n = \mathrm{round}\left[255 \left(g\, e\, (P * L) / 255\right)^{1/\gamma} + N(0, \sigma^2)\right]_0^{255} $$

    with the gain g, evenness e, spread P, and grain of standard deviation sigma, alike for all pixels and colours
    but independent, and for the same time and seed always the same.
    """

    rate: float = 60.0  # frames per second
    shutter: float = 0.0  # share of the frame interval that is open, 0 to 1; a frame's own time is the middle of it
    instants: int = 8  # instants that stand for the open time: enough when what moves goes a pixel or less between them
    defocus: float = 0.0  # standard deviation of the spread [px]
    veil: float = 0.0  # share of the light that is scattered far, as a soft halo
    veil_width: float = 6.0  # its standard deviation [px]
    gain: float = 1.0
    uneven: float = 0.0  # brightness differs from 1 - uneven to 1 + uneven over the image
    uneven_towards: float = 0.0  # where it is brightest, from the right edge towards the lower one [rad]
    gamma: float = 1.0  # 1: counts are linear in light; 2.2: as most cameras do. Colours are meant at gain 1.
    grain: float = 0.0  # standard deviation of the noise [counts]
    seed: int = 0

    def __post_init__(self):
        for name, low, high in (("shutter", 0, 1), ("veil", 0, 1), ("uneven", 0, 1)):
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"Film.{name} is {getattr(self, name):g}; allowed are {low} to {high}.")
        if min(self.rate, self.instants, self.gamma, self.veil_width) <= 0 or min(self.defocus, self.grain) < 0:
            raise ValueError("Film: rate, instants, gamma and veil_width are above 0, defocus and grain not below it.")

    def light(self, colour: Colour) -> Float[np.ndarray, "3"]:
        """Light that comes out as a colour at gain 1 and in even light."""
        return 255 * (np.asarray(colour, float) / 255) ** self.gamma

    def open(self, t: float) -> Float[np.ndarray, "k"]:
        """Moments [s] whose mean light makes the frame of a time t: middles of equal parts of the open time."""
        if self.shutter == 0:
            return np.array([float(t)])
        k = self.instants
        return t + self.shutter / self.rate * ((np.arange(k) + 0.5) / k - 0.5)

    @property
    def reach(self) -> int:
        """How far light spreads [px]; it ends there."""
        return max(int(4 * self.defocus + 0.5), int(4 * self.veil_width + 0.5) if self.veil else 0)

    def spread(self, light: Float[np.ndarray, "h w 3"], mode: str = "constant") -> Float[np.ndarray, "h w 3"]:
        """Defocused and with its veil; beyond the edges is darkness, or with mode 'nearest' more of the same."""

        def gaussian(x: Float[np.ndarray, "h w 3"], sigma: float) -> Float[np.ndarray, "h w 3"]:
            return gaussian_filter(x, (sigma, sigma, 0), mode=mode) if sigma else x

        sharp = gaussian(light, self.defocus)
        if not self.veil:
            return sharp
        return (1 - self.veil) * sharp + self.veil * gaussian(light, self.veil_width)

    def evenness(self, size: tuple[int, int]) -> Float[np.ndarray, "h w 1"]:
        """Gain and uneven light by pixel: a plane that is 1 in the middle, and 1 +- uneven in two corners or sides."""
        x, y = (np.linspace(-1, 1, n) if n > 1 else np.zeros(1) for n in size)
        c, s = np.cos(self.uneven_towards), np.sin(self.uneven_towards)
        slope = (c * x[None, :] + s * y[:, None]) / (abs(c) + abs(s))
        return (self.gain * (1 + self.uneven * slope)).astype(np.float32)[:, :, None]

    def tone(self, light: Float[np.ndarray, "h w 3"]) -> Float[np.ndarray, "h w 3"]:
        """Counts, neither clipped nor rounded, of light after gain."""
        return light if self.gamma == 1 else 255 * (np.maximum(light, 0) / 255) ** (1 / self.gamma)

    @cached_property
    def _grains(self) -> Float[np.ndarray, "n"]:
        """Normal numbers; half a count is added, so that cutting off rounds."""
        chance = np.random.default_rng(self.seed)
        return self.grain * chance.standard_normal(_GRAINS, dtype=np.float32) + np.float32(0.5)

    def develop(self, counts: Float[np.ndarray, "h w 3"], t: float) -> UInt8[np.ndarray, "h w 3"]:
        """Grain, clipping and rounding of the frame of a time t; writes over `counts`."""
        if self.grain:
            # each row is a stretch of the same numbers, from a place by chance: 5 times as fast as to draw all anew
            instant = int(np.float64(t + 0.0).view(np.uint64))
            rows = counts.reshape(len(counts), -1)
            starts = np.random.default_rng([self.seed, instant]).integers(0, _GRAINS - rows.shape[1], len(rows))
            for row, start in zip(rows, starts, strict=True):
                row += self._grains[start : start + len(row)]
        else:
            counts += np.float32(0.5)
        return np.clip(counts, 0, 255, out=counts).astype(np.uint8)


class Plate:
    """A film before what never changes: frames are made by telling where the light differs."""

    def __init__(self, film: Film, light: Float[np.ndarray, "h w 3"]):
        """`light` of the scene at rest, before it is spread."""
        self.film = film
        self.light = light.astype(np.float32)
        height, width = light.shape[:2]
        self._even = film.evenness((width, height))
        self._spread = film.spread(self.light, "nearest") if film.reach else self.light
        self._counts = film.tone(self._spread * self._even).astype(np.float32)
        self._size = width, height

    def exposed(
        self, t: float, changes: list[tuple[PixelBox, Float[np.ndarray, "a b 3"]]]
    ) -> UInt8[np.ndarray, "h w 3"]:
        """The frame of a time t [s], with other light in boxes that are more than twice `film.reach` apart."""
        counts = self._counts.copy()
        for box, light in changes:
            # the spread is linear: that of the difference is added to what is spread already
            wide = box.grown(self.film.reach, self._size)
            more = np.zeros((*wide.shape, 3), np.float32)
            more[box.inside(wide)] = light - self.light[box.slices]
            if self.film.reach:
                more = self.film.spread(more)
            changed = (self._spread[wide.slices] + more) * self._even[wide.slices]
            counts[wide.slices] = self.film.tone(changed)
        return self.film.develop(counts, t)
