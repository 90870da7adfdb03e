"""Any block against recordings of what went in and came out."""

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Block
from nectosome.drives import respond
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .misfit import Misfit


class Response(NamedTuple):
    """What went into something and what came out of it, at even times, from rest."""

    name: str
    dt: float  # [s]
    input: Float[np.ndarray, "n *channels"]
    output: Float[np.ndarray, "n"]
    standard_error: float  # of the output, in its unit
    begin: int = 0  # samples from here on count; what comes before only brings the block to its state


def output_misfit(
    build: Callable[[Float[Array, "p"]], Block],
    ranges: Ranges,
    responses: Sequence[Response],
    hold: Literal["first", "zero"] = "first",
) -> Misfit:
    """Output errors of the block that `build` makes of parameters, with an exact Jacobian.

    What a fit, its identifiability, profiles and Levenberg-Marquardt take. Raises InputError for recordings whose
    lengths differ, with NaN or infinite samples, or without a standard error above 0.
    """
    for one in responses:
        if len(one.input) != len(one.output):
            raise InputError(f"{len(one.input)} inputs and {len(one.output)} outputs.", field=one.name)
        if not 0 <= one.begin < len(one.output):
            raise InputError(f"counts from sample {one.begin} on, and has {len(one.output)}.", field=one.name)
        if not (np.isfinite(one.input).all() and np.isfinite(one.output).all()):
            raise InputError("has samples that are NaN or infinite.", field=one.name)
        if not one.standard_error > 0:
            raise InputError(f"the standard error is {one.standard_error:g}; it must be more than 0.", field=one.name)
    if not responses:
        raise InputError("there is no recording to fit.", field="responses")

    def residuals(theta: Array) -> Array:
        block = build(theta)
        parts = [
            (respond(block, jnp.asarray(one.input), one.dt, hold) - one.output)[one.begin :] / one.standard_error
            for one in responses
        ]
        return jnp.concatenate(parts)

    several: Any = jax.jit(jax.vmap(residuals))
    jacobian: Any = jax.jit(jax.jacfwd(residuals))
    return Misfit(lambda rows: np.asarray(several(rows)), ranges, lambda theta: np.asarray(jacobian(theta)))
