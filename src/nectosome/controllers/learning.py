"""Iterative learning: the same reference again, with a feedforward that the errors of the last time have mended."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.drives import respond
from nectosome.units import InputError

from .contract import Controller, Regulator
from .feedforward import HystereticModel, convolved, smoothing
from .pid import PID


class Learned(Controller):
    """PID beside a feedforward that was learned for one reference."""

    pid: PID
    feed: Float[Array, "n"]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Raises InputError for a reference of another length than the one it was learned for."""
        if len(reference) != self.feed.shape[0]:
            raise InputError(f"{len(reference)} samples; what was learned has {self.feed.shape[0]}.", field="reference")
        return self.pid.fed(reference, self.feed, dt)


def learned(
    pid: PID,
    model: HystereticModel,
    track: Any,
    dt: float,
    width: float,
    share: float = 1.0,
) -> Learned:
    r"""What follows better than the last time: $H(u_{j+1}) = Q\,[H(u_j)] + \gamma\, G^{-1} Q\, e_j$.

    H and G are the model's hysteresis and dynamics, Q smooths over `width` [s], with no lag, $u_j$ is the whole command
    of the last time, feedback included, $e_j = r - y$ what was measured then, and gamma the `share` of it that is
    believed. Each time errors become $Q\,S\,(1 - \gamma\,G_0/G)$ of what they were, with the loop's answer S to
    disturbances and the actuator's own dynamics G_0: by a share of a half, a loop that more than doubles some
    disturbance drives it up. `track` has reference, measured and command, of a simulation or of a rig.
    """
    error = jnp.asarray(track.reference) - jnp.asarray(track.measured)
    more = model.ahead(model.driven(error, dt, width), dt)
    drive = convolved(smoothing(width, dt, 0)[0], respond(model.hysteresis, jnp.asarray(track.command), dt))
    return Learned(pid, respond(model.undo, drive + share * more, dt))
