r"""Friction of cords that run over bends (the capstan equation, Euler 1769; Eytelwein 1808).

Over a bend by the angle $\theta$ a cord that slides towards the end that pulls it has the tension $T e^{-\mu \theta}$
beyond the bend, one that slides away from it $T e^{\mu \theta}$: $T e^{-\mu s \theta}$ with a direction s from -1 to 1.
At rest friction may hold any tension between the two. Here it is that of the direction in which the cord slid last when
it was drawn from the straight shape, $s_0$. With the speed u of sliding over a chosen one of 1 mm/s, and
$x = \tanh(u / u_0)$, $s = x |x| + (1 - x^2) s_0$: smooth, $\pm 1$ in motion and $s_0$ at rest.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

_SLIDING = 1e-3  # u_0 [m/s]: chosen, far below the speeds of tendons that move something
_STRAIGHT = 1e-4  # [rad] below which the bend sets in smoothly: changes a tension by less than mu times this


def bend(squared: Float[Array, "*n"], length: Array | float = 1.0) -> Float[Array, "*n"]:
    """Size of an angle by its square, or of a curvature over a length [m], with a derivative of 0 at 0."""
    straight = _STRAIGHT / length
    return jnp.sqrt(squared + straight**2) - straight


def direction(speed: Float[Array, "*n"], at_rest: Array | float) -> Float[Array, "*n"]:
    """Direction s of friction at a speed [m/s] towards the end that pulls, and with `at_rest` at none."""
    x = jnp.tanh(speed / _SLIDING)
    return x * jnp.abs(x) + (1 - x**2) * at_rest
