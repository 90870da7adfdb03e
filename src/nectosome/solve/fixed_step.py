"""Fixed-step integration: cheaper than adaptive steps for motion with frequent contacts."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import State, System

_NODES, _WEIGHTS = (0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)


def fixed_step(
    system: System,
    t: Float[Array, ""],
    x: State,
    step: Float[Array, ""],
    count: int,
    keep: Callable[[State], Any] | None = None,
) -> tuple[State, Any]:
    """State after `count` steps from (t, x) by the classical Runge-Kutta method, and `keep(state)` after each step.

    Works under jit, vmap and forward derivatives. There is no error control: halve the step to estimate the error.
    """

    def one(x: State, k: Array) -> tuple[State, Any]:
        def stage(carry: tuple[State, State], at: Array) -> tuple[tuple[State, State], None]:
            rate, new = carry
            rate = system.rates(t + (k + at[0]) * step, _ahead(x, rate, at[0] * step))
            return (rate, _ahead(new, rate, at[1] * step)), None

        none = jax.tree.map(jnp.zeros_like, x)
        (_, new), _ = jax.lax.scan(stage, (none, x), jnp.stack([jnp.array(_NODES), jnp.array(_WEIGHTS)], axis=1))
        return new, None if keep is None else keep(new)

    return jax.lax.scan(one, x, jnp.arange(count, dtype=float))


def _ahead(x: State, rate: State, h: Array) -> State:
    return jax.tree.map(lambda a, b: a + h * b, x, rate)
