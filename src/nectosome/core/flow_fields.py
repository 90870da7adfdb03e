r"""What moves the water: currents that are constant, or change over time or place, and waves of its surface.

Waves are those of linear theory (Airy; Dean and Dalrymple 1991, ch. 3 and 4). With the amplitude a, the angular
frequency $\omega$ as it is seen from the ground, the wave number k, the height z over the surface at rest, the depth h
and the current U along the waves,

$$ \eta = a \cos\theta, \quad \theta = k\, s - \omega t - \varphi, \quad \sigma = \omega - k U = \sqrt{g k \tanh k h} $$

$$ c_s = a \sigma \frac{\cosh k (z + h)}{\sinh k h} \cos\theta, \quad
   c_z = a \sigma \frac{\sinh k (z + h)}{\sinh k h} \sin\theta $$

s is the way along their heading. Above the surface at rest, where a crest is, both go on by straight lines over z
(linear extrapolation), as the exponential is no measure of the velocity there.
"""

from abc import abstractmethod
from collections.abc import Callable
from functools import reduce
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.description import flow_fields as df
from nectosome.description.water import WaterDescription

from .described import DescribedModule, class_for, is_zero, number, unit, vector
from .recorded_signals import Recording
from .signals import Signal, ramped, signal_of

Current = Callable[[Float[Array, ""], Float[Array, "3"]], Float[Array, "3"]]
_SPREAD = 0.07, 0.09  # of JONSWAP's peak, below and above it (Hasselmann et al. 1973)


class UniformCurrent(eqx.Module):
    """A constant, uniform velocity."""

    velocity: Float[Array, "3"]  # [m/s], world frame

    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """Velocity of the water at time t and point x, world frame [m/s]."""
        return self.velocity


class FlowField(DescribedModule):
    """A velocity of the water that depends on time or place."""

    @property
    def steady(self) -> bool:
        """Whether it depends on the place only."""
        return False

    @abstractmethod
    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """Velocity of the water at time t and point x, world frame [m/s]."""


class ChangingCurrent(FlowField):
    """The same everywhere, by a signal of time."""

    direction: Float[Array, "3"]
    speed: Signal
    described_by = df.ChangingCurrentFlow

    @classmethod
    def from_description(cls, described: df.ChangingCurrentFlow, *_: Any) -> "ChangingCurrent":
        """Of a description."""
        return cls(unit(described.direction), signal_of(described.speed))

    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """By the signal; its rate is the derivative of that."""
        return self.speed(t)[0] * self.direction


class ShearedCurrent(FlowField):
    """By the height, with straight lines between those given; beyond them it stays as it is."""

    direction: Float[Array, "3"]
    speed: Recording  # over the height z [m] in the place of time
    described_by = df.ShearedCurrentFlow

    @property
    def steady(self) -> bool:
        """It is."""
        return True

    @classmethod
    def from_description(cls, described: df.ShearedCurrentFlow, *_: Any) -> "ShearedCurrent":
        """Of a description."""
        return cls(unit(described.direction), Recording(vector(described.heights), vector(described.speed)))

    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """By the profile."""
        return self.speed(x[2])[0] * self.direction


