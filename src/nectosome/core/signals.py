"""Signals: functions of time with their first two derivatives, which a prescribed joint needs."""

from abc import abstractmethod
from dataclasses import fields
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.description import signals as ds

from .described import DescribedModule, class_for, is_zero, number, numbers

Triple = tuple[Array, Array, Array]


class Signal(DescribedModule):
    """A function of time t [s] that returns (u, du/dt, d2u/dt2), in the unit of the driven quantity."""

    @abstractmethod
    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and first two derivatives at time t [s]."""


class Constant(Signal):
    """u = value."""

    value: Float[Array, "*shape"]
    described_by = ds.ConstantSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and its zero derivatives."""
        zero = jnp.zeros_like(self.value)
        return self.value + zero, zero, zero


class Ramped(Signal):
    """A signal that grows from rest over its `ramp`, by g = 6 x^5 - 15 x^4 + 10 x^3 with x = t/ramp from 0 to 1."""

    @classmethod
    def from_description(cls, described: Any) -> "Ramped":
        """The signal of a description, without a ramp where that takes no time."""
        given = [field.name for field in fields(cls) if field.name != "ramp"]
        ramp = None if is_zero(described.ramp) else number(described.ramp)
        return cls(**numbers(described, *given), ramp=ramp)  # pyright: ignore[reportCallIssue]


class Rate(Ramped):
    """u = start + rate t: a motor at constant speed; with a ramp it turns at g rate."""

    rate: Float[Array, "*shape"]
    start: Float[Array, "*shape"]
    ramp: Float[Array, ""] | None = None  # [s]
    described_by = ds.RateSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Angle (or position), speed and acceleration."""
        if self.ramp is None:
            return self.start + self.rate * t, self.rate + 0.0, jnp.zeros_like(self.rate)
        x = jnp.clip(t / self.ramp, 0.0, 1.0)
        # the integral of g over t is t - ramp/2 at the end of the ramp and after it
        gone = self.ramp * x**4 * (2.5 - 3 * x + x**2) + jnp.maximum(t - self.ramp, 0.0)
        g, dg, _ = _growth(t, self.ramp)
        return self.start + self.rate * gone, self.rate * g, self.rate * dg


class Sine(Ramped):
    """u = offset + g amplitude sin(2 pi frequency t + phase)."""

    amplitude: Float[Array, "*shape"]
    frequency: Float[Array, "*shape"]
    phase: Float[Array, "*shape"]
    offset: Float[Array, "*shape"]
    ramp: Float[Array, ""] | None = None  # [s]
    described_by = ds.SineSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives of the sine."""
        w = 2 * jnp.pi * self.frequency
        s, c = jnp.sin(w * t + self.phase), jnp.cos(w * t + self.phase)
        u, du, ddu = _ramped((self.amplitude * s, self.amplitude * w * c, -self.amplitude * w**2 * s), t, self.ramp)
        return self.offset + u, du, ddu


class Stroke(Ramped):
    r"""A reciprocating stroke: u = offset - g amplitude cos(a), with an angle a that increases by pi in each half.

    With the cycle $s = f t + \phi/2\pi + p/2$ modulo 1 and the fraction p of the forward half, $a = \pi s/p$ for s < p
    and $a = \pi (1 + (s - p)/(1 - p))$ after; p = 1/2 is a sine. The second derivative jumps between the halves, unless
    p = 1/2.
    """

    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]
    phase: Float[Array, ""]
    offset: Float[Array, ""]
    forward_share: Float[Array, ""]  # p
    ramp: Float[Array, ""] | None = None  # [s]
    described_by = ds.StrokeSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives."""
        p = self.forward_share
        s = self.frequency * t + self.phase / (2 * jnp.pi) + 0.5 * p
        s = s - jnp.floor(s)
        forward = s < p
        share = jnp.where(forward, p, 1 - p)
        a = jnp.pi * jnp.where(forward, s / p, 1 + (s - p) / (1 - p))
        w = jnp.pi * self.frequency / share
        u, du, ddu = -jnp.cos(a), w * jnp.sin(a), w**2 * jnp.cos(a)
        u, du, ddu = _ramped((u, du, ddu), t, self.ramp)
        return self.offset + self.amplitude * u, self.amplitude * du, self.amplitude * ddu


def _growth(t: Array, ramp: Array) -> Triple:
    """g and its derivatives by time."""
    x = jnp.clip(t / ramp, 0.0, 1.0)
    g = x**3 * (10 - 15 * x + 6 * x**2)
    return g, 30 * x**2 * (1 - x) ** 2 / ramp, 60 * x * (1 - x) * (1 - 2 * x) / ramp**2


def _ramped(u: Triple, t: Array, ramp: Array | None) -> Triple:
    """A signal times g; the signal itself without a ramp."""
    if ramp is None:
        return u
    g, dg, ddg = _growth(t, ramp)
    return g * u[0], g * u[1] + dg * u[0], g * u[2] + 2 * dg * u[1] + ddg * u[0]


class Wave(Signal):
    r"""A travelling wave along a body, by n shape coefficients: u = g (offset o + amplitude (c sin a - s cos a)).

    With $a = 2\pi f t + \phi$ and o, c and s the coefficients of $e(x)$, $e(x) \cos(2\pi x/\lambda)$ and $e(x)
    \sin(2\pi x/\lambda)$, this is $e(x)$ times offset + amplitude sin(a - 2 pi x/lambda): a wave towards larger x. g is
    that of a `Ramped` signal.
    """

    amplitude: Float[Array, ""]
    frequency: Float[Array, ""]
    phase: Float[Array, ""]
    offset: Float[Array, ""]
    envelope: Float[Array, "n"]  # o
    cosine: Float[Array, "n"]  # c
    sine: Float[Array, "n"]  # s
    ramp: Float[Array, ""] | None = None  # [s]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Values and derivatives."""
        w = 2 * jnp.pi * self.frequency
        s, c = jnp.sin(w * t + self.phase), jnp.cos(w * t + self.phase)
        here = self.amplitude * (self.cosine * s - self.sine * c)
        ahead = self.amplitude * (self.cosine * c + self.sine * s)
        u = self.offset * self.envelope + here, w * ahead, -(w**2) * here
        return _ramped(u, t, self.ramp)


