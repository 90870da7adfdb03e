"""Gains with the least errors over a batch of loops, by exact derivatives through them."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.identification.fits.misfit import Misfit
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .block_loop import BlockLoop, run_batch
from .contract import Controller

_LEAST_GAIN = 1e-3  # relative decrease of the sum of squares below which the search stops


class Tuned(NamedTuple):
    """Gains, and the rms error over all loops and references, relative to the range of each reference."""

    values: Float[np.ndarray, "p"]
    error_before: float
    error_after: float


def tune(
    make: Callable[[Float[Array, "p"]], Controller],
    ranges: Ranges,
    start: Float[np.ndarray, "p"],
    loops: BlockLoop,
    references: Sequence[Float[np.ndarray, "n"]],
) -> Tuned:
    """Least squares of the output errors over a batch of loops (such as `perturbed` plants); a local minimum.

    `make` maps numbers within `ranges` to a controller; planning is differentiated too. All references have the same
    weight.

    Raises InputError for a start outside of the ranges, a constant reference, and a loop whose error is not finite at
    the start.
    """

    for reference in references:
        if np.ptp(reference) == 0:
            message = f"is constant, {reference[0]:g}: errors are relative to its range, so it must vary."
            raise InputError(message, field="references")

    def residuals(theta: Array) -> Array:
        controller = make(theta)
        return jnp.concatenate([_errors(loops, controller, reference) for reference in references])

    batch: Any = jax.jit(jax.vmap(residuals))
    jacobian: Any = jax.jit(jax.jacfwd(residuals))
    misfit = Misfit(lambda rows: np.asarray(batch(rows)), ranges, lambda theta: np.asarray(jacobian(theta)))
    first = misfit.at(misfit.places(start)[None])[0]
    found = misfit.fit(start, gain=_LEAST_GAIN * float(first @ first))
    error_before, error_after = (float(np.sqrt(x / len(references))) for x in (first @ first, found.chi2))
    return Tuned(found.theta, error_before, error_after)


def _errors(loops: BlockLoop, controller: Controller, reference: Float[np.ndarray, "n"]) -> Float[Array, "m"]:
    """Residuals whose squares sum to the mean square error, relative to the range of the reference."""
    regulator = controller.planned(reference, loops.dt)
    error = (run_batch(loops, regulator, reference).output - reference).ravel()
    return error / (np.ptp(reference) * np.sqrt(error.shape[0]))
