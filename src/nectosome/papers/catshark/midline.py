r"""From what a midline does to the curvatures that a rod is made to take.

With the arc length s in body lengths, from side to side A(s), and the wavelength $\lambda$,

$$ y = \tfrac12 A(s) \sin(2\pi(f t - s/\lambda)), \quad \kappa = y'' $$

to first order in the slope. The rod's recoil adds a motion as of a rigid body, so that amplitudes are aimed at and come
out of the swim.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Complex, Float

from nectosome.core import Wave
from nectosome.mechanism.rods import legendre

_POINTS = 60  # of the Gauss rule


def curvature(
    s: Float[np.ndarray, "k"],
    head: Float[np.ndarray, "n 1"],
    tail: Float[np.ndarray, "n 1"],
    wavelength: Float[np.ndarray, "n 1"],
    power: int = 2,
) -> Complex[np.ndarray, "n k"]:
    r"""Curvature times L, c in $Im(c e^{i\omega t})$, of $A = head + (tail - head) s^{power}$; powers 1 and 2.

    Amplitudes along fish are of second degree (Goerig et al. 2021); that A has no slope at the head is assumed.
    """
    k, more = 2 * np.pi / wavelength, tail - head
    first, second = (power * s ** (power - 1), power * (power - 1) * np.ones_like(s))
    A, dA, ddA = head + more * s**power, more * first, more * second
    return 0.5 * (ddA - 2j * k * dA - k**2 * A) * np.exp(-1j * k * s)


def waves(
    order: int,
    frequency: Float[np.ndarray, "n"],
    head: Float[np.ndarray, "n"],
    tail: Float[np.ndarray, "n"],
    wavelength: Float[np.ndarray, "n"],
    power: int = 2,
) -> list[Wave]:
    """Strain coordinates of bending up to an order, by swim: (2 k + 1) int P_k L kappa ds, s from 0 to 1."""
    x, weight = np.polynomial.legendre.leggauss(_POINTS)
    s = 0.5 * (x + 1)
    basis = (2 * np.arange(order + 1) + 1) * legendre(order, s) * (0.5 * weight)[:, None]
    c = curvature(s, head[:, None], tail[:, None], wavelength[:, None], power) @ basis
    none = jnp.zeros(())
    return [
        Wave(
            amplitude=none + 1.0,
            frequency=jnp.asarray(f),
            phase=none,
            offset=none,
            envelope=jnp.zeros(order + 1),
            cosine=jnp.asarray(one.real),
            sine=jnp.asarray(-one.imag),
        )
        for f, one in zip(frequency, c, strict=True)
    ]
