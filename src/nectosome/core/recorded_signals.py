"""Signals given by their samples: joined by lines, by a smooth curve, or held."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.description import recorded_signals as ds

from .described import is_zero, numbers
from .signals import Signal, Triple


class Recording(Signal):
    """Samples at increasing times with linear interpolation (first-order hold); constant outside.

    The first derivative is that of the segment, the second one is zero.
    """

    times: Float[Array, "samples"]
    values: Float[Array, "samples"]
    described_by = ds.RecordingSignal

    @classmethod
    def from_description(cls, described: ds.RecordingSignal) -> "Recording":
        """The recording of a description."""
        return cls(**numbers(described, "times"), values=_values(described))

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
        return cls.through(**numbers(described, "times"), values=_values(described))

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


def _values(described: ds.RecordingSignal) -> Float[Array, "samples"]:
    values = numbers(described, "values")["values"]
    return values if is_zero(described.factor - 1) else described.factor * values


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
