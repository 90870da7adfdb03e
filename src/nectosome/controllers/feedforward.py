"""Feedforward by the inverse of a model, and iterative learning control, which corrects it by the errors of each run.

The inverse: inverse dynamics by derivatives of the reference, then inverse hysteresis.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.signal import savgol_coeffs

from nectosome.core import RateIndependent
from nectosome.drives import PrandtlIshlinskii, TransferFunction, inverse, respond
from nectosome.units import InputError, show_quantity

from .contract import Controller, Regulator
from .pid import PID, ActuatorLimits

SMOOTHING = 0.08  # s, over which references are smoothed: no actuator tracks a corner exactly
_FAST_SHARE = 0.05  # of the time in which the rate may exceed the slew limit: corners, and starts from rest
_HALVINGS = 12


class HystereticModel(eqx.Module):
    """Model of an actuator, for its inverse: hysteresis, dynamics without zeros, and the delay of the loop."""

    hysteresis: RateIndependent
    inverse: RateIndependent  # of the hysteresis
    dynamics: TransferFunction
    delay: Float[Array, ""]  # from a command to its effect [s]

    def __check_init__(self):
        if self.dynamics.numerator.shape[0] != 1:
            raise ValueError("dynamics with zeros have no inverse made of derivatives alone.")
        if self.dynamics.denominator.shape[0] > 4:
            raise ValueError("dynamics of an order above 3 need derivatives that cubics do not have.")

    def dynamics_input(self, reference: Float[Array, "n"], dt: float, width: float) -> Float[Array, "n"]:
        r"""Input of the dynamics for an output that equals the reference: $v = (a_n r^{(n)} + \dots + a_0 r)/b_0$.

        Derivatives are those of cubics fitted to `width` [s] around each sample.
        """
        a = self.dynamics.denominator[::-1] / self.dynamics.numerator[0]
        kernels = smoothing(width, dt, a.shape[0] - 1)
        return convolved(jnp.sum(a[:, None] * kernels, axis=0), reference)

    def command(self, dynamics_input: Float[Array, "n"], dt: float) -> Float[Array, "n"]:
        """The command that gives this input of the dynamics, sent earlier by the delay and half a hold interval."""
        return respond(self.inverse, self.advanced(dynamics_input, dt), dt)

    def advanced(self, x: Float[Array, "n"], dt: float) -> Float[Array, "n"]:
        """Samples of x from later times, by the delay and half a hold interval."""
        k = jnp.arange(x.shape[0])
        return jnp.interp(k + self.delay / dt + 0.5, k, x)


def hysteretic(
    hysteresis: PrandtlIshlinskii, dynamics: TransferFunction, delay: Float[ArrayLike, ""]
) -> HystereticModel:
    """A model with the inverse of its hysteresis. Raises InputError where that does not exist."""
    return HystereticModel(hysteresis, inverse(hysteresis), dynamics, jnp.asarray(delay, dtype=float))


class Feedforward(Controller):
    """PID beside the inverse of a model; the PID corrects the errors of the model."""

    pid: PID
    model: HystereticModel
    width: float = eqx.field(static=True)  # over which the reference is smoothed [s]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Inverse of the model along the reference, and after its end until the smoothed reference is constant."""
        longer = np.pad(np.asarray(reference, dtype=float), (0, half_window(self.width, dt)), mode="edge")
        needed = self.model.dynamics_input(jnp.asarray(longer), dt, self.width)
        held = self.model.dynamics_input(jnp.full(len(longer), longer[0]), dt, self.width)[:1]
        # begins from rest: what comes first is no offset of all that follows
        feedforward = self.model.command(needed, dt).at[0].set(self.model.command(held, dt)[0])
        return self.pid.with_feedforward(longer, feedforward, dt)


