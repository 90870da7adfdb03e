"""Clocks. What runs on one core is timed by the processor time it takes: other work on the machine does not count."""

import statistics
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

now = time.process_time


def clock(f: Callable[[], Any], repeats: int = 5) -> float:
    """Median time of a call that is compiled already [s]."""
    return statistics.median(once(f)[0] for _ in range(repeats))


def once(f: Callable[[], Any]) -> tuple[float, Any]:
    """Time of one call [s], and what it returns."""
    began = now()
    result = jax.block_until_ready(f())
    return now() - began, result


def timed(run: Callable[[], Any]) -> tuple[float, float, Any]:
    """Wall and processor time [s] of a call, and its result."""
    wall, spent = time.perf_counter(), time.process_time()
    out = run()
    return time.perf_counter() - wall, time.process_time() - spent, out


class Row(NamedTuple):
    """One run: how far off, how long [s]."""

    error: float
    seconds: float


def time_at(error: float, rows: list[Row]) -> float:
    """Time for an error, between logarithms, NaN outside of the rows; of rows that are beaten in both, none counts."""
    front = [r for r in rows if not any(o.error <= r.error and o.seconds < r.seconds for o in rows)]
    front = sorted(front)
    errors, seconds = np.log([r.error for r in front]), np.log([r.seconds for r in front])
    if error < front[0].error:
        return float("nan")
    return float(np.exp(np.interp(np.log(error), errors, seconds)))
