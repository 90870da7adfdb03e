"""Derivatives in several directions at once: under vmap all directions at one point share what is computed of it."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp


def along(derivatives: Callable[..., Any], here: Any, *change: Any) -> Any:
    """Derivative at a point `here` (numbers and structure) along one change: that of `derivatives(here, *changes)`.

    `derivatives` takes and gives several changes at once, as leaves [k, ...]; None stands for no change. Under vmap
    over changes of one point it is called once, with all of them.
    """
    numbers, rest = eqx.partition(here, eqx.is_array)

    def several(numbers: Any, *changes: Any) -> Any:
        return derivatives(eqx.combine(numbers, rest), *changes)

    def one(numbers: Any, *change: Any) -> Any:
        return jax.tree.map(lambda s: s[0], several(numbers, *jax.tree.map(lambda d: d[None], change)))

    shared = jax.custom_batching.custom_vmap(one)

    @shared.def_vmap
    def _(k: int, batched: Any, numbers: Any, *changes: Any) -> tuple[Any, Any]:
        if any(jax.tree.leaves(batched[0])):
            out = jax.vmap(one, jax.tree.map(lambda b: 0 if b else None, tuple(batched)))(numbers, *changes)
        else:
            alike = lambda d, b: d if b else jnp.broadcast_to(d, (k, *d.shape))  # noqa: E731
            out = several(numbers, *jax.tree.map(alike, changes, tuple(batched[1:])))
        return out, jax.tree.map(lambda _: True, out)

    return shared(numbers, *change)