class Cycle(Ramped):
    """Values evenly spread over each period, joined by a periodic cubic spline.

    The first value is at time 0, advanced by `phase` [rad]. With a ramp, g multiplies the distance from their mean.
    """

    values: Float[Array, "n"]
    frequency: Float[Array, ""]  # of the whole cycle [Hz]
    phase: Float[Array, ""]
    ramp: Float[Array, ""] | None = None  # [s]
    described_by = ds.CycleSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives; the second one is continuous."""
        n = self.values.shape[0]
        # second derivatives m at the knots, a sample being 1: m[k-1] + 4 m[k] + m[k+1] = 6 (u[k-1] - 2 u[k] + u[k+1])
        beside = np.roll(np.eye(n), 1, axis=0) + np.roll(np.eye(n), -1, axis=0)
        m = (np.linalg.solve(4 * np.eye(n) + beside, 6 * (beside - 2 * np.eye(n)))) @ self.values
        s = self.frequency * t + self.phase / (2 * jnp.pi)
        s = n * (s - jnp.floor(s))
        k = jnp.clip(jnp.floor(s).astype(int), 0, n - 1)
        x, after = s - k, (k + 1) % n
        y = 1 - x
        u = y * self.values[k] + x * self.values[after] + ((y**3 - y) * m[k] + (x**3 - x) * m[after]) / 6
        du = self.values[after] - self.values[k] + ((1 - 3 * y**2) * m[k] + (3 * x**2 - 1) * m[after]) / 6
        w = n * self.frequency
        middle = 0.0 if self.ramp is None else jnp.mean(self.values)
        u, du, ddu = _ramped((u - middle, w * du, w**2 * (y * m[k] + x * m[after])), t, self.ramp)
        return middle + u, du, ddu


class Recording(Signal):
    """Samples at increasing times with linear interpolation (first-order hold); constant outside.

    The first derivative is that of the segment, the second one is zero.
    """

    times: Float[Array, "samples"]
    values: Float[Array, "samples"]
    described_by = ds.RecordingSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Interpolated value, derivative of the segment, zero."""
        k = jnp.clip(jnp.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 2)
        t0, t1, u0, u1 = self.times[k], self.times[k + 1], self.values[k], self.values[k + 1]
        slope = (u1 - u0) / (t1 - t0)
        inside = (t >= self.times[0]) & (t < self.times[-1])
        value = jnp.clip(t, self.times[0], self.times[-1])
        return u0 + slope * (value - t0), jnp.where(inside, slope, 0.0), jnp.zeros_like(slope)


