r"""A valve with a dead band d and a resolution s before the plays of an actuator: its pressure, and fits of d and s.

All pairs of d and s go through the recordings side by side, valve, plays and dynamics sample by sample, in one compiled
program. It keeps no answers, only their products: with answers $\Phi$ by unit slopes of a pair, and residuals
$r = y - \Phi w_0$ for slopes $w_0$ that are about right,

$$ |y - \Phi w|^2 = r^T r - 2\, r^T \Phi\, (w - w_0) + (w - w_0)^T \Phi^T \Phi\, (w - w_0) $$

which is as exact as the residuals are small. Derivatives by all other parameters are projected out first: these are
fitted to first order.

The pressure steps to $k s$ where the command goes beyond $k s + d/2$. With another s its steps have another height, and
with another s or d they come at other times: where one comes a sample earlier or later chi2 jumps, where one is missing
at a peak it jumps far, and in between it hardly changes. So derivatives say nothing. The search is one on a grid of
phases: how many steps the largest pressure is, and the dead band in steps, with one cell at least for each way that the
pressure can turn back, a step more or less. The best cells are divided again and again. Intervals reach to where the
best that can be done is worse by `stepwise_threshold`.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from scipy.optimize import nnls

from nectosome.core import Line
from nectosome.drives import PrandtlIshlinskii, Stiction

from ..fits.identifiability import Interval, intervals_of
from ..fits.intervals import stepwise_threshold

State = tuple[Float[Array, ""], Float[Array, ""], Float[Array, "k"]]  # of the valve, pressure, plays
_AT_ONCE = 512  # pairs
_RIDGE = 1e-11  # of columns of length 1: slopes of plays that never move are 0
_STEPS_UP = 2.0, 60.0, 0.15  # to the largest command: fewest, most, and the width of a cell
_BAND, _WALL = 0.5, 0.0625  # of a step: largest and smallest width of a cell in the dead band
_BEGIN = 2e-3  # of the largest value: as far on each side an end is looked for first
_LINES = 8  # tried on each side at once
_FURTHER = 4.0  # times as far, where all values fit
_TURNS, _SETTLED = 20, 0.9  # a box that shrinks by less is as good as the interval


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


def first_cells(
    largest: float, turning: Float[np.ndarray, "p"], bounds: Float[np.ndarray, "2 2"]
) -> Float[np.ndarray, "m 2"]:
    """Pairs of dead band and resolution [Pa] all over their ranges, (d, s) by rows.

    Dead bands are between those at which a step more or less is made at one of the `turning` points [Pa], where
    $2 p/s$ is d/s but for an even number; a minimum counts by -p.
    """
    (low, high), out = bounds[0], []
    for s in largest / np.arange(*_STEPS_UP):
        walls = np.concatenate([2 * np.mod(turning / s, 1), np.arange(0, 2, _BAND)])
        edges = _WALL * np.unique(np.mod(np.round(walls / _WALL), 2 / _WALL))
        middles = (edges + np.append(edges[1:], edges[0] + 2)) / 2
        bands = s * (middles + 2 * np.arange(-1, np.ceil(high / (2 * s)))[:, None]).ravel()
        bands = np.append(low, bands[(bands > low) & (bands < high)])
        out.append(np.stack([bands, np.full(bands.size, s)], axis=1))
    return np.concatenate(out)


def best_cells(
    chi2: Float[np.ndarray, "m"], first: Int[np.ndarray, "m"], kept: int, parts: int
) -> Int[np.ndarray, "k"]:
    """Places of the best cells, the best one first: `parts` of each of `kept` first cells that they are parts of."""
    order = np.argsort(chi2, kind="stable")
    of = first[order]
    by_cell = np.argsort(of, kind="stable")
    rank = np.empty(len(of), int)
    rank[by_cell] = np.arange(len(of)) - np.searchsorted(of[by_cell], of[by_cell])
    best = of[rank == 0][:kept]
    return order[(rank < parts) & np.isin(of, best)]


def divided(
    pairs: Float[np.ndarray, "m 2"], turn: int, largest: float, bounds: Float[np.ndarray, "2 2"]
) -> Float[np.ndarray, "9*m 2"]:
    """Parts of cells that have been divided `turn` times, those of a cell one after the other."""
    band, step = pairs.T[:, :, None, None]
    shift = np.array([-1.0, 0.0, 1.0]) / 3.0**turn
    finer = largest / (largest / step + _STEPS_UP[2] * shift)
    bands = (band / step + _BAND * shift[:, None]) * finer
    return np.clip(np.stack(np.broadcast_arrays(bands, finer), axis=-1).reshape(-1, 2), *bounds.T)


def stepwise_box(
    chi2: Callable[[Float[np.ndarray, "m a"]], Float[np.ndarray, "m"]],
    best: Float[np.ndarray, "a"],
    bounds: Float[np.ndarray, "a 2"],
    others: Float[np.ndarray, "m a"],
) -> tuple[Float[np.ndarray, "a"], tuple[Interval, ...]]:
    """The best of all values that are tried, and 95 % intervals, from good values on, by chi2 at rows of values.

    Intervals are the sides of the box that holds all rows that fit, also those of `others`. Grids over a box are tried;
    it shrinks to the lines after the last that fit, and grows where there is none. An end at a bound that fits is not
    identified.
    """
    tried, tried_lines = np.concatenate([best[None], others]), best[:, None]
    found, width = chi2(tried), _BEGIN * bounds[:, 1]
    fitting = tried[found <= found.min() + stepwise_threshold()]
    ends = np.stack([fitting.min(axis=0), fitting.max(axis=0)], axis=1)
    box = np.clip(ends + width[:, None] * [-1, 1], *bounds.T[:, :, None])
    for _ in range(_TURNS):
        lines = np.stack([_lines(low, middle, high) for (low, high), middle in zip(box, best, strict=True)])
        tried_lines = np.concatenate([tried_lines, lines], axis=1)
        rows = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(best))
        tried, found = np.concatenate([tried, rows]), np.concatenate([found, chi2(rows)])
        fits = found <= found.min() + stepwise_threshold()
        before, ends = box, np.stack([tried[fits].min(axis=0), tried[fits].max(axis=0)], axis=1)
        box = np.array([_beyond(*x) for x in zip(tried_lines, ends, best, bounds, strict=True)])
        settled = np.ptp(box, axis=1) > _SETTLED * np.ptp(before, axis=1)
        if np.all(settled) and np.all((box >= before[:, :1]) & (box <= before[:, 1:])):
            break
    return tried[np.argmin(found)], intervals_of(box, (ends > bounds[:, :1]) & (ends < bounds[:, 1:]))


def _lines(low: float, middle: float, high: float) -> Float[np.ndarray, "l"]:
    """Values to both sides of a middle."""
    return np.concatenate([np.linspace(low, middle, _LINES + 1), np.linspace(middle, high, _LINES + 1)[1:]])


def _beyond(
    tried: Float[np.ndarray, "l"], ends: Float[np.ndarray, "2"], best: float, bounds: Float[np.ndarray, "2"]
) -> tuple[float, float]:
    """The values that were tried next to ends that fit; further out where there is none."""
    low, high = ends
    below, above = tried[tried < low], tried[tried > high]
    first = below.max() if below.size else best - _FURTHER * (best - low)
    last = above.min() if above.size else best + _FURTHER * (high - best)
    return max(first, bounds[0]), min(last, bounds[1])
