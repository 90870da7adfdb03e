"""Rows of arrays by constant indices, and things of one structure with their numbers stacked along a first axis.

What is alike goes through one vectorised call: a copy of it adds a row to its arrays, and no equation.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.core import Tracer
from jaxtyping import Array, Int

T = TypeVar("T")


def on_device(x: Any) -> Array:
    """A number, or an array of NumPy, as an array of JAX; `jnp.asarray` compiles a program for it."""
    with jax.ensure_compile_time_eval():
        return jax.device_put(np.asarray(x))


def all_on_device(*xs: Any) -> list[Array]:
    """The same of several, in one transfer."""
    with jax.ensure_compile_time_eval():
        return jax.device_put([np.asarray(x) for x in xs])


def rows(x: Array, index: Int[np.ndarray, "*shape"]) -> Array:
    """x[index] along the first axis, by indices from 0 on that are known while tracing: one operation."""
    flat = index.ravel()
    if not flat.size:
        return jnp.zeros((*index.shape, *x.shape[1:]))
    if np.array_equal(flat, np.arange(flat[0], flat[0] + flat.size)):
        part = x if flat.size == x.shape[0] else lax.slice_in_dim(x, int(flat[0]), int(flat[-1]) + 1)
        return part if index.ndim == 1 else part.reshape(*index.shape, *x.shape[1:])
    whole = lax.GatherDimensionNumbers(
        offset_dims=tuple(range(index.ndim, index.ndim + x.ndim - 1)), collapsed_slice_dims=(0,), start_index_map=(0,)
    )
    return lax.gather(
        x, index[..., None].astype(np.int32), whole, (1, *x.shape[1:]), mode=lax.GatherScatterMode.PROMISE_IN_BOUNDS
    )


def joined(parts: Sequence[Array]) -> Array:
    """Arrays one behind the other along the first axis."""
    return parts[0] if len(parts) == 1 else lax.concatenate(list(parts), 0)


class Spread:
    """Where rows go that are added up: those of each contribution to its `places` among n.

    XLA adds to scattered places one by one; this gathers the contributions of each place and sums them.
    """

    def __init__(self, n: int, *places: Int[np.ndarray, "..."]):
        targets = np.concatenate([np.zeros(0, int), *(place.ravel() for place in places)])
        order = np.argsort(targets, kind="stable")
        counts = np.bincount(targets, minlength=n)
        self._none = targets.size
        self.index = np.full((n, counts.max(initial=0)), self._none)
        place = np.arange(targets.size) - np.repeat(np.cumsum(counts) - counts, counts)
        self.index[targets[order], place] = order

    def __call__(self, parts: Sequence[Array], like: tuple[int, ...] = ()) -> Array:
        """Sums [n, *row] of the rows of `parts`, in the order of the places; without any, zeros of rows `like`."""
        n, most = self.index.shape
        like = parts[0].shape[1:] if parts else like
        if most == 0:
            return jnp.zeros((n, *like))
        whole = not np.any(self.index == self._none)
        gathered = rows(joined([*parts] if whole else [*parts, jnp.zeros((1, *like))]), self.index)
        return gathered[:, 0] if most == 1 else jnp.sum(gathered, axis=1)


def stacked(things: Sequence[T]) -> T:
    """One thing with the numbers of all, which have one structure, along a first axis."""

    def stack(*numbers: Any) -> Array:
        if any(isinstance(x, Tracer) for x in numbers):
            return jnp.stack(numbers)
        return on_device(np.stack([np.asarray(x) for x in numbers]))

    return jax.tree.map(stack, *things)


def part_of(things: T, place: Any) -> T:
    """Some of stacked things, by an index; numbers that are not traced are taken out without a program."""
    return jax.tree.map(lambda x: x[place] if isinstance(x, Tracer) else on_device(np.asarray(x)[place]), things)


class Alike(eqx.Module, Generic[T]):
    """Things of one structure, and their indices among all things."""

    members: tuple[int, ...] = eqx.field(static=True)
    things: T  # stacked

    def map(self, f: Callable[..., Any], *args: Any) -> Any:
        """f(thing, *its arguments) of all, the arguments and the results stacked."""
        return jax.vmap(f, axis_size=len(self.members))(self.things, *args)


def alike(things: Mapping[int, T], kind: Callable[[int], Any] = lambda i: None) -> tuple[Alike[T], ...]:
    """Things by their indices in groups of one structure, of numbers of one shape, and of one `kind`."""
    groups: dict[Any, list[int]] = {}
    for i, thing in things.items():
        leaves, structure = jax.tree.flatten(thing)
        key = structure, tuple((jnp.shape(x), jnp.result_type(x)) for x in leaves), kind(i)
        groups.setdefault(key, []).append(i)
    return tuple(Alike(tuple(some), stacked([things[i] for i in some])) for some in groups.values())