class SmoothRecording(Signal):
    r"""Samples at increasing times as a cubic spline, whose second derivative is continuous; at rest outside of them.

    With the intervals $h_k = t_{k+1} - t_k$, the slopes $d_k = (u_{k+1} - u_k)/h_k$ and second derivatives m at the
    samples,

    $$ h_{k-1} m_{k-1} + 2 (h_{k-1} + h_k) m_k + h_k m_{k+1} = 6 (d_k - d_{k-1}) $$

    and the third derivative is continuous at the second and the last but one sample (not-a-knot; de Boor 1978, ch. IV).
    Before the first and after the last sample it stands still there: the rate jumps to 0.
    """

    times: Float[Array, "samples"]  # at least four
    values: Float[Array, "samples"]
    second: Float[Array, "samples"]  # m
    described_by = ds.SmoothRecordingSignal

    @classmethod
    def from_description(cls, described: ds.SmoothRecordingSignal) -> "SmoothRecording":
        """The recording of a description."""
        return cls.through(**numbers(described, "times", "values"))

    @classmethod
    def through(cls, times: Float[Array, "samples"], values: Float[Array, "samples"]) -> "SmoothRecording":
        """The spline through samples, at least four."""
        h = jnp.diff(times)
        d = jnp.diff(values) / h
        # the ends follow from not-a-knot, m0 = ((h0 + h1) m1 - h0 m2) / h1, which leaves the samples between them
        first, last = h[0] / h[1], h[-1] / h[-2]
        centre = 2 * (h[:-1] + h[1:])
        centre = centre.at[0].add(h[0] * (1 + first)).at[-1].add(h[-1] * (1 + last))
        below = h[:-1].at[-1].add(-h[-1] * last).at[0].set(0.0)
        above = h[1:].at[0].add(-h[0] * first).at[-1].set(0.0)
        m = _solve_tridiagonal(below, centre, above, 6 * jnp.diff(d))
        ends = (1 + first) * m[0] - first * m[1], (1 + last) * m[-1] - last * m[-2]
        return cls(times, values, jnp.concatenate([ends[0][None], m, ends[1][None]]))

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives."""
        k = jnp.clip(jnp.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 2)
        h = self.times[k + 1] - self.times[k]
        x = (jnp.clip(t, self.times[0], self.times[-1]) - self.times[k]) / h
        y = 1 - x
        u0, u1, m0, m1 = self.values[k], self.values[k + 1], self.second[k], self.second[k + 1]
        u = y * u0 + x * u1 + h**2 / 6 * ((y**3 - y) * m0 + (x**3 - x) * m1)
        du = (u1 - u0) / h + h / 6 * ((1 - 3 * y**2) * m0 + (3 * x**2 - 1) * m1)
        inside = (t >= self.times[0]) & (t <= self.times[-1])
        return u, jnp.where(inside, du, 0.0), jnp.where(inside, y * m0 + x * m1, 0.0)


def _solve_tridiagonal(below: Array, centre: Array, above: Array, right: Array) -> Float[Array, "n"]:
    """Solve below[k] x[k-1] + centre[k] x[k] + above[k] x[k+1] = right[k] by elimination (Thomas)."""

    def eliminate(
        before: tuple[Array, Array], row: tuple[Array, ...]
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        b, c, a, r = row
        pivot = c - b * before[0]
        out = a / pivot, (r - b * before[1]) / pivot
        return out, out

    def back(after: Array, row: tuple[Array, Array]) -> tuple[Array, Array]:
        x = row[1] - row[0] * after
        return x, x

    none = jnp.zeros_like(right[0])
    _, rows = jax.lax.scan(eliminate, (none, none), (below, centre, above, right))
    return jax.lax.scan(back, none, rows, reverse=True)[1]


class Steps(Signal):
    """Samples at increasing times with a zero-order hold: commands of a controller."""

    times: Float[Array, "samples"]
    values: Float[Array, "samples"]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Last sample at or before t (the first one before it), zero derivatives."""
        k = jnp.clip(jnp.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 1)
        zero = jnp.zeros_like(self.values[0])
        return self.values[k], zero, zero


class Handover(Signal):
    """A smooth transition from the signal `before` to the signal `after`, over `seconds` from `since` on.

    u = before + g (after - before), with the g of a `Ramped` signal; value and both derivatives are continuous.
    """

    before: Signal
    after: Signal
    since: Float[Array, ""]  # [s]
    seconds: Float[Array, ""]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives."""
        old, new = self.before(t), self.after(t)
        difference = new[0] - old[0], new[1] - old[1], new[2] - old[2]
        ramped = _ramped(difference, t - self.since, self.seconds)
        return old[0] + ramped[0], old[1] + ramped[1], old[2] + ramped[2]


class Shaped(Signal):
    """A signal times a vector: the same in time, by numbers of a body's shape."""

    signal: Signal
    shape: Float[Array, "n"]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Values and derivatives."""
        u, du, ddu = self.signal(t)
        return self.shape * u, self.shape * du, self.shape * ddu


class Stack(Signal):
    """Several signals as one vector."""

    signals: tuple[Signal, ...]

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Values and derivatives, one component per signal."""
        value, rate, second = zip(*(signal(t) for signal in self.signals), strict=True)
        return jnp.stack(value), jnp.stack(rate), jnp.stack(second)


def signal_of(described: ds.SignalDescription) -> Signal:
    """Signal of a description."""
    return class_for(described, Signal).from_description(described)
