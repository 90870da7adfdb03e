"""Iterative learning control: the same reference again, with a feedforward corrected by the errors of the last run."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.drives import respond
from nectosome.units import InputError

from .contract import Controller, Regulator
from .feedforward import Feedforward, HystereticModel, convolved, smoothing
from .pid import PID


class Learned(Controller):
    """PID beside a feedforward that was learned for one reference."""

    pid: PID
    feedforward: Float[Array, "n"]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Raises InputError for a reference of another length than the one it was learned for."""
        if len(reference) != self.feedforward.shape[0]:
            learned_for = f"the feedforward was learned for {self.feedforward.shape[0]}"
            raise InputError(f"has {len(reference)} samples; {learned_for}.", field="reference")
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


def learned(
    pid: PID,
    model: HystereticModel,
    record: Any,
    dt: float,
    width: float,
    share: float = 1.0,
) -> Learned:
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
    return Learned(pid, respond(model.inverse, smooth + share * correction, dt))
