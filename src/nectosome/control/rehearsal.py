"""Gains that are rehearsed on the model of a robot, and made gentler as long as that follows better."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.core import Status
from nectosome.robots import Commanded

from .following import PLAIN, Measuring, follow
from .pid import PID, Reach, pid_of

_PACES = (1.0, 0.8, 0.65, 0.5, 0.4, 0.3)
_SMOOTH = 10  # the derivative of the error is cut off at K_d/(10 K_p)


def smooth_pid(gains: Float[np.ndarray, "3"], low: float, high: float, dt: float) -> PID:
    """PID of these gains whose command stays in a range, its derivative cut off at a tenth of K_d/K_p."""
    kp, _, kd = gains
    return pid_of(gains, kd / (_SMOOTH * kp) if kp else dt, Reach(*map(jnp.asarray, (low, high, np.inf))))


def gentler(
    robot: Commanded,
    gains: Float[np.ndarray, "3"],
    low: float,
    high: float,
    reference: Float[np.ndarray, "n"],
    measuring: Measuring = PLAIN,
    *,
    progress: Callable[[float], bool | None] | None = None,
) -> float | None:
    r"""Pace p at which a reference is followed best: with K_p p^2, K_i p^3 and K_d p, see `paced`.

    Gains from a relay are those of large motions. In small ones a quadratic drag vanishes, and what was well damped
    overshoots or swings for ever. So the reference is rehearsed, without noise, at slower and slower paces, until the
    integral of time times magnitude of error grows (Graham and Lathrop 1953): $\int t |e| dt$. None where `progress`
    returns False.
    """
    best, least = 1.0, np.inf
    for k, pace in enumerate(_PACES):
        told = None if progress is None else lambda share, k=k: progress((k + share) / len(_PACES))
        controller = smooth_pid(paced(gains, pace), low, high, robot.dt)
        run = follow(robot, controller, reference, measuring._replace(noise=0.0), progress=told)
        if run.status == Status.CANCELLED:
            return None
        error = float(np.sum(run.time * np.abs(run.output - run.reference)))
        if run.status == Status.SOLVED and error >= least:
            break
        if run.status == Status.SOLVED:
            best, least = pace, error
    return best


def paced(gains: Float[np.ndarray, "3"], pace: float) -> Float[np.ndarray, "3"]:
    """Gains that make the same motion slower in a plant that integrates twice: all times are longer by 1/p."""
    return gains * np.array([pace**2, pace**3, pace])
