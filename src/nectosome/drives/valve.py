"""From command to pressure: saturation, slew rate and stiction of a valve, dead time, a tank."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line, Memoryless, Pointwise, Stepper

from .rate_block import Driven


class Saturation(Memoryless):
    """The input, clipped to a range."""

    low: Float[Array, ""]
    high: Float[Array, ""]

    def value(self, u: Float[Array, ""]) -> Float[Array, ""]:
        """The input within the range."""
        return jnp.clip(u, self.low, self.high)


class SlewLimit(Block):
    """The input with a limited rate [its unit/s]: at most rate x dt per sample."""

    rate: Float[Array, ""]

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """Stepper with the largest change per sample."""
        return _Slew(self.rate * dt)


class _Slew(Stepper):
    most: Float[Array, ""]

    def initial(self) -> Float[Array, ""]:
        """Output."""
        return jnp.zeros(())

    def step(self, state: Float[Array, ""], u: Line) -> tuple[Float[Array, ""], Line]:
        """Move towards the end value; the output is continuous also for a jump of the input."""
        after = jnp.clip(u.end, state - self.most, state + self.most)
        return after, Line(state, after)


class Stiction(Pointwise):
    r"""A valve that sticks: the input with a dead band on reversals, in steps of its resolution.

    Both as ANSI/ISA-75.25.01 defines them: the dead band d is how far the input moves back before the output does, and
    the resolution s the step in which the output moves in one direction. With the error e = u - y,

    $$ y \leftarrow y + \mathrm{sign}(e)\, s \left\lfloor \frac{\max(|e| - d/2, 0)}{s} \right\rfloor $$

    which is a play of width d where s = 0. It is the two-parameter model of He et al. (2007, Ind. Eng. Chem. Res. 46,
    3010), with static friction d/2 + s and kinetic friction d/2, for inputs that change slowly.
    """

    dead_band: Float[Array, ""]  # d, in the unit of the input, at least 0
    resolution: Float[Array, ""]  # s, at least 0

    def initial(self) -> Float[Array, ""]:
        """Output."""
        return jnp.zeros(())

    def at(self, state: Float[Array, ""], u: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Output after the input has gone to u."""
        beyond = jnp.maximum(jnp.abs(u - state) - 0.5 * self.dead_band, 0.0)
        coarse = self.resolution > 0
        step = jnp.where(coarse, self.resolution, 1.0)
        moved = jnp.where(coarse, step * jnp.floor(beyond / step + 1e-9), beyond)  # allows for rounding
        after = state + jnp.sign(u - state) * moved
        return after, after


class DeadTime(Block):
    """The input of `delay` [s] ago; NaN for a delay of more than `most` samples.

    For a fractional delay, the output within a sample is linear between its ends.
    """

    delay: Float[Array, ""]
    most: int = eqx.field(static=True, default=100)  # samples

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """The delay in samples."""
        return _Past(self.delay / dt, self.most + 2)


class _Past(Stepper):
    delay: Float[Array, ""]  # in samples
    kept: int = eqx.field(static=True)

    def initial(self) -> Float[Array, "kept 2"]:
        """Past inputs, the latest first."""
        return jnp.zeros((self.kept, 2))

    def step(self, state: Float[Array, "kept 2"], u: Line) -> tuple[Float[Array, "kept 2"], Line]:
        """The delayed input."""
        state = jnp.concatenate([jnp.stack([u.begin, u.end])[None], state[:-1]])
        whole = jnp.floor(self.delay + 1e-9)  # allows for rounding
        part = jnp.maximum(self.delay - whole, 0.0)
        k = jnp.clip(whole.astype(int), 0, self.kept - 2)
        now, before = state[k], state[k + 1]
        begin = jnp.where(part > 0, before[1] - part * (before[1] - before[0]), now[0])
        known = (self.delay >= 0) & (self.delay <= self.kept - 2)
        end = now[1] - part * (now[1] - now[0])
        return state, Line(jnp.where(known, begin, jnp.nan), jnp.where(known, end, jnp.nan))


class Tank(Driven):
    r"""A tank that a valve fills from a supply and empties to an exhaust; input and output are gauge pressures [Pa].

    Isothermal air, orifice flow by ISO 6358:

    $$ \dot p = \frac{T R}{V} \dot m, \quad \dot m = \alpha\, C\, \rho_0\, p_1 \sqrt{T_0/T}\; \psi(p_2/p_1), \quad
       \psi = \sqrt{1 - \left(\frac{\max(r, b) - b}{1 - b}\right)^2} $$

    from the higher pressure p_1 to the lower one p_2, with the opening $\alpha = \min(1, |u - p|/\text{band})$.
    For choked flow the pressure rate is $C p_1 p_0 \sqrt{T/T_0}/V$, the upper limit for any command.
    """

    volume: Float[Array, ""]  # V [m3]
    conductance: Float[Array, ""]  # C [m3/(s Pa)], sonic, of the open valve
    critical: Float[Array, ""]  # b, pressure ratio below which the flow is choked
    supply: Float[Array, ""]  # [Pa], gauge
    exhaust: Float[Array, ""]  # [Pa], gauge; negative for a vacuum pump
    band: Float[Array, ""]  # pressure error at which the valve is fully open [Pa]
    temperature: Float[Array, ""]  # T [K]

    def initial(self) -> Float[Array, ""]:
        """Ambient pressure."""
        return jnp.zeros(())

    def rates(self, t: Float[Array, ""], x: Float[Array, ""], u: Any = None) -> Float[Array, ""]:
        """Rate of the pressure [Pa/s]."""
        error = jnp.clip((u - x) / self.band, -1.0, 1.0)
        filled = self._flow(self.supply, x)
        emptied = self._flow(x, self.exhaust)
        return jnp.where(error > 0, error * filled, error * emptied)

    def output(self, x: Float[Array, ""], u: Float[Array, ""]) -> Float[Array, ""]:
        """The pressure."""
        return x

    def _flow(self, high: Array, low: Array) -> Array:
        """Pressure rate through an open valve between gauge pressures; 0 for a reversed difference."""
        ratio = (low + _AMBIENT) / (high + _AMBIENT)
        x = (jnp.clip(ratio, self.critical, 1.0) - self.critical) / (1 - self.critical)
        squared = 1 - x**2
        psi = jnp.where(squared > 0, jnp.sqrt(jnp.where(squared > 0, squared, 1.0)), 0.0)
        rate = self.conductance * (high + _AMBIENT) * _REFERENCE * jnp.sqrt(self.temperature / _NORMAL)
        return rate * psi / self.volume


_AMBIENT = 101_325.0  # ambient pressure [Pa]
_REFERENCE, _NORMAL = 1e5, 293.15  # of ISO 6358: pressure [Pa] and temperature [K] of the volume flow
