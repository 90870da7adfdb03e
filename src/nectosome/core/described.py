"""From a description to arrays, traced or not: its numbers, and the classes that say which description they are of."""

from dataclasses import fields
from typing import Any, ClassVar, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.io.discovery import classes_below

T = TypeVar("T")


def number(x) -> Float[Array, ""]:
    """A number of a description; one that JAX does not hold yet compiles nothing."""
    return jnp.asarray(x if isinstance(x, Array) else np.asarray(x, dtype=float), dtype=float)


def vector(xs) -> Float[Array, "n"]:
    """Numbers of a description; long rows of them are arrays already."""
    if isinstance(xs, Array):
        return xs
    return jnp.stack([number(x) for x in xs])


def unit(xs) -> Float[Array, "3"]:
    """An axis, one long."""
    axis = vector(xs)
    return axis / jnp.sqrt(jnp.sum(axis * axis))


def is_zero(x) -> bool:
    """Whether a number is plainly zero, so that what it stands for is left out."""
    return isinstance(x, float | int) and x == 0


def numbers(described: Any, *names: str) -> dict[str, Array]:
    """Numbers and rows of numbers of a description by name."""
    values = {name: getattr(described, name) for name in names}
    return {n: (vector if isinstance(x, tuple) or jnp.ndim(x) else number)(x) for n, x in values.items()}


def same_named(cls: type[T], described: Any) -> T:
    """An instance of a class whose fields are all numbers, of the fields of the same names in a description."""
    return cls(**numbers(described, *(field.name for field in fields(cls))))  # pyright: ignore[reportArgumentType]


class DescribedModule(eqx.Module):
    """What a robot file describes, such as a load, a joint or a signal: `described_by` is the class that does."""

    described_by: ClassVar[type]

    @classmethod
    def from_description(cls: type[T], described: Any, *args: Any, **kwargs: Any) -> T:
        """What is described; if nothing else is defined, made of the fields of the same names."""
        return same_named(cls, described)


def class_for(described: Any, *bases: type[T]) -> type[T]:
    """The class below some bases that is `described_by` the class of a description, or by the nearest one above it."""
    every = [cls for base in bases for cls in classes_below(base)]
    known = {cls.__dict__["described_by"]: cls for cls in every if "described_by" in cls.__dict__}
    return next(known[cls] for cls in type(described).__mro__ if cls in known)
