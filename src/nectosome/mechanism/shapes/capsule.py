"""Capsules: cylinders with half spheres as ends."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.description.shapes import CapsuleShape

from .contract import RigidShape


class Capsule(RigidShape):
    """A cylinder between two half spheres."""

    described_by = CapsuleShape
    solid = "capsule"

    def kinks(self) -> Float[Array, "4"]:
        """The half spheres begin a radius from the ends."""
        end = self.radius / self.length
        return jnp.stack([jnp.zeros(()), end, 1 - end, jnp.ones(())])

    def radii(self, fractions: Float[Array, "n"]) -> Float[Array, "n"]:
        """sqrt(r^2 - d^2) at the distance d beyond the cylinder."""
        beyond = jnp.maximum(jnp.abs(fractions - 0.5) * self.length - 0.5 * self.length + self.radius, 0.0)
        return jnp.sqrt(jnp.maximum(self.radius**2 - beyond**2, 0.0))

    def chain(self) -> tuple[int, Float[Array, ""], Float[Array, ""]]:
        """The middles of the half spheres."""
        _, start, end, _ = self.kinks()
        return 2, start, end

    def profile(self, n: int) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Even angles of each end."""
        root, tip = np.linspace(0, np.pi / 2, n // 2), np.linspace(np.pi / 2, np.pi, n - n // 2)
        angle, r, length = np.concatenate([root, tip]), float(self.radius), float(self.length)
        x = r * (1 - np.cos(angle)) + (length - 2 * r) * (np.arange(n) >= n // 2)
        return 2 * x / length, np.sin(angle)
