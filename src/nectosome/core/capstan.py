r"""Friction of cords that run over bends (the capstan equation, Euler 1769; Eytelwein 1808).

Over a bend by the angle $\theta$ a cord that slides towards the end that pulls it has the tension $T e^{-\mu \theta}$
beyond the bend, one that slides away from it $T e^{\mu \theta}$: $T e^{-\mu s \theta}$ with a direction s from -1 to 1.
At rest friction holds any tension between the two: s is a state (`nectosome.core.dry_friction`), which tends to the
direction of sliding and stays without. What is held fades to $s_0$, that of a cord that was drawn from the straight
shape; so does an equilibrium have it.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

_STRAIGHT = 1e-4  # [rad] below which the bend sets in smoothly: changes a tension by less than mu times this


def bend(squared: Float[Array, "*n"], length: Array | float = 1.0) -> Float[Array, "*n"]:
    """Size of an angle by its square, or of a curvature over a length [m], with a derivative of 0 at 0."""
    straight = _STRAIGHT / length
    return jnp.sqrt(squared + straight**2) - straight
