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
        """State before the first sample: bumpless transfer from a held command and a measurement."""

    @abstractmethod
    def step(self, state: Any, measured: Float[Array, ""]) -> tuple[Any, Float[Array, ""]]:
        """State after a sample, and the command computed from its measurement."""


class Controller(eqx.Module):
    """Computes commands from measurements; `tests/controllers/test_controllers.py` holds every controller to it.

    A command depends on no later measurement. Structure is static, numbers are traced.
    """

    @abstractmethod
    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Regulator for a reference known in advance, in samples dt [s] apart; its last value holds after its end."""
