"""How far the motion of a found model is from a recording, be it one that was fitted or another."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from .linear import Trial, asked
from .motion import with_slopes


class Deviation(NamedTuple):
    """Measured minus computed state, in percent of the root mean square of the measured one."""

    mean: float  # signed
    std: float  # about that mean
    largest: float  # magnitude


def follow(trial: Trial, values: Float[np.ndarray, "k"]) -> Float[np.ndarray, "n"]:
    """The motion of a model with these parameters, from the first state of least squares to the samples."""
    what = asked(trial)

    def at(x0: Float[np.ndarray, "1"]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n k+1"]]:
        states, slopes = with_slopes(*what, values, x0[0])
        return np.asarray(states), np.asarray(slopes)

    how: Any = {"method": "lm", "jac": lambda x0: at(x0)[1][:, -1:]}
    found = least_squares(lambda x0: at(x0)[0] - trial.state, trial.state[:1], **how)
    return at(found.x)[0]


def deviation(measured: Float[np.ndarray, "n"], computed: Float[np.ndarray, "n"]) -> Deviation:
    """Errors of a motion against samples."""
    error = 100 * (measured - computed) / np.sqrt(np.mean(measured**2))
    return Deviation(float(np.mean(error)), float(np.std(error)), float(np.max(np.abs(error))))
