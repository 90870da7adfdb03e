"""Parameters between bounds, mapped to coordinates from 0 to 1 on a linear or logarithmic scale."""

from collections.abc import Collection, Sequence

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from nectosome.units.errors import InputError, did_you_mean


class Ranges:
    """Parameters with their bounds, and the map between the unit box [0, 1]^n and their values.

    Equal bounds fix a parameter; its coordinate is 0. Raises InputError for a duplicate name, bounds that are NaN,
    infinite or in the wrong order, and a logarithmic scale with a lower bound that is not positive.
    """

    names: tuple[str, ...]
    bounds: Float[np.ndarray, "n 2"]
    log: Bool[np.ndarray, "n"]  # mask of logarithmic scales
    ends: Float[np.ndarray, "n 2"]  # scaled bounds

    def __init__(self, names: Sequence[str], lower: ArrayLike, upper: ArrayLike, log: Collection[str] = ()):
        self.names, n = tuple(names), len(names)
        self.bounds = np.stack([np.broadcast_to(np.asarray(x, dtype=float), n) for x in (lower, upper)], axis=1)
        self.log = np.array([name in log for name in self.names], dtype=bool)
        for name in log:
            if name not in self.names:
                raise InputError(f"there is no such parameter.{did_you_mean(name, self.names)}", field=name)
        for k, (name, (low, high)) in enumerate(zip(self.names, self.bounds, strict=True)):
            if self.names.count(name) > 1:
                raise InputError("is named twice.", field=name)
            if not (np.isfinite([low, high]).all() and low <= high):
                message = f"{low:g} to {high:g} is not a range: two numbers are needed, the larger one last."
                raise InputError(message, field=name)
            if self.log[k] and low <= 0:
                raise InputError(f"{low:g} has no logarithm: the lower bound must be more than 0.", field=name)
        self.ends = self._scaled(self.bounds.T).T

    def values(self, u: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        """Values at coordinates; for coordinates in [0, 1] they are within their bounds despite rounding."""
        u = np.asarray(u)
        x = self.ends[:, 0] + u * (self.ends[:, 1] - self.ends[:, 0])
        x = np.where(self.log, np.exp(np.where(self.log, x, 0.0)), x)
        return np.where((u >= 0) & (u <= 1), np.clip(x, self.bounds[:, 0], self.bounds[:, 1]), x)

    def places(self, x: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        """Coordinates of values; outside [0, 1] for values outside their bounds."""
        width = self.ends[:, 1] - self.ends[:, 0]
        return (self._scaled(np.asarray(x)) - self.ends[:, 0]) / np.where(width > 0, width, 1.0)

    def slopes(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Derivatives of values by their coordinates, at x."""
        return (self.ends[:, 1] - self.ends[:, 0]) * np.where(self.log, x, 1.0)

    def told(self, x: Float[np.ndarray, "n"]) -> str:
        """Values as text: `k = 3.2, c = 0.1`."""
        return ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.names, x, strict=True))

    def _scaled(self, x: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        return np.where(self.log, np.log(np.where(self.log, x, 1.0)), x)