class Learned(Controller):
    """PID beside a feedforward that was learned for one reference."""

    pid: PID
    feedforward: Float[Array, "n"]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Raises InputError for a reference of another length than the one it was learned for."""
        if len(reference) != self.feedforward.shape[0]:
            message = f"has {len(reference)} samples; the feedforward was learned for {self.feedforward.shape[0]}."
            raise InputError(message, field="reference")
        return self.pid.with_feedforward(reference, self.feedforward, dt)


class Learner(NamedTuple):
    """A controller for the first run along a reference, and how its feedforward is corrected after each run."""

    first: Feedforward
    dt: float  # between samples [s]
    width: float  # over which errors are smoothed [s]
    share: float  # gamma, by which errors are corrected

    def after(self, record: Any) -> Learned:
        """Controller of the next run; `record` has reference, measured and command of the last one (see `learned`)."""
        return learned(self.first.pid, self.first.model, record, self.dt, self.width, self.share)


def learned(pid: PID, model: HystereticModel, record: Any, dt: float, width: float, share: float = 1.0) -> Learned:
    r"""Controller of the next run: $H(u_{j+1}) = Q\,[H(u_j)] + \gamma\, G^{-1} Q\, e_j$.

    H and G are hysteresis and dynamics of the model, Q smooths over `width` [s] without lag, $u_j$ is the whole command
    of run j, feedback included, $e_j = r - y$ its measured error, and gamma the `share`. From run to run errors are
    multiplied by $Q\,S\,(1 - \gamma\,G_0/G)$, with the sensitivity S of the loop and the dynamics G_0 of the actuator:
    with a share of a half, a loop that more than doubles some disturbance makes it grow. `record` has reference,
    measured and command, of a simulation or of a rig.
    """
    error = jnp.asarray(record.reference) - jnp.asarray(record.measured)
    correction = model.advanced(model.dynamics_input(error, dt, width), dt)
    smooth = convolved(smoothing(width, dt, 0)[0], respond(model.hysteresis, jnp.asarray(record.command), dt))
    found = respond(model.inverse, smooth + share * correction, dt)
    return Learned(pid, found.at[0].set(record.command[0]))


def check_reachable(
    model: HystereticModel,
    limits: ActuatorLimits,
    reference: Float[np.ndarray, "n"],
    dt: float,
    dimensions: tuple[str, str] = ("pressure", "length"),
) -> None:
    """Raise InputError where a reference needs commands beyond the limits, or beyond the slew rate for 5 % of the time.

    The message has the command that is needed, and the largest amplitude of this reference that is possible.
    `dimensions` are those of command and output.
    """
    problem = _beyond_limits(model, limits, reference, dt, dimensions[0])
    if not problem:
        return
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        beyond = _beyond_limits(model, limits, middle * reference, dt, dimensions[0])
        low, high = (low, middle) if beyond else (middle, high)
    size = show_quantity(low * float(np.ptp(reference)) / 2, dimensions[1])
    raise InputError(f"{problem}. This reference is possible up to an amplitude of {size}.", field="reference")


def _beyond_limits(
    model: HystereticModel, limits: ActuatorLimits, reference: Float[np.ndarray, "n"], dt: float, dimension: str
) -> str:
    """The command that is needed and not possible, in words, or ""."""
    needed = model.dynamics_input(jnp.asarray(reference, dtype=float), dt, SMOOTHING)
    command = np.asarray(model.command(needed, dt))
    low, high, slew = (float(x) for x in (limits.low, limits.high, limits.slew))
    beyond = np.maximum(command - high, low - command)
    # the first of periods that are equal but for rounding
    k = int(np.argmax(beyond >= beyond.max() - 1e-9 * (high - low)))
    if not low <= command[k] <= high:
        ends = f"{show_quantity(low, dimension)} to {show_quantity(high, dimension)}"
        return f"it needs {show_quantity(command[k], dimension)} at {k * dt:.3g} s, beyond the limits of {ends}"
    rates = np.abs(np.diff(command)) / dt
    if np.mean(rates > slew) > _FAST_SHARE:
        fast = show_quantity(float(np.quantile(rates, 1 - _FAST_SHARE)), dimension)
        most = show_quantity(slew, dimension)
        return f"it needs more than {fast} a second for 5 % of the time, beyond the slew limit of {most} a second"
    return ""


def half_window(width: float, dt: float) -> int:
    """Samples to either side in the window of a smoothed sample."""
    return max(round(0.5 * width / dt), 2)


def smoothing(width: float, dt: float, order: int) -> Float[np.ndarray, "order+1 window"]:
    """Kernels of values and derivatives up to an order, by cubics over a window (Savitzky and Golay 1964)."""
    window = 2 * half_window(width, dt) + 1
    return np.stack([savgol_coeffs(window, 3, deriv=k, delta=dt) for k in range(order + 1)])


def convolved(kernel: Float[ArrayLike, "window"], x: Float[Array, "n"]) -> Float[Array, "n"]:
    """Convolution of x with a kernel; beyond its ends x is constant."""
    half = jnp.asarray(kernel).shape[0] // 2
    return jnp.convolve(jnp.pad(x, half, mode="edge"), jnp.asarray(kernel), mode="valid")
