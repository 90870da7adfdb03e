"""Waves along rods, and strains that are prescribed, as signals of strain coordinates."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Shaped, Signal, Wave, signal_of
from nectosome.core.described import is_zero, number, numbers, vector
from nectosome.description import Rod, WaveSignal
from nectosome.description.signals import RecordedStrain

from .rods import SoftRod, legendre

_POINTS = 60  # of the Gauss rule along a rod


def prescribed_strains(limb: Rod, rod: SoftRod) -> tuple[tuple[int, ...], tuple[Signal, ...]]:
    """Which coordinates of a rod are prescribed, and their values as functions of time, by strain."""
    known = {name: getattr(limb.motion, name) for name in type(limb.motion).model_fields}
    given = {name: strain for name, strain in known.items() if strain is not None}
    rows = [strain_rows(rod, name) for name in given]
    signals = []
    for strain, own in zip(given.values(), rows, strict=True):
        scale = rod.length * (2 * np.arange(len(own)) + 1)  # coordinates of a curvature: (2 k + 1) L int P_k kappa ds
        recorded = isinstance(strain, RecordedStrain)
        signals.append(_recorded(strain, scale) if recorded else wave_of(strain, rod.length, scale))
    return sum(rows, ()), tuple(signals)


def strain_rows(rod: SoftRod, strain: str) -> tuple[int, ...]:
    """Which coordinates of a rod are those of a strain."""
    return tuple(k for k, name in enumerate(rod.names) if name.startswith(f"{strain}."))


def wave_of(described: WaveSignal, length: Array, scale: Float[Array, "n"]) -> Wave:
    """Wave by its numbers int P_k e(s) (1, cos, sin)(2 pi s L/wavelength) ds, each times `scale`."""
    share, e, project = _projection(described, scale)
    wavelength = described.wavelength
    turn = jnp.asarray(share) * (0.0 if wavelength is None else 2 * jnp.pi * length / wavelength)
    return Wave(
        **numbers(described, "amplitude", "frequency", "phase", "offset"),
        envelope=jnp.dot(project, e),
        cosine=jnp.dot(project, e * jnp.cos(turn)),
        sine=jnp.dot(project, e * jnp.sin(turn)),
        ramp=None if is_zero(described.ramp) else number(described.ramp),
    )


def _recorded(described: RecordedStrain, scale: Float[Array, "n"]) -> Shaped:
    """Recording by its numbers int P_k e(s) ds, each times `scale`."""
    _, e, project = _projection(described, scale)
    return Shaped(signal_of(described), jnp.dot(project, e))


def _projection(described: WaveSignal | RecordedStrain, scale: Float[Array, "n"]) -> tuple[np.ndarray, Array, Array]:
    """Points along a rod, the envelope there, and what gives its coefficients, times `scale`."""
    s, weight = np.polynomial.legendre.leggauss(_POINTS)
    share, weight = 0.5 * (s + 1), 0.5 * weight
    knots = np.linspace(0, 1, max(len(described.envelope), 2))
    e = jnp.interp(share, knots, jnp.broadcast_to(vector(described.envelope), knots.shape))
    return share, e, scale[:, None] * jnp.asarray((legendre(scale.size - 1, share) * weight[:, None]).T)
