"""Feedforward by the inverse of a model, and iterative learning control, which corrects it by the errors of each run.

The inverse: inverse dynamics by derivatives of the reference, then inverse hysteresis.
"""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.drives import respond
from nectosome.units import InputError, show_quantity

from .contract import ActuatorLimits, Controller, LoopData, Regulator
from .hysteretic_model import SMOOTHING, HystereticModel, convolved, half_window, smoothing
from .pid import PID

_SHARE, _MILD = 0.5, 0.5  # gamma; of the gains, as noise is learned
_FAST_SHARE = 0.05  # of the time in which the rate may exceed the slew limit: corners, and starts from rest
_HALVINGS = 12


class Feedforward(Controller):
    """PID beside the inverse of a model; the PID corrects the errors of the model."""

    pid: PID
    model: HystereticModel
    width: float = eqx.field(static=True)  # over which the reference is smoothed [s]
    name = "ff-pid"
    needs_model = True

    @classmethod
    def from_loop(cls, loop: LoopData) -> "Feedforward":
        """PID of the gains, beside the model of the loop."""
        assert loop.model is not None
        return cls(PID.from_loop(loop), loop.model, loop.pace.smoothing)

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


class Learner(Controller):
    """A feedforward, for the first run along a reference, that is corrected by the errors of each run."""

    first: Feedforward
    width: float = eqx.field(static=True)  # over which errors are smoothed [s]
    share: float = eqx.field(static=True)  # gamma, by which errors are corrected
    name = "ilc"
    needs_model = True
    learns = True

    @classmethod
    def from_loop(cls, loop: LoopData) -> "Learner":
        """With half of the gains, since noise is learned too."""
        milder = loop._replace(gains=loop.gains.times(_MILD))
        return cls(Feedforward.from_loop(milder), loop.pace.learning, _SHARE)

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """That of the first run."""
        return self.first.planned(reference, dt)

    def after(self, record: Any, dt: float) -> Learned:
        """See `learned`."""
        return learned(self.first.pid, self.first.model, record, dt, self.width, self.share)


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
    output = respond(model.inverse, smooth + share * correction, dt)
    return Learned(pid, output.at[0].set(record.command[0]))


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
