"""Linear algebra of small dense matrices without LAPACK: faster for a dozen unknowns, also under vmap."""

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float


def inverse(A: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Inverse by Gauss-Jordan elimination with row pivoting, after scaling of rows and columns by the diagonal.

    A singular matrix gives NaN or inf.
    """
    n = A.shape[0]
    if n == 0:
        return A
    diagonal = jnp.abs(jnp.diagonal(A))
    scale = 1 / jnp.sqrt(jnp.where(diagonal > 0, diagonal, 1.0))
    rows = jnp.arange(n)

    def eliminate(k: Array, B: Array) -> Array:
        pivot = jnp.argmax(jnp.where(rows >= k, jnp.abs(B[:, k]), -1.0))
        upper, lower = B[k], B[pivot]
        B = B.at[pivot].set(upper).at[k].set(lower)
        row = lower / lower[k]
        column = jnp.where(rows == k, 0.0, B[:, k])
        return B.at[k].set(row) - column[:, None] * row

    start = jnp.concatenate([A * scale[:, None] * scale, jnp.eye(n)], axis=1)
    return lax.fori_loop(0, n, eliminate, start)[:, n:] * scale[:, None] * scale


def generalised_inverse(A: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Generalised inverse G with A G A = A: unknowns that a singular A does not determine are 0.

    Gauss-Jordan elimination with complete pivoting, after scaling of rows and columns by their largest elements; pivots
    below 1e-11 count as zero.
    """
    n = A.shape[0]
    if n == 0:
        return A
    rows = 1 / _or_one(jnp.max(jnp.abs(A), axis=1))
    columns = 1 / _or_one(jnp.max(jnp.abs(A * rows[:, None]), axis=0))

    def eliminate(_: Array, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        B, solved_by = carry  # solved_by[j]: the row that gives unknown j, n if none
        spent = jnp.any(jnp.arange(n)[:, None] == solved_by, axis=1)
        open_ = (~spent)[:, None] & (solved_by == n)
        i, j = jnp.unravel_index(jnp.argmax(jnp.where(open_, jnp.abs(B[:, :n]), -1.0)), (n, n))
        fits = open_[i, j] & (jnp.abs(B[i, j]) > 1e-11)
        row = B[i] / jnp.where(fits, B[i, j], 1.0)
        new = (B - B[:, j, None] * row).at[i].set(row)
        return jnp.where(fits, new, B), jnp.where(fits, solved_by.at[j].set(i), solved_by)

    start = jnp.concatenate([A * rows[:, None] * columns, jnp.eye(n)], axis=1)
    B, solved_by = lax.fori_loop(0, n, eliminate, (start, jnp.full(n, n)))
    G = jnp.concatenate([B[:, n:], jnp.zeros((1, n))])[solved_by]
    return jnp.where(jnp.all(jnp.isfinite(A)), G * columns[:, None] * rows, jnp.nan)


def _or_one(x: Array) -> Array:
    return jnp.where(x > 0, x, 1.0)


def computed_once(x: Float[Array, "k *more"]) -> Float[Array, "k *more"]:
    """Return x times the unit matrix, so that XLA computes x only once.

    XLA recomputes elementwise expressions, sines included, in each kernel that uses them, but not matrix products.
    """
    return jnp.tensordot(jnp.eye(x.shape[0]), x, axes=1)
