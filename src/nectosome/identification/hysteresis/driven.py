"""Pressure behind a valve and its plays, sample by sample."""

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Line
from nectosome.drives import PrandtlIshlinskii, Stiction

State = tuple[Float[Array, ""], Float[Array, ""], Float[Array, "k"]]  # of the valve, pressure, plays


def following(
    thresholds: Float[Array, "k"], most: Float[Array, ""], sticks: Stiction | None
) -> tuple[State, Callable[[State, Float[Array, ""]], tuple[State, Float[Array, "k+1"]]]]:
    """State at rest, and a step by a command to the next state with what unit slopes make of the pressure.

    The valve sticks, then follows at most so far from sample to sample. Unit slopes make differences of plays that
    follow each other, the pressure itself being the first.
    """
    plays = PrandtlIshlinskii(jnp.zeros(()), thresholds, jnp.zeros_like(thresholds))

    def step(state: State, command: Float[Array, ""]) -> tuple[State, Float[Array, "k+1"]]:
        stuck, before, widths = state
        if sticks is not None:
            stuck, command = sticks.at(stuck, command)
        p = jnp.clip(command, before - most, before + most)
        widths, _ = plays.step(widths, Line(p, p))
        return (stuck, p, widths), -jnp.diff(jnp.concatenate([p[None], widths, jnp.zeros(1)]))

    return (jnp.zeros(()), jnp.zeros(()), plays.initial()), step


def stiction_of(valve: Mapping[str, float]) -> Stiction | None:
    """Stiction of a valve; None where nothing of it was fitted."""
    names = "dead_band", "resolution"
    if not valve.keys() & names:
        return None
    return Stiction(*(jnp.asarray(valve.get(name, 0.0)) for name in names))


@eqx.filter_jit
def driven(
    pressure: Float[Array, "t n"], most: Float[Array, "t"], thresholds: Float[Array, "k"], sticks: Stiction | None
) -> Float[Array, "t n k+1"]:
    """What unit slopes make of the pressures of several recordings."""

    def one(pressure: Array, most: Array) -> Array:
        rest, step = following(thresholds, most, sticks)
        return jax.lax.scan(step, rest, pressure)[1]

    return jax.vmap(one)(pressure, most)


def padded(
    arrays: Sequence[Float[np.ndarray, "_ *k"]], mode: Literal["constant", "edge"] = "constant"
) -> Float[np.ndarray, "t n *k"]:
    """Arrays of one length: zeros, or with `edge` the last value, are put after shorter ones."""
    longest = max(map(len, arrays))
    ends = [[(0, longest - len(one)), *[(0, 0)] * (one.ndim - 1)] for one in arrays]
    return np.stack([np.pad(one, end, mode=mode) for one, end in zip(arrays, ends, strict=True)])


def earlier(arrays: Sequence[Float[np.ndarray, "_ *k"]], by: Sequence[int]) -> list[Float[np.ndarray, "_ *k"]]:
    """Arrays of the same lengths without their first samples, zeros behind."""
    return [np.concatenate([x[k:], np.zeros_like(x[:k])]) for x, k in zip(arrays, by, strict=True)]
