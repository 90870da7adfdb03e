r"""What of a closed surface of triangles is under the water's flat surface, exactly.

In the body's own axes let u be the vector upwards and d the depth of the body's origin: a point x is at the depth
$s = d - u \cdot x$. All of hydrostatics is in one number, the integral of the depth over the volume under water,

$$ E(d, u) = \int_{s > 0} s\, dV = -\frac{1}{2 |u|^2} \sum_T (u \cdot n_T)\, A_T\, \overline{s_+^2} $$

by Gauss's theorem: a sum over the triangles of the body (normal n, area A) with the mean of $s_+^2$ on each, which
vanishes on the water's surface. That mean is a polynomial of the depths of the corners, piece by piece, so that this is
exact for polyhedra. $\rho g E$ is the energy of the water that the body has raised to the surface. The rest are
derivatives, with the volume V under water and the waterplane's area $A_w$:

$$ \frac{\partial E}{\partial d} = V, \quad \frac{\partial E}{\partial u} = -\int x\, dV, \quad
   \frac{\partial^2 E}{\partial d^2} = A_w, \quad \frac{\partial^2 E}{\partial d\, \partial u} = -\int x\, dA_w, \quad
   \frac{\partial^2 E}{\partial u^2} = \int x x^T dA_w $$
"""

import jax.numpy as jnp
from jaxtyping import Array, Float


def raised(corners: Float[Array, "m 3 3"], depth: Float[Array, ""], up: Float[Array, "3"]) -> Float[Array, ""]:
    """E [m4] for the depth d [m] of the body's origin and the vector u upwards in the body's axes.

    The three corners [m] of each triangle run counter-clockwise as seen from outside.
    """
    a, b, c = (corners[:, k] for k in range(3))
    doubled = jnp.cross(b - a, c - a) @ up
    return -0.25 * jnp.sum(doubled * _mean_square(depth - corners @ up)) / (up @ up)


def _mean_square(depths: Float[Array, "m 3"]) -> Float[Array, "m"]:
    r"""Mean of $s_+^2$ over each triangle, s linear between its corners.

    It is $p^4 / (6 (p - q)(p - r))$ where only the corner p is under water, $(\sum_i s_i^2 + \sum_{i<j} s_i s_j)/6$
    where all are, and the second less the first where only the corner p is dry.
    """
    low, middle, high = _sorted(*jnp.moveaxis(depths, 1, 0))
    wet_corner, dry_corner = (high > 0) & (middle <= 0), (low < 0) & (middle > 0)
    p = jnp.where(wet_corner, high, jnp.where(dry_corner, low, 1.0))  # 1 and 0 where there is none
    q, r = jnp.where(wet_corner | dry_corner, middle, 0.0), jnp.where(wet_corner, low, jnp.where(dry_corner, high, 0.0))
    corner = p**4 / ((p - q) * (p - r))
    whole = low * (low + middle + high) + middle * (middle + high) + high**2
    return jnp.where(wet_corner, corner, jnp.where(high > 0, whole - jnp.where(dry_corner, corner, 0.0), 0.0)) / 6


def _sorted(a: Array, b: Array, c: Array) -> tuple[Array, Array, Array]:
    """Three rows in order. Derivatives take one side of a tie: those of minima and maxima would take half of each."""
    a, b = jnp.where(b < a, b, a), jnp.where(b < a, a, b)
    b, c = jnp.where(c < b, c, b), jnp.where(c < b, b, c)
    a, b = jnp.where(b < a, b, a), jnp.where(b < a, a, b)
    return a, b, c
