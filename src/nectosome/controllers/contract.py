"""The contract of controllers."""

from abc import abstractmethod
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, ArrayLike, Float


class Regulator(eqx.Module):
    """A controller for one reference and one time between samples."""

    @abstractmethod
    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> Any:
        """State before the first sample; it takes over from a held command, and a measurement, without a bump."""

    @abstractmethod
    def step(self, state: Any, measured: Float[Array, ""]) -> tuple[Any, Float[Array, ""]]:
        """State after a sample, and the command that follows from its measurement."""


class Controller(eqx.Module):
    """What makes commands of measurements; `tests/controllers/test_controllers.py` holds every controller to it.

    A command depends on no later measurement. Structure is static, numbers are traced.
    """

    @abstractmethod
    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Ready for a reference, known beforehand in samples dt [s] apart; its last value is held after its end."""
