"""A controller of one's own in a loop: a function of time, reference and measurement, or any controller, limited."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.units import InputError

from .contract import ActuatorLimits, Controller, Regulator

ControlFunction = Callable[[Array, Array, Array], Any]


class FunctionController(Controller):
    """A function of time [s], reference and measurement, in SI, that returns the command; JAX traces it."""

    function: ControlFunction = eqx.field(static=True)

    def __check_init__(self):
        number = jax.ShapeDtypeStruct((), float)
        message = "is no function of time, reference and measurement that JAX can trace"
        try:
            shape = jax.eval_shape(self.function, number, number, number)
        except TypeError as error:  # other arguments, or an `if` on what is traced
            why = str(error).partition("\n")[0].rstrip(".")
            raise InputError(f"{message}: {why}. Write jnp.where for if.", field="controller") from error
        if getattr(shape, "shape", None) != ():
            raise InputError(f"{message}: it returns {shape}, and one number is needed.", field="controller")

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """The function along the reference."""
        return _FunctionRegulator(jnp.asarray(reference, dtype=float), self.function, dt)


class _FunctionRegulator(Regulator):
    reference: Float[Array, "n"]
    function: ControlFunction = eqx.field(static=True)
    dt: float = eqx.field(static=True)

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> Any:
        """The number of the first sample."""
        return jnp.zeros((), dtype=int)

    def step(self, state: Any, measured: Float[Array, ""]) -> tuple[Any, Float[Array, ""]]:
        """One sample."""
        target = self.reference[jnp.minimum(state, len(self.reference) - 1)]
        return state + 1, jnp.asarray(self.function(state * self.dt, target, jnp.asarray(measured)), dtype=float)


class LimitedController(Controller):
    """A controller whose commands are kept within a range and a rate."""

    inner: Controller
    limits: ActuatorLimits

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """The inner controller, limited."""
        return _LimitedRegulator(self.inner.planned(reference, dt), self.limits, dt)

    def after(self, record: Any, dt: float) -> "LimitedController":
        """That of the inner controller."""
        return LimitedController(self.inner.after(record, dt), self.limits)


class _LimitedRegulator(Regulator):
    inner: Regulator
    limits: ActuatorLimits
    dt: float = eqx.field(static=True)

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> Any:
        """State of the inner regulator, and the held command."""
        return self.inner.initial(command, measured), jnp.asarray(command, dtype=float)

    def step(self, state: Any, measured: Float[Array, ""]) -> tuple[Any, Float[Array, ""]]:
        """One sample of the inner regulator."""
        inner, command = self.inner.step(state[0], measured)
        command = self.limits.limit(command, state[1], self.dt)
        return (inner, command), command
