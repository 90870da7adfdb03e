"""Smooth pseudo-random mottling, of a tank's floor or of haze."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Mottling:
    r"""A sum of waves of random directions, phases and lengths:

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
