"""Numbers that a transformation of JAX traces, what is known of them before it runs, and values that it leaves out."""

from typing import Any, TypeVar

import jax
from jax.core import Tracer

T = TypeVar("T")


def traced(*trees: object) -> bool:
    """Whether a number in some trees is traced, by `jit`, `vmap` or a derivative."""
    return any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(trees))


def without_derivatives(tree: T) -> T:
    """The tree with its numbers held in derivatives, for what only decides."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x) if isinstance(x, Tracer) else x, tree)


def known(tree: T) -> T | None:
    """The tree with the values at which derivatives are taken, those of the first of a batch; None inside `jit`."""
    leaves, structure = jax.tree.flatten(tree)
    for i, leaf in enumerate(leaves):
        value: Any = leaf
        while isinstance(value, Tracer):
            of: Any = value
            if hasattr(of, "primal"):
                value = of.primal
            elif hasattr(of, "batch_dim"):
                first = of.batch_dim is not None
                value = jax.lax.index_in_dim(of.val, 0, of.batch_dim, keepdims=False) if first else of.val
            else:
                return None
        leaves[i] = value
    return jax.tree.unflatten(structure, leaves)


@jax.tree_util.register_pytree_node_class
class Untraced:
    """A value in a field of a pytree that is neither a leaf nor a part of its structure.

    Two trees that differ in it alone are the same to `jax.jit`: nothing is compiled anew. Whatever takes a tree apart
    and puts it together again (`jit`, `vmap`, `tree.map`, `eqx.tree_at`) leaves None in its place: a value never
    stays with a tree that has changed.
    """

    __slots__ = ("value",)

    def __init__(self, value: Any = None):
        self.value = value

    def __repr__(self) -> str:
        return f"Untraced({self.value!r})"

    def tree_flatten(self) -> tuple[tuple[()], None]:
        """No leaves, no structure."""
        return (), None

    @classmethod
    def tree_unflatten(cls, structure: None, leaves: tuple[()]) -> "Untraced":
        """Without the value."""
        return cls()
