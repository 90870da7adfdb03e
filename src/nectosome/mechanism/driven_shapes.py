"""Shapes of strains that motors drive: what one angle of a shaft does along a rod."""

from fractions import Fraction
from itertools import pairwise

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import signal_of
from nectosome.core.described import number, vector
from nectosome.description import Rod


class DrivenShape(eqx.Module):
    """Shape of a driven strain: numbers at places spread evenly along the rod, joined by straight lines."""

    values: Float[Array, "n"]  # of the strain times length, per angle of the shaft [1]
    start: Float[Array, ""]  # angle of the shaft at the start [rad]

    def along(self, s: np.ndarray) -> Array:
        """Values at fractions s of the length."""
        return jnp.asarray(_hats(self.values.size, s)) @ self.values

    def over(self, nodes: np.ndarray) -> Float[Array, "2 k"]:
        """Values at two collocation points in each interval between nodes, of a line with the same two moments.

        Values of the shape itself there would lose what its kinks add to the mean of an interval.
        """
        lines = [self._line(*ends) for ends in pairwise(nodes)]
        return jnp.asarray(np.stack(lines, axis=1)) @ self.values

    def _line(self, start: float, end: float) -> np.ndarray:
        """Shares [2, n] of its numbers in the values of such a line."""
        n, width = self.values.size, end - start
        inside = [at for at in np.linspace(0, 1, n)[1:-1] if start < at < end]
        s, w = gauss(2, tuple((at - start) / width for at in inside))
        mean, slope = (w * np.stack([np.ones(s.size), 12 * (s - 0.5)])) @ _hats(n, start + width * s)
        return mean + np.outer([-0.5, 0.5], slope) / np.sqrt(3)


def _hats(n: int, s: np.ndarray) -> np.ndarray:
    """Shares [*s, n] of values at n places spread evenly over 0 to 1, joined by straight lines."""
    if n == 1:
        return np.ones((*s.shape, 1))
    return np.stack([np.interp(s, np.linspace(0, 1, n), own) for own in np.eye(n)], axis=-1)


def values_at(driven: dict[str, DrivenShape], s: np.ndarray) -> dict[str, Array]:
    """Values of shapes at fractions s of the length."""
    return {name: shape.along(s) for name, shape in driven.items()}


def kinks(driven: dict[str, DrivenShape]) -> tuple[float, ...]:
    """Fractions of the length where shapes of driven strains have kinks."""
    places = {Fraction(k, shape.values.size - 1) for shape in driven.values() for k in range(1, shape.values.size - 1)}
    return tuple(map(float, sorted(places)))


def gauss(points: int, breaks: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Places and weights of a Gauss rule on each piece of 0 to 1 between `breaks`."""
    s, w = np.polynomial.legendre.leggauss(points)
    ends = np.array([0.0, *breaks, 1.0])
    widths = np.diff(ends)[:, None]
    return (ends[:-1, None] + widths * (0.5 * (s + 1))).ravel(), (widths * (0.5 * w)).ravel()


def driven_shapes(limb: Rod) -> dict[str, DrivenShape]:
    """Shapes of a rod's strains that motors drive; a servo starts at rest where its motion starts."""
    out = {}
    for name, strain in limb.drive.given.items():
        start = jnp.zeros(()) if strain.motion is None else signal_of(strain.motion)(jnp.zeros(()))[0]
        out[name] = DrivenShape(number(strain.ratio) * vector(strain.envelope), start)
    return out
