"""Whether an actuator can follow a reference at all, asked of its model before anything moves."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, show_quantity

from .feedforward import HystereticModel
from .pid import ActuatorLimits

_WIDTH = 0.08  # s, over which the reference is smoothed: corners are never followed to the point
_JUMPS = 0.05  # of the time, in which the rate may be too high: corners, and starts from rest
_HALVINGS = 12


def check_reachable(
    model: HystereticModel,
    reach: ActuatorLimits,
    reference: Float[np.ndarray, "n"],
    dt: float,
    kinds: tuple[str, str] = ("pressure", "length"),
) -> None:
    """Raise InputError where the reference needs commands out of range, or faster than they can be for 5 % of the time.

    The message says what it needs, and which share of the reference can be reached; `kinds` are the dimensions of
    command and output.
    """
    told = _needs(model, reach, reference, dt, kinds[0])
    if not told:
        return
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _needs(model, reach, middle * reference, dt, kinds[0]) else (middle, high)
    size = show_quantity(low * float(np.ptp(reference)) / 2, kinds[1])
    raise InputError(f"{told}. With this course it can have an amplitude of {size}.", field="reference")


def _needs(
    model: HystereticModel, reach: ActuatorLimits, reference: Float[np.ndarray, "n"], dt: float, kind: str
) -> str:
    """What it needs that there is not, or ""."""
    driven = model.driven(jnp.asarray(reference, dtype=float), dt, _WIDTH)
    command = np.asarray(model.command(driven, dt))
    low, high, slew = (float(x) for x in (reach.low, reach.high, reach.slew))
    beyond = np.maximum(command - high, low - command)
    # the first of periods that are alike but for rounding
    k = int(np.argmax(beyond >= beyond.max() - 1e-9 * (high - low)))
    if not low <= command[k] <= high:
        there = f"{show_quantity(low, kind)} to {show_quantity(high, kind)}"
        return f"it needs {show_quantity(command[k], kind)} at {k * dt:.3g} s; {there} are there"
    rates = np.abs(np.diff(command)) / dt
    if np.mean(rates > slew) > _JUMPS:
        fast = show_quantity(float(np.quantile(rates, 1 - _JUMPS)), kind)
        return f"it needs {fast} a second and more for 5 % of the time; {show_quantity(slew, kind)} a second are there"
    return ""
