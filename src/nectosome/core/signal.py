"""Signals: functions of time that come with their first two derivatives, as a prescribed joint needs."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

Triple = tuple[Array, Array, Array]


class Signal(eqx.Module):
    """A function of time t [s]; called, it gives (u, du/dt, d2u/dt2) in the unit of what it drives."""

    @abstractmethod
    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and first two derivatives at time t [s]."""


class Constant(Signal):
    """u = value."""

    value: Float[Array, "*shape"]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and its zero derivatives."""
        zero = jnp.zeros_like(self.value)
        return self.value + zero, zero, zero


class Rate(Signal):
    """u = start + rate t: a motor at constant speed."""

    rate: Float[Array, "*shape"]
    start: Float[Array, "*shape"]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Angle (or position), speed and zero acceleration."""
        return self.start + self.rate * t, self.rate + 0.0, jnp.zeros_like(self.rate)


class Sine(Signal):
    """u = offset + amplitude sin(2 pi frequency t + phase)."""

    amplitude: Float[Array, "*shape"]
    frequency: Float[Array, "*shape"]
    phase: Float[Array, "*shape"]
    offset: Float[Array, "*shape"]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives of the sine."""
        w = 2 * jnp.pi * self.frequency
        s, c = jnp.sin(w * t + self.phase), jnp.cos(w * t + self.phase)
        return self.offset + self.amplitude * s, self.amplitude * w * c, -self.amplitude * w**2 * s


class Recording(Signal):
    """Samples at increasing times joined by straight lines (first-order hold); held constant outside.

    The first derivative is that of the line; the second is zero between the samples: what a recording does not tell.
    """

    times: Float[Array, "samples"]
    values: Float[Array, "samples"]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Interpolated value, slope of the segment, zero."""
        k = jnp.clip(jnp.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 2)
        t0, t1, u0, u1 = self.times[k], self.times[k + 1], self.values[k], self.values[k + 1]
        slope = (u1 - u0) / (t1 - t0)
        inside = (t >= self.times[0]) & (t < self.times[-1])
        value = jnp.clip(t, self.times[0], self.times[-1])
        return u0 + slope * (value - t0), jnp.where(inside, slope, 0.0), jnp.zeros_like(slope)


class Steps(Signal):
    """Samples at increasing times, each held until the next one (zero-order hold): what a controller commands."""

    times: Float[Array, "samples"]
    values: Float[Array, "samples"]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Last sample at or before t (the first one before it), zero derivatives."""
        k = jnp.clip(jnp.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 1)
        zero = jnp.zeros_like(self.values[0])
        return self.values[k], zero, zero


class Stack(Signal):
    """Several signals as one vector."""

    signals: tuple[Signal, ...]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Values and derivatives, one number a signal."""
        value, rate, second = zip(*(signal(t) for signal in self.signals), strict=True)
        return jnp.stack(value), jnp.stack(rate), jnp.stack(second)
