"""Gains that let many loops err least, by exact slopes through them."""

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

_ENOUGH = 1e-3  # of the first sum of squares: a step that gains less is the last


class Tuned(NamedTuple):
    """Gains, and what they are worth: rms errors of all lanes and references, by the range of each."""

    values: Float[np.ndarray, "p"]
    begun: float
    ended: float


def tune(
    make: Callable[[Float[Array, "p"]], Controller],
    ranges: Ranges,
    start: Float[np.ndarray, "p"],
    lanes: BlockLoop,
    references: Sequence[Float[np.ndarray, "n"]],
) -> Tuned:
    """Least squares of the errors of the output, in loops side by side (`scattered`): what is found suits all of them.

    `make` gives a controller of numbers within `ranges`; it is planned within the derivative. Each reference counts by
    the same weight. A local minimum.

    Raises InputError for a start outside of the ranges, a constant reference, or where the loop has no finite error at
    the start.
    """

    for reference in references:
        if np.ptp(reference) == 0:
            raise InputError(f"stays at {reference[0]:g}: errors are counted by its range.", field="references")

    def residuals(theta: Array) -> Array:
        controller = make(theta)
        return jnp.concatenate([_errors(lanes, controller, reference) for reference in references])

    several: Any = jax.jit(jax.vmap(residuals))
    slopes: Any = jax.jit(jax.jacfwd(residuals))
    misfit = Misfit(lambda rows: np.asarray(several(rows)), ranges, lambda theta: np.asarray(slopes(theta)))
    first = misfit.at(misfit.places(start)[None])[0]
    found = misfit.fit(start, gain=_ENOUGH * float(first @ first))
    begun, ended = (float(np.sqrt(x / len(references))) for x in (first @ first, found.chi2))
    return Tuned(found.theta, begun, ended)


def _errors(lanes: BlockLoop, controller: Controller, reference: Float[np.ndarray, "n"]) -> Float[Array, "lanes n"]:
    """Whose squares sum to the mean square error by the range of the reference."""
    regulator = controller.planned(reference, lanes.dt)
    error = (run_batch(lanes, regulator, reference).output - reference).ravel()
    return error / (np.ptp(reference) * np.sqrt(error.shape[0]))
