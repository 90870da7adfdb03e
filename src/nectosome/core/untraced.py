"""A value that goes with a pytree and is no part of it."""

from typing import Any

import jax


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
