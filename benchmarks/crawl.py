"""25 s of PoseiDRONE's crawling, one walk and many with numbers of their own, beside a numba loop, on one core.

The loop (`crawl_loop`) is written for this robot alone: the same equations, the same steps of 1 ms. Both are compared
with each other first. Times are processor times.
"""

import statistics
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numba
import numpy as np

from nectosome.description import get_value
from nectosome.identification.gait.walks import FEATURES, Walks
from nectosome.mechanism import in_plane
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import fixed_step

from . import crawl_loop
from .timing import once

NAMES = ("k", "d_r", "mu_s", "mu_d", "m_a", "J", "drag_area", "rotational_drag", "lambda_t", "lambda_n")
_SECONDS, _WINDOW, _STEP = 25.0, 5.0, 1e-3
_SPREAD = 0.05  # of the numbers around those of the paper
_BATCHES, _REPEATS = (128, 512), 3


def main() -> None:
    description = describe("poseidrone_crawl")
    own = np.array([float(get_value(description, name)) for name in NAMES])
    rows = own * (1 + _SPREAD * np.random.default_rng(0).uniform(-1, 1, (max(_BATCHES), own.size)))
    rows[0] = own
    walks = Walks(description, NAMES, seconds=_SECONDS, window=_WINDOW, step=_STEP)

    def theirs(count: int) -> Callable[[], Any]:
        return lambda: crawl_loop.walks(rows[:count], _SECONDS, _WINDOW, _STEP)

    print(f"\ncrawl of {_SECONDS:.0f} s in steps of 1 ms: numba {numba.__version__}; medians of interleaved runs")
    first, found = once(lambda: walks(rows))
    first_there, (gait, fell) = once(theirs(max(_BATCHES)))
    print(f"  first {max(_BATCHES)}, with compilation: nectosome {first:.1f} s, numba {first_there:.1f} s")
    assert np.array_equal(np.isinf(found.fell), np.isinf(fell))
    off = np.abs(found.gait / gait - 1)[np.isinf(fell)].max(axis=0)
    largest = ", ".join(f"{name} {x:.0e}" for name, x in zip(FEATURES, off, strict=True))
    print(f"  largest difference of features: {largest}; {np.isfinite(fell).sum()} fell", flush=True)
    assert off.max() < 1e-4
    _compare("1, by `fixed_step`", 1, _alone(), theirs(1))
    _compare("1, by `Walks`", 1, lambda: walks(rows[:1]), theirs(1))
    for count in _BATCHES:
        _compare(f"{count}, by `Walks`", count, lambda count=count: walks(rows[:count]), theirs(count))


def _alone() -> Callable[[], Any]:
    """One walk, compiled for one."""
    robot = build(describe("poseidrone_crawl"))
    zero, step, count = jnp.zeros(()), jnp.asarray(_STEP), round(_SECONDS / _STEP)
    walk = jax.jit(lambda x: fixed_step(in_plane(robot), zero, x, step, count, keep=lambda x: x.q))
    jax.block_until_ready(walk(robot.initial()))
    return lambda: walk(robot.initial())


def _compare(what: str, count: int, here: Callable[[], Any], there: Callable[[], Any]) -> None:
    times = [[once(run)[0] for run in (here, there)] for _ in range(_REPEATS)]
    a, b = (statistics.median(column) / count for column in zip(*times, strict=True))
    word = f"{max(a / b, b / a):.1f} x {'faster' if a < b else 'slower'}"
    print(f"  {what:16s} nectosome {1e3 * a:7.1f} ms a walk, numba {1e3 * b:7.1f} ms: {word}", flush=True)


if __name__ == "__main__":
    main()
