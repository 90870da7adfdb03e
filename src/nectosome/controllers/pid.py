"""PID control by samples: of fixed gains, and of gains by the frequency of the reference."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .contract import Controller, Regulator
from .references import local_frequency


class ActuatorLimits(eqx.Module):
    """What commands may be, as the controller knows it."""

    low: Float[Array, ""]
    high: Float[Array, ""]
    slew: Float[Array, ""]  # rate at most [1/s of its unit]

    def within(self, wanted: Array, before: Array, dt: float) -> Array:
        """The command nearest to the wanted one that may follow the one before."""
        most = self.slew * dt
        return jnp.clip(jnp.clip(wanted, before - most, before + most), self.low, self.high)


class PID(Controller):
    r"""$$ u = u_f + K_p\, e + K_i \int e\, dt + K_d \frac{s}{1 + T_f s}\, e, \quad e = r - y $$

    sampled by backward differences; the derivative's noise is cut off by $T_f$. The integral stands still while the
    command is at the end of its reach and the error would drive it further. It begins without a bump, from the command
    that stands, whatever the error is then: only the integral takes away an error that there is from the beginning.
    """

    proportional: Float[Array, ""]  # K_p, command per output
    integral: Float[Array, ""]  # K_i
    derivative: Float[Array, ""]  # K_d
    filtering: Float[Array, ""]  # T_f [s]
    reach: ActuatorLimits

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Without feedforward: u_f = 0."""
        return self.fed(reference, jnp.zeros(len(reference)), dt)

    def fed(self, reference: Float[np.ndarray, "n"], feed: Float[Array, "n"], dt: float) -> "PIDRegulator":
        """With a feedforward."""
        gains = jnp.stack([self.proportional, self.integral, self.derivative])
        every = jnp.broadcast_to(gains, (len(reference), 3))
        return PIDRegulator(jnp.asarray(reference, dtype=float), feed, every, self.filtering, self.reach, dt)


class GainSchedule(Controller):
    """PID with gains by the local frequency of the reference, between those of a table on a logarithmic scale."""

    frequencies: Float[Array, "m"]  # [Hz], growing
    gains: Float[Array, "m 3"]  # K_p, K_i, K_d
    filtering: Float[Array, ""]  # T_f [s]
    reach: ActuatorLimits

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Gains at each sample; the ends of the table beyond it."""
        f = np.maximum(local_frequency(reference, dt), 1e-9)
        places = jnp.log(self.frequencies)
        every = jnp.stack([jnp.interp(jnp.log(f), places, column) for column in self.gains.T], axis=1)
        none = jnp.zeros(len(reference))
        return PIDRegulator(jnp.asarray(reference, dtype=float), none, every, self.filtering, self.reach, dt)


class PIDState(NamedTuple):
    """Between samples."""

    k: Array
    integral: Array
    derivative: Array
    error: Array
    gain: Array  # K_p of the sample before
    command: Array


class PIDRegulator(Regulator):
    """PID along a reference, with a feedforward and gains for each sample."""

    reference: Float[Array, "n"]
    feed: Float[Array, "n"]
    gains: Float[Array, "n 3"]
    filtering: Float[Array, ""]
    reach: ActuatorLimits
    dt: float = eqx.field(static=True)

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> PIDState:
        """The integral carries what the command is beyond feedforward and proportional part."""
        command, error = jnp.asarray(command, dtype=float), self.reference[0] - measured
        kp = self.gains[0, 0]
        left = command - self.feed[0] - kp * error
        return PIDState(jnp.zeros((), dtype=int), left, jnp.zeros(()), error, kp, command)

    def step(self, state: PIDState, measured: Float[Array, ""]) -> tuple[PIDState, Float[Array, ""]]:
        """A sample. When the gain changes the integral takes what the proportional part jumps by."""
        k = jnp.minimum(state.k, len(self.reference) - 1)
        kp, ki, kd = self.gains[k]
        error = self.reference[k] - measured
        derivative = (self.filtering * state.derivative + kd * (error - state.error)) / (self.filtering + self.dt)
        held = state.integral - (kp - state.gain) * state.error
        more = ki * self.dt * error
        wanted = self.feed[k] + kp * error + held + more + derivative
        command = self.reach.within(wanted, state.command, self.dt)
        integral = jnp.where((wanted - command) * more > 0, held, held + more)
        return PIDState(state.k + 1, integral, derivative, error, kp, command), command


def pid_of(gains: Any, filtering: Float[ArrayLike, ""], reach: ActuatorLimits) -> PID:
    """PID of three gains in a row."""
    kp, ki, kd = jnp.asarray(gains, dtype=float)
    return PID(kp, ki, kd, jnp.asarray(filtering, dtype=float), reach)
