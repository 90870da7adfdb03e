"""Signals: functions of time with their first two derivatives, which a prescribed joint needs."""

from abc import abstractmethod
from dataclasses import fields
from functools import cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.description import signals as ds

from .described import DescribedModule, class_for, is_zero, number, numbers, vector
from .updates import rounding

Triple = tuple[Array, Array, Array]
_BLOCK = 4096  # times for which a program computes a signal at once
_DRAWS = 200  # of phases, of which those with the least crest factor are taken
_POINTS, _FINE = 8, 64  # of a period of the highest frequency, where peaks are looked for: of draws, and of the best


class Signal(DescribedModule):
    """A function of time t [s] that returns (u, du/dt, d2u/dt2), in the unit of the driven quantity."""

    @abstractmethod
    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and first two derivatives at time t [s]."""


class Jumping(Signal):
    """A signal whose value or first two derivatives jump at times that are known: steps of time end there."""

    @abstractmethod
    def next_jump(self, t: Float[Array, ""]) -> Float[Array, "*any"]:
        """First time [s] after t, but for `rounding`, at which it jumps; inf where none follows.

        It is computed number by number, so that it is that of all signals whose numbers are stacked.
        """


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

    ramp: Float[Array, ""] | None = eqx.field(default=None, kw_only=True)  # [s]

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
    described_by = ds.RateSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Angle (or position), speed and acceleration."""
        if self.ramp is None:
            return self.start + self.rate * t, self.rate + 0.0, jnp.zeros_like(self.rate)
        x = _gone(t, self.ramp)[0]
        # the integral of g over t is t - ramp/2 at the end of the ramp and after it
        gone = self.ramp * x**4 * (2.5 - 3 * x + x**2) + jnp.maximum(t - self.ramp, 0.0)
        g, dg, _ = _growth(t, self.ramp)
        return self.start + self.rate * gone, self.rate * g, self.rate * dg


class Oscillation(Ramped):
    """What goes to and fro about its offset."""

    amplitude: Float[Array, "*shape"]
    frequency: Float[Array, "*shape"]
    phase: Float[Array, "*shape"]
    offset: Float[Array, "*shape"]


class Sine(Oscillation):
    """u = offset + g amplitude sin(2 pi frequency t + phase)."""

    described_by = ds.SineSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives of the sine."""
        w = 2 * jnp.pi * self.frequency
        s, c = jnp.sin(w * t + self.phase), jnp.cos(w * t + self.phase)
        u, du, ddu = ramped((self.amplitude * s, self.amplitude * w * c, -self.amplitude * w**2 * s), t, self.ramp)
        return self.offset + u, du, ddu


class Ray(Sine):
    """The sine of one of several in a row: by its place x, phase - 2 pi waves x and the amplitude of the envelope."""

    described_by = ds.RaySignal

    @classmethod
    def from_description(cls, described: ds.RaySignal) -> Ramped:
        """The sine at its place."""
        place, envelope = number(described.place), vector(described.envelope)
        size = jnp.interp(place, jnp.linspace(0.0, 1.0, len(envelope)), envelope)
        phase = described.phase - 2 * jnp.pi * described.waves * place
        here = described.model_copy(update={"amplitude": size * described.amplitude, "phase": phase})
        return super().from_description(here)


class Triangle(Oscillation, Jumping):
    """Straight lines between offset - g amplitude and offset + g amplitude; the rate jumps at their ends."""

    described_by = ds.TriangleSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value, rate of the line, and 0 but for the ramp."""
        s = self.frequency * t + self.phase / (2 * jnp.pi) + 0.25
        s = s - jnp.floor(s)
        rate = jnp.where(s < 0.5, 4.0, -4.0) * self.amplitude * self.frequency
        lines = self.amplitude * (1 - jnp.abs(4 * s - 2)), rate, jnp.zeros_like(rate)
        u, du, ddu = ramped(lines, t, self.ramp)
        return self.offset + u, du, ddu

    def next_jump(self, t: Float[Array, ""]) -> Float[Array, "*any"]:
        """Next end of a line."""
        return _next_turn(t, self.frequency, self.phase / (2 * jnp.pi) + 0.25, 0.5)


