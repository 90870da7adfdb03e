"""Sampled PID control: fixed gains, gains scheduled by the frequency of the reference, or by the speed of a motor."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .contract import ActuatorLimits, Controller, LoopData, Regulator
from .references import local_frequency

_FILTER = 10  # the derivative is filtered over K_d/(10 K_p)


class PID(Controller):
    r"""$$ u = u_f + K_p\, e + K_i \int e\, dt + K_d \frac{s}{1 + T_f s}\, e, \quad e = r - y $$

    sampled by backward differences; $T_f$ filters the noise of the derivative. Anti-windup: the integral stops while
    the command is saturated, in range or rate, and the error would drive it further. Bumpless start: the first command
    equals the held one, whatever the error; only the integral removes an error that exists at the start.
    """

    proportional: Float[Array, ""]  # K_p, command per output
    integral: Float[Array, ""]  # K_i
    derivative: Float[Array, ""]  # K_d
    filtering: Float[Array, ""]  # T_f [s]
    limits: ActuatorLimits
    name = "pid"

    @classmethod
    def from_loop(cls, loop: LoopData) -> "PID":
        """That of `smooth_pid`."""
        return smooth_pid(loop.gains.row, loop.limits, loop.dt)

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Without feedforward: u_f = 0."""
        return self.with_feedforward(reference, jnp.zeros(len(reference)), dt)

    def with_feedforward(
        self, reference: Float[np.ndarray, "n"], feedforward: Float[Array, "n"], dt: float
    ) -> "PIDRegulator":
        """With a feedforward u_f at each sample."""
        gains = jnp.stack([self.proportional, self.integral, self.derivative])
        every = jnp.broadcast_to(gains, (len(reference), 3))
        r = jnp.asarray(reference, dtype=float)
        return PIDRegulator(r, feedforward, every, self.filtering, self.limits, dt)


class GainSchedule(Controller):
    """PID with gains by the local frequency of the reference: a table, interpolated over the logarithm of frequency."""

    frequencies: Float[Array, "m"]  # [Hz], growing
    gains: Float[Array, "m 3"]  # K_p, K_i, K_d
    filtering: Float[Array, ""]  # T_f [s]
    limits: ActuatorLimits
    name = "scheduled"
    scheduled = True

    @classmethod
    def from_loop(cls, loop: LoopData) -> "GainSchedule":
        """Rows of gains by frequency."""
        frequencies, rows = loop.gains.table
        filtering = smooth_pid(rows[0], loop.limits, loop.dt).filtering
        return cls(jnp.asarray(frequencies), jnp.asarray(rows), filtering, loop.limits)

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Gains at each sample; beyond the table those of its ends."""
        f = np.maximum(local_frequency(reference, dt), 1e-9)
        logs = jnp.log(self.frequencies)
        every = jnp.stack([jnp.interp(jnp.log(f), logs, column) for column in self.gains.T], axis=1)
        none = jnp.zeros(len(reference))
        return PIDRegulator(jnp.asarray(reference, dtype=float), none, every, self.filtering, self.limits, dt)


class VariableGainPI(Controller):
    r"""Speed loop of a geared motor, as on its microcontroller: a PI with higher gains at low speed.

    $$ u = k K_p\, e + \int k K_i\, e\, dt, \quad k = 1 + \beta\, e^{-|r|/w_0} $$

    with the reference r and the error e = r - y. Cogging and static friction are as strong at low speed as at high
    speed. At high speed the inertia overcomes them; at low speed a high gain must. High gains at high speed would
    amplify the noise of the encoder. Limits, anti-windup and bumpless changes of gain are those of a PID.
    """

    proportional: Float[Array, ""]  # K_p, command per rad/s
    integral: Float[Array, ""]  # K_i, command per rad
    boost: Float[Array, ""]  # beta, relative increase of the gains at rest
    low: Float[Array, ""]  # w_0, speed over which the increase decays [rad/s]
    limits: ActuatorLimits

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> "PIDRegulator":
        """Gains at each sample."""
        r = jnp.asarray(reference, dtype=float)
        k = 1 + self.boost * jnp.exp(-jnp.abs(r) / self.low)
        none = jnp.zeros_like(r)
        gains = jnp.stack([k * self.proportional, k * self.integral, none], axis=1)
        return PIDRegulator(r, none, gains, jnp.zeros(()), self.limits, dt)


class PIDState(NamedTuple):
    """State of a PID between two samples."""

    k: Array
    integral: Array
    derivative: Array
    error: Array
    gain: Array  # K_p of the previous sample
    command: Array


class PIDRegulator(Regulator):
    """PID along a reference, with a feedforward and gains for each sample."""

    reference: Float[Array, "n"]
    feedforward: Float[Array, "n"]
    gains: Float[Array, "n 3"]
    filtering: Float[Array, ""]
    limits: ActuatorLimits
    dt: float = eqx.field(static=True)

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> PIDState:
        """The integral starts at the command less feedforward and proportional part."""
        command, error = jnp.asarray(command, dtype=float), self.reference[0] - measured
        kp = self.gains[0, 0]
        integral = command - self.feedforward[0] - kp * error
        return PIDState(jnp.zeros((), dtype=int), integral, jnp.zeros(()), error, kp, command)

    def step(self, state: PIDState, measured: Float[Array, ""]) -> tuple[PIDState, Float[Array, ""]]:
        """One sample. Where K_p changes, the integral takes up the jump of the proportional part."""
        k = jnp.minimum(state.k, len(self.reference) - 1)
        kp, ki, kd = self.gains[k]
        error = self.reference[k] - measured
        derivative = (self.filtering * state.derivative + kd * (error - state.error)) / (self.filtering + self.dt)
        integral = state.integral - (kp - state.gain) * state.error
        more = ki * self.dt * error
        unlimited = self.feedforward[k] + kp * error + integral + more + derivative
        command = self.limits.limit(unlimited, state.command, self.dt)
        integral = jnp.where((unlimited - command) * more > 0, integral, integral + more)
        return PIDState(state.k + 1, integral, derivative, error, kp, command), command


def pid_of(gains: Any, filtering: Float[ArrayLike, ""], limits: ActuatorLimits) -> PID:
    """PID of the gains K_p, K_i, K_d in a row, and the filter time T_f [s] of the derivative."""
    kp, ki, kd = jnp.asarray(gains, dtype=float)
    return PID(kp, ki, kd, jnp.asarray(filtering, dtype=float), limits)


def smooth_pid(gains: Float[np.ndarray, "3"], limits: ActuatorLimits, dt: float) -> PID:
    """PID of these gains; its derivative filter is K_d/(10 K_p)."""
    kp, _, kd = gains
    return pid_of(gains, kd / (_FILTER * kp) if kp else dt, limits)
