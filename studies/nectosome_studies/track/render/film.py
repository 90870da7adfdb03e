"""What a camera makes of light: exposure time, defocus, veil, gain, noise, eight bits; and mottled surfaces.

Light is in counts of a linear sensor at gain 1, 0 to 255 and beyond. All that mixes light (the exposure time, the parts
of a pixel, defocus, veil) happens before all that bends it (clipping, noise, rounding), as in a camera.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, UInt8
from scipy.ndimage import gaussian_filter

from .boxes import PixelBox

Colour = tuple[float, float, float]  # red, green, blue as in a picture file, 0 to 255

_GRAINS = 1 << 21  # numbers that the noise of all frames is drawn from


@dataclass(frozen=True)
class Film:
    r"""A camera's sensor and settings; the defaults leave light as it is, but for eight bits.

    Counts of a pixel on which the light L falls:

    $$ n = \mathrm{round}\left[g\, (P * L) + N(0, \sigma^2)\right]_0^{255} $$

    with the gain g, spread P, and noise of standard deviation sigma, alike for all pixels and colours but independent,
    and for the same time and seed always the same.
    """

    rate: float = 60.0  # frames per second
    shutter: float = 0.0  # share of the frame interval that is open, 0 to 1; a frame's own time is the middle of it
    instants: int = 8  # that stand for the exposure time: enough when what moves goes a pixel or less between them
    defocus: float = 0.0  # standard deviation of the spread [px]
    veil: float = 0.0  # share of the light that is scattered far, as a soft halo
    veil_width: float = 6.0  # its standard deviation [px]
    gain: float = 1.0
    grain: float = 0.0  # standard deviation of the noise [counts]
    seed: int = 0

    def __post_init__(self):
        for name in ("shutter", "veil"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"Film.{name} is {getattr(self, name):g}; allowed are 0 to 1.")
        if min(self.rate, self.instants, self.veil_width) <= 0 or min(self.defocus, self.grain) < 0:
            raise ValueError("Film: rate, instants and veil_width are above 0, defocus and grain not below it.")

    def exposure(self, t: float) -> Float[np.ndarray, "k"]:
        """Times [s] whose mean light makes the frame of a time t: middles of equal parts of the exposure time."""
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

    @cached_property
    def _grains(self) -> Float[np.ndarray, "n"]:
        """Normal numbers; half a count is added, so that cutting off rounds."""
        chance = np.random.default_rng(self.seed)
        return self.grain * chance.standard_normal(_GRAINS, dtype=np.float32) + np.float32(0.5)

    def develop(self, counts: Float[np.ndarray, "h w 3"], t: float) -> UInt8[np.ndarray, "h w 3"]:
        """Noise, clipping and rounding of the frame of a time t; writes over `counts`."""
        if self.grain:
            # each row is a stretch of the same numbers, from a random place: 5 times as fast as to draw all anew
            instant = int(np.float64(t + 0.0).view(np.uint64))
            rows = counts.reshape(len(counts), -1)
            starts = np.random.default_rng([self.seed, instant]).integers(0, _GRAINS - rows.shape[1], len(rows))
            for row, start in zip(rows, starts, strict=True):
                row += self._grains[start : start + len(row)]
        else:
            counts += np.float32(0.5)
        return np.clip(counts, 0, 255, out=counts).astype(np.uint8)


class Plate:
    """A film before a scene at rest: a frame is made of the boxes in which the light differs."""

    def __init__(self, film: Film, light: Float[np.ndarray, "h w 3"]):
        """`light` of the scene at rest, before it is spread."""
        self.film = film
        self.light = light.astype(np.float32)
        self._spread = film.spread(self.light, "nearest") if film.reach else self.light
        self._counts = film.gain * self._spread

    def exposed(
        self, t: float, changes: list[tuple[PixelBox, Float[np.ndarray, "a b 3"]]]
    ) -> UInt8[np.ndarray, "h w 3"]:
        """The frame of a time t [s], with other light in boxes that are more than twice `film.reach` apart."""
        counts = self._counts.copy()
        height, width = counts.shape[:2]
        for box, light in changes:
            # the spread is linear: that of the difference is added to what is spread already
            wide = box.grown(self.film.reach, (width, height))
            more = np.zeros((*wide.shape, 3), np.float32)
            more[box.inside(wide)] = light - self.light[box.slices]
            if self.film.reach:
                more = self.film.spread(more)
            counts[wide.slices] = self.film.gain * (self._spread[wide.slices] + more)
        return self.film.develop(counts, t)


@dataclass(frozen=True)
class Mottling:
    r"""Smooth pseudo-random mottling, of a tank's floor or of haze: waves of random directions, phases and lengths,

    $$ m(x) = a \sum_k \sqrt{\lambda_k} \cos(2 \pi x \cdot n_k / \lambda_k + \phi_k) $$

    of mean 0 and, by a, standard deviation 1, the same for the same seed, with no cell, edge or period in sight.
    """

    shortest: float = 0.02  # wavelength, in the unit of the places
    longest: float = 0.3
    waves: int = 24
    seed: int = 0

    def __call__(self, places: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n"]:
        """Its value at places."""
        chance = np.random.default_rng(self.seed)
        angle, phase = chance.uniform(0, 2 * np.pi, (2, self.waves))
        length = np.geomspace(self.shortest, self.longest, self.waves)
        total = np.zeros(len(places))
        for a, p, l in zip(angle, phase, length, strict=True):
            w = 2 * np.pi / l
            total += np.sqrt(l) * np.cos(w * np.cos(a) * places[:, 0] + w * np.sin(a) * places[:, 1] + p)
        return np.sqrt(2 / length.sum()) * total
