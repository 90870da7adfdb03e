"""A sum of sines at multiples of a frequency, whose phases keep its peaks low."""

from functools import cache

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.description import signals as ds

from .described import is_zero, number, numbers
from .signals import Oscillation, Triple, ramped

_DRAWS = 200  # of phases, of which those with the least crest factor are taken
_POINTS, _FINE = 8, 64  # of a period of the highest frequency, where peaks are looked for: of draws, and of the best


class Multisine(Oscillation):
    """u = offset + g a sum_k cos(k (2 pi frequency t + phase) + phase_k); a makes the amplitude the largest value."""

    phases: Float[Array, "n"]
    peak: Float[Array, ""]  # of the sum with a = 1
    described_by = ds.MultisineSignal

    @classmethod
    def from_description(cls, described: ds.MultisineSignal) -> "Multisine":
        """The sum of a description, with the phases of its seed."""
        phases = crest_phases(described.count, described.seed)
        ramp = None if is_zero(described.ramp) else number(described.ramp)
        own = numbers(described, "amplitude", "frequency", "phase", "offset")
        return cls(**own, phases=jnp.asarray(phases), peak=number(_peak(phases, _FINE)), ramp=ramp)

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives."""
        k, size = jnp.arange(1, self.phases.size + 1), self.amplitude / self.peak
        w = 2 * jnp.pi * self.frequency * k
        a = w * t + k * self.phase + self.phases
        sums = jnp.sum(jnp.cos(a)), -jnp.sum(w * jnp.sin(a)), -jnp.sum(w**2 * jnp.cos(a))
        u, du, ddu = ramped(sums, t, self.ramp)
        return self.offset + size * u, size * du, size * ddu


@cache
def crest_phases(count: int, seed: int) -> Float[np.ndarray, "count"]:
    """Random phases [rad] of a sum of `count` sines, of those drawn the ones with the least crest factor."""
    every = np.random.default_rng(seed).uniform(0, 2 * np.pi, (_DRAWS, count))
    return every[int(np.argmin([_peak(phases, _POINTS) for phases in every]))]


def _peak(phases: Float[np.ndarray, "n"], fine: int) -> float:
    """Largest value of a sum of sines, at `fine` points or more in a period of the highest."""
    points = 2 ** int(np.ceil(np.log2(fine * (len(phases) + 1))))
    spectrum = np.zeros(points // 2 + 1, complex)
    spectrum[1 : len(phases) + 1] = np.exp(1j * phases)
    return float(np.abs(np.fft.irfft(spectrum, points) * points / 2).max())