class Jump(Jumping):
    """0 before the time `at`, and `height` from then on; without it, all the time."""

    height: Float[Array, ""]
    at: Float[Array, ""] | None = None  # [s]
    described_by = ds.StepSignal

    @classmethod
    def from_description(cls, described: ds.StepSignal) -> "Jump":
        """The step of a description."""
        return cls(number(described.height), None if described.at is None else number(described.at))

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and zero derivatives."""
        zero = jnp.zeros_like(self.height)
        return self.height + zero if self.at is None else jnp.where(t >= self.at, self.height, zero), zero, zero

    def next_jump(self, t: Float[Array, ""]) -> Float[Array, "*any"]:
        """The step, where it is still to come."""
        return jnp.asarray(jnp.inf) if self.at is None else _still_to_come(t, self.at)


class Chirp(Oscillation, Jumping):
    r"""A sine whose frequency goes from f to F in the time T: u = offset + g amplitude sin(2 pi turns + phase).

    Within T the frequency is $f e^{kt}$ with $k = \ln(F/f)/T$, and the turns are $f (e^{kt} - 1)/k$; before and after
    it stays f and F.
    """

    to: Float[Array, ""]  # F
    time: Float[Array, ""]  # T
    described_by = ds.ChirpSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives; the second one jumps where the chirp begins and ends."""
        k = jnp.log(self.to / self.frequency) / self.time
        within = jnp.clip(t, 0.0, self.time)
        small = jnp.abs(k * within) < 1e-9
        x = jnp.where(small, 1.0, k * within)
        turns = self.frequency * within * jnp.where(small, 1 + 0.5 * k * within, jnp.expm1(x) / x)
        turns = turns + self.frequency * jnp.minimum(t, 0.0) + self.to * jnp.maximum(t - self.time, 0.0)
        w = 2 * jnp.pi * self.frequency * jnp.exp(k * within)
        dw = jnp.where((t >= 0) & (t < self.time), k * w, 0.0)
        s, c = (f(2 * jnp.pi * turns + self.phase) for f in (jnp.sin, jnp.cos))
        u, du, ddu = ramped((s, w * c, dw * c - w**2 * s), t, self.ramp)
        return self.offset + self.amplitude * u, self.amplitude * du, self.amplitude * ddu

    def next_jump(self, t: Float[Array, ""]) -> Float[Array, "*any"]:
        """Its beginning at 0 or its end."""
        return jnp.minimum(_still_to_come(t, jnp.zeros_like(self.time)), _still_to_come(t, self.time))


