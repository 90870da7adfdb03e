"""Where the output should be: references as samples, from t = 0 on."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from nectosome.io import InputError


def sine(amplitude: float, frequency: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """amplitude sin(2 pi frequency t), `time` [s] long."""
    return amplitude * np.sin(2 * np.pi * frequency * times(time, dt))


def triangle(amplitude: float, frequency: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """Straight to amplitude, to -amplitude and back to 0, over and over."""
    return amplitude * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * frequency * times(time, dt)))


def varying(amplitudes: Sequence[float], frequencies: Sequence[float], dt: float) -> Float[np.ndarray, "n"]:
    """One period of each sine after the other: its rate jumps between them.

    Raises InputError where there are not as many amplitudes as frequencies.
    """
    if len(amplitudes) != len(frequencies) or not amplitudes:
        raise InputError(f"{len(amplitudes)} amplitudes and {len(frequencies)} frequencies; as many are needed.")
    ends = np.concatenate([[0.0], np.cumsum(1 / np.asarray(frequencies, dtype=float))])
    t = times(float(ends[-1]), dt)
    k = np.clip(np.searchsorted(ends, t, side="right") - 1, 0, len(amplitudes) - 1)
    return np.asarray(amplitudes)[k] * np.sin(2 * np.pi * np.asarray(frequencies)[k] * (t - ends[k]))


def chirp(amplitude: float, first: float, last: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """A sine whose frequency grows evenly on a logarithmic scale, from `first` to `last` [Hz]."""
    t, growth = times(time, dt), np.log(last / first) / time
    turns = first * t if growth == 0 else first * np.expm1(growth * t) / growth
    return amplitude * np.sin(2 * np.pi * turns)


def eased(reference: Float[np.ndarray, "n"], time: float, dt: float) -> Float[np.ndarray, "n"]:
    """A reference that grows from 0 within `time` [s], by s^2 (3 - 2 s), so that its rate does not jump at first.

    Raises InputError for no time.
    """
    if not time > 0:
        raise InputError(f"{time:g} s are no time to grow in.", field="time")
    s = np.minimum(np.arange(len(reference)) * dt / time, 1.0)
    return reference * s**2 * (3 - 2 * s)


def times(time: float, dt: float) -> Float[np.ndarray, "n"]:
    """0, dt, ... up to `time` [s]."""
    return np.arange(int(time / dt + 1e-6) + 1) * dt


def local_frequency(reference: Float[np.ndarray, "n"], dt: float) -> Float[np.ndarray, "n"]:
    """Frequency [Hz] at each sample: half a wave lies between turns; before the first and after the last as beside it.

    0 throughout where the reference does not turn twice.
    """
    ways = np.sign(np.diff(reference))
    moving = np.flatnonzero(ways)
    turns = moving[1:][np.diff(ways[moving]) != 0] * dt
    if len(turns) < 2:
        return np.zeros(len(reference))
    each = 0.5 / np.diff(turns)
    k = np.searchsorted(turns, np.arange(len(reference)) * dt, side="right") - 1
    return each[np.clip(k, 0, len(each) - 1)]
