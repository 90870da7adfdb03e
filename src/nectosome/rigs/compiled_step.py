"""Compiled steps for the samples of an experiment, with as little time in a call as possible."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike

Step = Callable[..., tuple[Any, Array]]  # step(module, state, *inputs) -> (state, output)


class CompiledStep:
    """A module and its state, which advances with each call; compiled at once, for such `inputs`.

    `filter_jit` would flatten and unflatten both at every call, which takes three times as long as the call itself.
    Modules of one structure share a program.
    """

    def __init__(self, step: Step, module: Any, state: Any, *inputs: ArrayLike):
        moving, still = eqx.partition(module, lambda x: isinstance(x, jax.Array | np.ndarray))
        arrays, structure = jax.tree.flatten(moving)
        words, frame = jax.tree.flatten(still)
        self._arrays = [jnp.asarray(x) for x in arrays]
        self._program = _program(step, structure, frame, tuple(words), jax.tree.structure(state))
        self.start(state)
        for _ in range(2):  # the state after a step may have other types than the initial one
            self(*inputs)
        self.start(state)

    def start(self, state: Any) -> None:
        """Set the state."""
        self._state = jax.tree.leaves(state)

    def __call__(self, *inputs: ArrayLike) -> Array:
        """Take one step and return its output."""
        self._state, output = self._program(self._arrays, self._state, *inputs)
        return output


@lru_cache(maxsize=64)
def _program(step: Step, structure: Any, frame: Any, words: tuple[Any, ...], of_state: Any) -> Callable[..., Any]:
    def run(arrays: list[Array], state: list[Array], *inputs: ArrayLike) -> tuple[list[Array], Array]:
        module = eqx.combine(jax.tree.unflatten(structure, arrays), jax.tree.unflatten(frame, words))
        after, output = step(module, jax.tree.unflatten(of_state, state), *inputs)
        return jax.tree.leaves(after), output

    return jax.jit(run)
