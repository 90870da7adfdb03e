r"""Dead band d and resolution s of a valve that moves in steps: where to look for them, and how far they are known.

The pressure steps to $k s$ where the command goes beyond $k s + d/2$. With another s its steps have another height, and
with another s or d they come at other times: where one comes a sample earlier or later chi2 jumps, where one is missing
at a peak it jumps far, and in between it hardly changes. So derivatives say nothing. The search is one on a grid of
phases: how many steps the largest pressure is, and the dead band in steps, with one cell at least for each way that the
pressure can turn back, a step more or less. The best cells are divided again and again. Intervals reach to where the
best that can be done is worse by `stepwise_threshold`.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from ..fits.identifiability import Interval, intervals_of
from ..fits.intervals import stepwise_threshold

_STEPS_UP = 2.0, 60.0, 0.15  # to the largest command: fewest, most, and the width of a cell
_BAND, _WALL = 0.5, 0.0625  # of a step: largest and smallest width of a cell in the dead band
_BEGIN = 2e-3  # of the largest value: as far on each side an end is looked for first
_LINES = 8  # tried on each side at once
_FURTHER = 4.0  # times as far, where all values fit
_TURNS, _SETTLED = 20, 0.9  # a box that shrinks by less is as good as the interval


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
