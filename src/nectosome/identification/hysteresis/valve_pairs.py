r"""Sums of squares for many pairs of dead band and resolution of a valve at once, the best slopes for each.

All pairs go through the recordings side by side, valve, plays and dynamics sample by sample, in one compiled program.
It keeps no answers, only their products: with answers $\Phi$ by unit slopes of a pair, and residuals $r = y - \Phi w_0$
for slopes $w_0$ that are about right,

$$ |y - \Phi w|^2 = r^T r - 2\, r^T \Phi\, (w - w_0) + (w - w_0)^T \Phi^T \Phi\, (w - w_0) $$

which is as exact as the residuals are small. Derivatives by all other parameters are projected out first: these are
fitted to first order.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import nnls

from nectosome.drives import Stiction

from .driven import State, following

_AT_ONCE = 512  # pairs
_RIDGE = 1e-11  # of columns of length 1: slopes of plays that never move are 0


class Recorded(NamedTuple):
    """Recordings of one length, and what is known of their model but the pair; padded samples do not count."""

    pressure: Float[Array, "t n"]  # [Pa]
    most: Float[Array, "t"]  # change of the pressure from sample to sample [Pa]
    data: Float[Array, "t n"]  # displacement [m]
    counts: Float[Array, "t n"]  # 1, or 0 for a padded sample
    others: Float[Array, "t n q"]  # orthonormal columns that span derivatives by other parameters
    above: Float[Array, "t o+1"]  # filter of the dynamics
    line: Float[Array, "t o"]  # its state by the first sample, negative
    below: Float[Array, "t o+1"]
    thresholds: Float[Array, "k"]  # of the plays [Pa]
    slopes: Float[Array, "k+1"]  # w0 [m/Pa]


class _Products(NamedTuple):
    own: Float[Array, ""]  # r'r
    by_slopes: Float[Array, "k+1"]  # Phi'r
    slopes: Float[Array, "k+1 k+1"]  # Phi'Phi
    by_others: Float[Array, "q"]  # Q'r
    mixed: Float[Array, "q k+1"]  # Q'Phi


def sums_of_squares(of: Recorded, pairs: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "m"]:
    """Least sums of squares [m2] by dead band and resolution [Pa]."""
    size = min(_AT_ONCE, 1 << (len(pairs) - 1).bit_length())  # so few sizes that few programs are compiled
    out = []
    for k in range(0, len(pairs), size):
        part = pairs[k : k + size]
        padded = np.concatenate([part, np.repeat(part[-1:], size - len(part), axis=0)])
        found = _products(of, Stiction(*jnp.asarray(padded.T)))
        out.append(_least(np.asarray(of.slopes), *(np.asarray(x)[: len(part)] for x in found)))
    return np.concatenate(out)


def _least(
    before: Float[np.ndarray, "k+1"],
    own: Float[np.ndarray, "m"],
    by_slopes: Float[np.ndarray, "m k+1"],
    slopes: Float[np.ndarray, "m k+1 k+1"],
    by_others: Float[np.ndarray, "m q"],
    mixed: Float[np.ndarray, "m q k+1"],
) -> Float[np.ndarray, "m"]:
    """Least sums of squares over slopes of at least 0, from products."""
    G = slopes - np.swapaxes(mixed, 1, 2) @ mixed
    b = by_slopes - np.einsum("mqk,mq->mk", mixed, by_others)
    own = own - np.sum(by_others**2, axis=1)
    scale = np.sqrt(np.maximum(np.einsum("mkk->mk", slopes), np.finfo(float).tiny))
    G, b, before = G / scale[:, None] / scale[:, :, None], b / scale, before * scale
    G = G + _RIDGE * np.eye(G.shape[1])
    more = np.linalg.solve(G, b[..., None])[..., 0]
    for k in np.flatnonzero((before + more < 0).any(axis=1)):
        root = np.linalg.cholesky(G[k])
        more[k] = nnls(root.T, np.linalg.solve(root, b[k] + G[k] @ before[k]))[0] - before[k]
    return own - 2 * np.sum(b * more, axis=1) + np.einsum("mk,mkl,ml->m", more, G, more)


@eqx.filter_jit
def _products(of: Recorded, valves: Stiction) -> _Products:
    """Products [m, ...] for all pairs, summed over the recordings."""

    def one(
        valve: Stiction, pressure: Array, most: Array, above: Array, line: Array, below: Array, *rest: Array
    ) -> _Products:
        begin, moved = following(of.thresholds, most, valve)

        def step(
            carry: tuple[State, Array, _Products], at: tuple[Array, ...]
        ) -> tuple[tuple[State, Array, _Products], None]:
            state, z, sums = carry
            command, y, counts, others = at
            state, x = moved(state, command)
            phi = above[0] * x + z[0]
            z = jnp.concatenate([z[1:], jnp.zeros_like(z[:1])]) + jnp.outer(above[1:], x) - jnp.outer(below[1:], phi)
            phi = counts * phi
            r = counts * y - phi @ of.slopes
            new = _Products(r * r, r * phi, jnp.outer(phi, phi), r * others, jnp.outer(others, phi))
            return (state, z, jax.tree.map(jnp.add, sums, new)), None

        k, q = of.slopes.size, of.others.shape[-1]
        z = -jnp.outer(line, moved(begin, pressure[0])[1])
        zeros = _Products(*(jnp.zeros(shape) for shape in ((), (k,), (k, k), (q,), (q, k))))
        return jax.lax.scan(step, (begin, z, zeros), (pressure, *rest))[0][2]

    each = jax.vmap(one, (None, *(0,) * 8))
    trials = of.pressure, of.most, of.above, of.line, of.below, of.data, of.counts, of.others
    found = jax.vmap(lambda valve: each(valve, *trials))(valves)
    return jax.tree.map(lambda x: jnp.sum(x, axis=1), found)