class FlowTable(FlowField):
    r"""By a table over any of time, x, y and z: along each a cubic curve with continuous slopes through its points.

    Between two points a step h apart the curve is Hermite's, with the slopes of the parabola through each of them and
    its two neighbours; it is exact for parabolas. At the ends a point is added along a straight line. Beyond them the
    velocity is that of the end. What is steady or the same along an axis has no table there.
    """

    axes: tuple[Float[Array, "_"] | None, ...]  # of t, x, y, z with a point more at each end [s, m]; None: no table
    velocity: Float[Array, "t x y z 3"]  # at these [m/s]
    described_by = df.TableFlow

    @classmethod
    def from_description(cls, described: df.TableFlow, *_: Any) -> "FlowTable":
        """Of a description."""
        velocity, axes = number(described.factor) * jnp.asarray(described.velocities), []
        for k, name in enumerate(df.AXES.values()):
            places = getattr(described, name)
            axes.append(_longer(vector(places), 0) if places else None)
            velocity = _longer(velocity, k) if places else velocity
        return cls(tuple(axes), velocity)

    @property
    def steady(self) -> bool:
        """Whether there is no table over time."""
        return self.axes[0] is None

    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """By the curves, one axis after the other."""
        at = [
            (0, jnp.ones(1)) if axis is None else _weights(axis, p) for axis, p in zip(self.axes, (t, *x), strict=True)
        ]
        begins, sizes = [jnp.asarray(first, jnp.int32) for first, _ in at], [w.size for _, w in at]
        near = jax.lax.dynamic_slice(self.velocity, (*begins, jnp.zeros((), jnp.int32)), (*sizes, 3))
        return reduce(lambda values, one: jnp.tensordot(one[1], values, 1), at, near)


def _longer(values: Array, axis: int) -> Array:
    """Values with one more at each end along an axis, on straight lines."""
    first, second = (jax.lax.slice_in_dim(values, k, k + 1, axis=axis) for k in (0, 1))
    n = values.shape[axis]
    last, before = (jax.lax.slice_in_dim(values, k - 1, k, axis=axis) for k in (n, n - 1))
    return jnp.concatenate([2 * first - second, values, 2 * last - before], axis=axis)


def _weights(places: Float[Array, "n"], x: Float[Array, ""]) -> tuple[Array, Float[Array, "4"]]:
    """First of the four places around x, and the weights with which the values there give that at x."""
    x = jnp.clip(x, places[1], places[-2])
    k = jnp.clip(jnp.searchsorted(places, x, side="right") - 2, 0, places.shape[0] - 4)
    p = jax.lax.dynamic_slice(places, (k,), (4,))
    a, h, b = jnp.diff(p)
    s = (x - p[1]) / h
    one, other = s * (1 - s) ** 2 * h, -(s**2) * (1 - s) * h  # of the slopes at its ends
    level = s**2 * (3 - 2 * s)
    slope = jnp.stack([-h / a, h / a - a / h, a / h, jnp.zeros_like(s)]) / (a + h)
    next_slope = jnp.stack([jnp.zeros_like(s), -b / h, b / h - h / b, h / b]) / (h + b)
    ends = jnp.stack([jnp.zeros_like(s), 1 - level, level, jnp.zeros_like(s)])
    return k, ends + one * slope + other * next_slope


class Waves(FlowField):
    """Linear waves of n sines that run one way (see above)."""

    amplitude: Float[Array, "n"]  # a [m]
    frequency: Float[Array, "n"]  # omega [rad/s]
    wave_number: Float[Array, "n"]  # k [rad/m]
    own_frequency: Float[Array, "n"]  # sigma [rad/s]
    phase: Float[Array, "n"]  # [rad]
    heading: Float[Array, "2"]  # of length 1, along x and y
    level: Float[Array, ""]  # height of the surface at rest [m]
    depth: Float[Array, ""] | None  # h [m]; None: without end
    ramp: Float[Array, ""] | None  # [s]

    @classmethod
    def _of(
        cls, described: df.WavesFlow, water: WaterDescription, amplitude: Array, frequency: Array, phase: Array
    ) -> "Waves":
        """Of sines, in water by its description."""
        depth = None if water.floor is None else number(water.surface) - number(water.floor)
        heading = jnp.stack([jnp.cos(number(described.heading)), jnp.sin(number(described.heading))])
        current = jnp.zeros(2) if water.current is None else vector(water.current)[:2]
        along = jnp.sum(heading * current)
        k = df.wave_number(frequency, number(water.gravity), depth, along, jnp)
        ramp = None if is_zero(described.ramp) else number(described.ramp)
        own = frequency - k * along
        return cls(amplitude, frequency, k, own, phase, heading, number(water.surface), depth, ramp)

    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """By linear theory."""
        angle, size = self._angle(t, x[:2]), self._size(t)
        z, k = x[2] - self.level, self.wave_number
        below, above = jnp.minimum(z, 0.0), jnp.maximum(z, 0.0)
        grown = jnp.exp(k * below)
        if self.depth is None:
            even = odd = grown * (1 + k * above)
        else:
            image, whole = jnp.exp(-k * (below + 2 * self.depth)), -jnp.expm1(-2 * k * self.depth)
            cosh, sinh = (grown + image) / whole, (grown - image) / whole
            even, odd = cosh + k * above * sinh, sinh + k * above * cosh
        speed = size * self.own_frequency
        along = jnp.sum(speed * even * jnp.cos(angle))
        return jnp.concatenate([along * self.heading, jnp.sum(speed * odd * jnp.sin(angle))[None]])

    def elevation(self, t: Float[Array, ""], x: Float[Array, "2"]) -> Float[Array, ""]:
        """Height of the surface over that at rest [m]."""
        return jnp.sum(self._size(t) * jnp.cos(self._angle(t, x)))

    def _angle(self, t: Array, x: Array) -> Float[Array, "n"]:
        return self.wave_number * jnp.sum(self.heading * x) - self.frequency * t - self.phase

    def _size(self, t: Array) -> Float[Array, "n"]:
        if self.ramp is None:
            return self.amplitude
        one = jnp.ones_like(t)
        return ramped((one, 0 * one, 0 * one), t, self.ramp)[0] * self.amplitude