class Varying(Jumping):
    """One period of each of n sines after the other; the rate jumps between them."""

    amplitude: Float[Array, "n"]
    frequency: Float[Array, "n"]
    offset: Float[Array, ""]
    described_by = ds.VaryingSignal

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Value and derivatives of the sine at t; before and after all, of the first and the last."""
        ends = jnp.concatenate([jnp.zeros(1), jnp.cumsum(1 / self.frequency)])
        k = jnp.clip(jnp.searchsorted(ends, t, side="right") - 1, 0, self.frequency.size - 1)
        size, w = self.amplitude[k], 2 * jnp.pi * self.frequency[k]
        s, c = jnp.sin(w * (t - ends[k])), jnp.cos(w * (t - ends[k]))
        return self.offset + size * s, size * w * c, -size * w**2 * s

    def next_jump(self, t: Float[Array, ""]) -> Float[Array, "*any"]:
        """Next end of a period between two sines."""
        return _still_to_come(t, jnp.cumsum(1 / self.frequency, axis=-1)[..., :-1])


class Sum(Signal):
    """The sum of several signals."""

    terms: tuple[Signal, ...]
    described_by = ds.SumSignal

    @classmethod
    def from_description(cls, described: Any) -> "Sum":
        """The sum of the described terms."""
        return cls(tuple(signal_of(term) for term in described.terms))

    def __call__(self, t: Float[Array, ""]) -> Triple:
        """Values and derivatives."""
        value, rate, second = zip(*(term(t) for term in self.terms), strict=True)
        return sum(value), sum(rate), sum(second)  # pyright: ignore[reportReturnType]


class Stroke(Oscillation, Jumping):
    r"""A reciprocating stroke: u = offset - g amplitude cos(a), with an angle a that increases by pi in each half.

    With the cycle $s = f t + \phi/2\pi + p/2$ modulo 1 and the fraction p of the forward half, $a = \pi s/p$ for s < p
    and $a = \pi (1 + (s - p)/(1 - p))$ after; p = 1/2 is a sine. The second derivative jumps between the halves, unless
    p = 1/2.
    """

    forward_share: Float[Array, ""]  # p
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
        u, du, ddu = ramped((u, du, ddu), t, self.ramp)
        return self.offset + self.amplitude * u, self.amplitude * du, self.amplitude * ddu

    def next_jump(self, t: Float[Array, ""]) -> Float[Array, "*any"]:
        """Next end of a half, where the halves differ."""
        p = self.forward_share
        turn = _next_turn(t, self.frequency, self.phase / (2 * jnp.pi) + 0.5 * p, p)
        return jnp.where(p == 0.5, jnp.inf, turn)


def _still_to_come(t: Array, times: Array) -> Array:
    return jnp.where(times > t + rounding(t), times, jnp.inf)


def _next_turn(t: Array, frequency: Array, start: Array, share: Any) -> Array:
    """First time after t at which the cycle s = start + frequency t modulo 1 is 0 or a share."""
    f = jnp.where(frequency > 0, frequency, 1.0)
    s = start + f * (t + rounding(t))
    turns = [(jnp.floor(s - x) + 1 + x - start) / f for x in (0.0, share)]
    return jnp.where(frequency > 0, jnp.minimum(*turns), jnp.inf)


def _gone(t: Array, ramp: Array) -> tuple[Array, Array]:
    """Share of a ramp that is over, all of one that takes no time; and its time, to divide by."""
    lasting = jnp.where(ramp > 0, ramp, 1.0)
    return jnp.where(ramp > 0, jnp.clip(t / lasting, 0.0, 1.0), 1.0), lasting


def _growth(t: Array, ramp: Array) -> Triple:
    """g and its derivatives by time."""
    x, ramp = _gone(t, ramp)
    g = x**3 * (10 - 15 * x + 6 * x**2)
    return g, 30 * x**2 * (1 - x) ** 2 / ramp, 60 * x * (1 - x) * (1 - 2 * x) / ramp**2


def ramped(u: Triple, t: Array, ramp: Array | None) -> Triple:
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
        return ramped(u, t, self.ramp)


class Cycle(Ramped):
    """Values evenly spread over each period, joined by a periodic cubic spline.

    The first value is at time 0, advanced by `phase` [rad]. With a ramp, g multiplies the distance from their mean.
    """

    values: Float[Array, "n"]
    frequency: Float[Array, ""]  # of the whole cycle [Hz]
    phase: Float[Array, ""]
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
        u, du, ddu = ramped((u - middle, w * du, w**2 * (y * m[k] + x * m[after])), t, self.ramp)
        return middle + u, du, ddu


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
        u, du, ddu = ramped(difference, t - self.since, self.seconds)
        return old[0] + u, old[1] + du, old[2] + ddu


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


def sampled(described: ds.SignalDescription, t: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Values of a described signal at times t [s]; signals of a kind share a program."""
    signal, blocks = signal_of(described), np.zeros((-(-len(t) // _BLOCK), _BLOCK))
    blocks.ravel()[: len(t)] = t
    return np.concatenate([_values(signal, jnp.asarray(block)) for block in blocks] or [np.zeros(0)])[: len(t)]


@eqx.filter_jit
def _values(signal: Signal, t: Float[Array, "n"]) -> Float[Array, "n"]:
    return jax.vmap(lambda at: signal(at)[0])(t)


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
