"""Flat opaque shapes in a horizontal plane; each tells how far beyond its edge a point lies."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from .film import Colour

Point = tuple[float, float]  # x, y in the world [m]


class FlatShape(Protocol):
    """What can be painted: a colour, points about it, and a distance that nowhere grows faster than by 1 a metre."""

    @property
    def colour(self) -> Colour:
        """As in a picture file."""
        ...

    def outline(self) -> Float[np.ndarray, "n 2"]:
        """Points on or outside the shape, closely enough that it lies in the box about their pixels, or nearly [m]."""
        ...

    def beyond(self, x: Float[np.ndarray, "..."], y: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """How far outside the edge points lie, below 0 inside [m]; outside it may be less than the distance."""
        ...


@dataclass(frozen=True)
class Strip:
    """A rectangle along the line from its start to its end."""

    start: Point
    end: Point
    width: float  # [m]
    colour: Colour

    def outline(self) -> Float[np.ndarray, "n 2"]:
        """Along both long sides, for a lens makes them curves."""
        (x0, y0), along, _ = self._frame()
        steps = np.linspace(0, 1, 9)[:, None]
        line = [x0, y0] + steps * (np.asarray(self.end) - self.start)
        aside = 0.5 * self.width * np.array([-along[1], along[0]])
        return np.concatenate([line + aside, line - aside])

    def beyond(self, x: Float[np.ndarray, "..."], y: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """max(|s - L/2| - L/2, |n| - W/2) with s along and n across."""
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
        """The corners of an octagon around it."""
        angle = np.arange(8) * np.pi / 4
        return self.centre + self.radius / np.cos(np.pi / 8) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def beyond(self, x: Float[np.ndarray, "..."], y: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """The distance from the centre less the radius."""
        return np.hypot(x - self.centre[0], y - self.centre[1]) - self.radius
