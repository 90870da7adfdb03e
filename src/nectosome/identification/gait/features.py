"""Gaits of a walking robot: features, and how far they are from others (Giorgio-Serchi et al. 2017, section 4.3)."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

FEATURES = ("amplitude", "frequency", "speed", "height")
UNITS = ("m", "Hz", "m/s", "m")
FALL = 100.0  # at least, of a robot that falls
_SOONER = 5.0  # for each second that it falls sooner


class Gait(NamedTuple):
    """Features of the motion of a body that walks."""

    amplitude: Float[Array, "*batch"]  # of the height, from its lowest to its highest value [m]
    frequency: Float[Array, "*batch"]  # of the height [Hz], 0 where it does not come back to its mean
    speed: Float[Array, "*batch"]  # mean speed along x [m/s]
    height: Float[Array, "*batch"]  # mean height [m]


def gait_of(x: Float[Array, "n"], z: Float[Array, "n"], step: Float[Array, ""]) -> Gait:
    """Features of positions x and z [m], sampled every `step` [s]; the frequency by upward crossings of z's mean."""
    mean = jnp.mean(z)
    below, above = z[:-1] - mean, z[1:] - mean
    up = (below < 0) & (above >= 0)
    when = jnp.arange(z.shape[0] - 1) - below / jnp.where(up, above - below, 1.0)
    first, last = jnp.min(jnp.where(up, when, jnp.inf)), jnp.max(jnp.where(up, when, -jnp.inf))
    turns = jnp.sum(up) - 1
    frequency = jnp.where(turns > 0, turns / (jnp.where(turns > 0, last - first, 1.0) * step), 0.0)
    return Gait(jnp.max(z) - jnp.min(z), frequency, (x[-1] - x[0]) / ((x.shape[0] - 1) * step), mean)


def discrepancy(
    found: Float[np.ndarray, "*batch 4"],
    target: Float[np.ndarray, "4"],
    fell: Float[np.ndarray, "*batch"],
    seconds: float,
) -> Float[np.ndarray, "*batch"]:
    r"""Sum of the squares of $(f^* - f)/f^*$ over the features, and for a robot that fell at t a penalty (eq. 13).

    $100 + 5 (t_e - t)$, rounded up, of the `seconds` $t_e$ that it was to walk; `fell` is inf where it did not.
    """
    off = np.sum(((target - found) / target) ** 2, axis=-1)
    stands = np.isinf(fell)
    return np.where(stands, off, np.ceil(FALL + _SOONER * (seconds - np.where(stands, seconds, fell))))
