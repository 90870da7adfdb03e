r"""Motions $\dot x = H(t, x, u(t)) \theta$ from sample to sample, and their slopes by parameters and first state."""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import runtime as runtime  # float64

Regressors = Callable[..., Array]  # (time, state, *inputs) -> [k], for JAX
Input = Callable[[np.ndarray], np.ndarray]  # of times [s], such as a spline through a recording
_STEPS = 4  # from sample to sample
_PLACES = np.linspace(0.0, 1.0, 2 * _STEPS + 1)  # between two samples, where inputs are asked for


def inputs_between(time: Float[np.ndarray, "n"], inputs: tuple[Input, ...]) -> tuple[Float[np.ndarray, "n-1 s"], ...]:
    """Inputs at all times that `motion` needs."""
    times = time[:-1, None] + np.diff(time)[:, None] * _PLACES
    return tuple(np.asarray(u(times), float) for u in inputs)


@partial(jax.jit, static_argnums=0)
def at_samples(
    regressors: Regressors, time: Float[Array, "n"], state: Float[Array, "n"], inputs: tuple[Float[Array, "n"], ...]
) -> Float[Array, "n k"]:
    """H at the samples."""
    return jax.vmap(regressors)(time, state, *inputs)


@partial(jax.jit, static_argnums=0)
def motion(
    regressors: Regressors,
    time: Float[Array, "n"],
    inputs: tuple[Float[Array, "n-1 s"], ...],
    theta: Float[Array, "k"],
    x0: Float[Array, ""],
) -> Float[Array, "n"]:
    """States at the times: the classical Runge-Kutta method in quarters of a sample."""

    def step(x: Array, ends: tuple[Array, ...]) -> tuple[Array, Array]:
        start, h, *u = ends
        h = h / _STEPS
        for q in range(_STEPS):

            def rate(place: int, x: Array, q: int = q) -> Array:
                return regressors(start + (q + place / 2) * h, x, *(one[2 * q + place] for one in u)) @ theta

            a = rate(0, x)
            b = rate(1, x + h / 2 * a)
            c = rate(1, x + h / 2 * b)
            x = x + h / 6 * (a + 2 * b + 2 * c + rate(2, x + h * c))
        return x, x

    _, states = jax.lax.scan(step, x0, (time[:-1], jnp.diff(time), *inputs))
    return jnp.concatenate([x0[None], states])


@partial(jax.jit, static_argnums=0)
def with_slopes(
    regressors: Regressors,
    time: Float[Array, "n"],
    inputs: tuple[Float[Array, "n-1 s"], ...],
    theta: Float[Array, "k"],
    x0: Float[Array, ""],
) -> tuple[Float[Array, "n"], Float[Array, "n k+1"]]:
    """The motion, and its derivatives by parameters and first state."""

    def both(p: Array) -> tuple[Array, Array]:
        x = motion(regressors, time, inputs, p[:-1], p[-1])
        return x, x

    slopes, states = jax.jacfwd(both, has_aux=True)(jnp.append(theta, x0))
    return states, slopes