class RegularWaves(Waves):
    """One sine."""

    described_by = df.RegularWavesFlow

    @classmethod
    def from_description(cls, described: df.RegularWavesFlow, water: WaterDescription) -> "Waves":
        """Of a description, in that of the water."""
        frequency = 2 * jnp.pi / number(described.period)
        return cls._of(
            described, water, 0.5 * number(described.height)[None], frequency[None], vector((described.phase,))
        )


class IrregularWaves(Waves):
    r"""Sines of a spectrum, each with the energy of its interval of frequencies.

    $S \propto r^{-5} \exp(-\tfrac54 r^{-4})\, \gamma^{\exp(-(r - 1)^2 / 2 s^2)}$ with the frequency r over that of the
    peak, the peakedness $\gamma$ and s = 0.07 below the peak, 0.09 above (Hasselmann et al. 1973). The energy of all
    sines is that of the significant height: $\sum a^2 / 2 = H_s^2 / 16$.
    """

    described_by = df.IrregularWavesFlow

    @classmethod
    def from_description(cls, described: df.IrregularWavesFlow, water: WaterDescription) -> "Waves":
        """Of a description, in that of the water."""
        rng, n = np.random.default_rng(described.seed), described.count
        r = df.LONGEST + (df.SHORTEST - df.LONGEST) * (np.arange(n) + rng.uniform(size=n)) / n
        peak = np.exp(-0.5 * ((r - 1) / np.where(r < 1, *_SPREAD)) ** 2)
        energy = r**-5.0 * np.exp(-1.25 * r**-4.0) * number(described.peakedness) ** peak
        amplitude = number(described.significant_height) * jnp.sqrt(energy / jnp.sum(energy) / 8)
        phase = jnp.asarray(rng.uniform(0, 2 * np.pi, n))
        return cls._of(described, water, amplitude, 2 * jnp.pi / number(described.peak_period) * r, phase)


class FlowFields(eqx.Module):
    """A constant current and what adds to it."""

    uniform: UniformCurrent | None
    others: tuple[FlowField, ...]

    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """Sum of all."""
        velocity = jnp.zeros(3) if self.uniform is None else self.uniform(t, x)
        return sum((flow(t, x) for flow in self.others), velocity)


def current_of(water: WaterDescription) -> UniformCurrent | FlowFields | None:
    """What moves the water of a description; None if it is still."""
    uniform = None if water.current is None else UniformCurrent(vector(water.current))
    if not water.flows:
        return uniform
    return FlowFields(
        uniform, tuple(class_for(flow, FlowField).from_description(flow, water) for flow in water.flows.values())
    )
