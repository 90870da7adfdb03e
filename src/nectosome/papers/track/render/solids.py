"""Solids that rays are traced against: balls and round rods."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from .film import Colour
from .optics import Vector


class Solid(Protocol):
    """What a ray can meet."""

    @property
    def colour(self) -> Colour:
        """As in a picture file."""
        ...

    @property
    def share(self) -> float:
        """Of its light that there is: a mirror image has less."""
        ...

    def spine(self) -> tuple[Float[np.ndarray, "n 3"], float]:
        """Points [m], and a radius [m] of balls about them that together are about the solid."""
        ...

    def met(self, origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """How far along unit rays it is met [m]; infinitely far where it is missed."""
        ...


@dataclass(frozen=True)
class Ball:
    """A sphere."""

    centre: Float[np.ndarray, "3"]  # [m]
    radius: float  # [m]
    colour: Colour
    share: float = 1.0

    def spine(self) -> tuple[Float[np.ndarray, "n 3"], float]:
        """Its centre."""
        return self.centre[None], self.radius

    def met(self, origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """The nearer root of |o + t d - c|^2 = r^2."""
        away = self.centre - origins
        along = np.einsum("ij,ij->i", away, rays)
        beside = away - along[:, None] * rays
        under = self.radius**2 - np.einsum("ij,ij->i", beside, beside)
        with np.errstate(invalid="ignore"):
            return np.where((under > 0) & (along > 0), along - np.sqrt(np.maximum(under, 0)), np.inf)


@dataclass(frozen=True)
class RodSolid:
    """An opaque round rod with round ends."""

    start: Vector  # [m]
    end: Vector
    radius: float  # [m]
    colour: Colour = (3.0, 5.0, 6.0)
    share: float = 1.0

    def spine(self) -> tuple[Float[np.ndarray, "n 3"], float]:
        """Points along it, closely enough for a curved image of it."""
        return np.linspace(self.start, self.end, 17), self.radius

    def met(self, origins: Float[np.ndarray, "n 3"], rays: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """At the ray's point closest to the axis, less half the chord there of a ball: exact in what is hidden.

        The ray is closest to the line of the axis at s = (w.u - (d.u)(w.d)) / (1 - (d.u)^2) from the start, with w from
        there to the ray's origin, and to the axis itself at s held to its ends.
        """
        axis = np.subtract(self.end, self.start)
        length = float(np.linalg.norm(axis))
        u = axis / length
        w = origins - np.asarray(self.start)
        wu, wd, du = w @ u, np.einsum("ij,ij->i", w, rays), rays @ u
        s = np.clip((wu - du * wd) / np.maximum(1 - du**2, 1e-12), 0, length)
        along = s * du - wd
        gap = w + along[:, None] * rays - s[:, None] * u
        under = self.radius**2 - np.einsum("ij,ij->i", gap, gap)
        with np.errstate(invalid="ignore"):
            return np.where((under > 0) & (along > 0), along - np.sqrt(np.maximum(under, 0)), np.inf)
