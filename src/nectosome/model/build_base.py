"""What building a robot starts from: numbers and vectors of a description as arrays, traced or not, and its signals."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Constant, Cycle, Rate, Recording, Signal, Sine, Stroke
from nectosome.mechanism import Link, SoftRod


def number(x) -> Float[Array, ""]:
    """A number of a description."""
    return jnp.asarray(x, dtype=float)


def vector(xs) -> Float[Array, "n"]:
    """Numbers of a description; long rows of them are arrays already."""
    if isinstance(xs, Array):
        return xs
    return jnp.stack([number(x) for x in xs])


def unit(xs) -> Float[Array, "3"]:
    """An axis, one long."""
    axis = vector(xs)
    return axis / jnp.sqrt(jnp.sum(axis * axis))


_SIGNALS = {
    "constant": Constant,
    "rate": Rate,
    "sine": Sine,
    "stroke": Stroke,
    "cycle": Cycle,
    "recording": Recording,
}


def signal(s) -> Signal:
    """A signal of a description."""
    numbers = {n: getattr(s, n) for n in type(s).model_fields if n != "kind"}
    one: dict[str, Array | None] = {
        n: (vector if isinstance(x, tuple) or jnp.ndim(x) else number)(x) for n, x in numbers.items()
    }
    if s.kind == "stroke" and is_zero(s.ramp):
        one["ramp"] = None
    return _SIGNALS[s.kind](**one)


def is_zero(x) -> bool:
    """Whether a number is plainly zero, so that what it stands for is left out."""
    return isinstance(x, float | int) and x == 0


def node(parent: Link | SoftRod, at: str | float) -> int:
    """Where on a part another one sits: -1 its tip, 0 its root, else a node of a rod."""
    if at == "tip":
        return -1
    if at == "root":
        return 0
    return parent.nodes.index(at) if isinstance(parent, SoftRod) else 0
