"""Clocks."""

import statistics
import time
from collections.abc import Callable
from typing import Any

import jax


def clock(f: Callable[[], Any], repeats: int = 5) -> float:
    """Median time of a call that is compiled already [s]."""
    return statistics.median(once(f)[0] for _ in range(repeats))


def once(f: Callable[[], Any]) -> tuple[float, Any]:
    """Time of one call [s], and what it returns."""
    began = time.perf_counter()
    result = jax.block_until_ready(f())
    return time.perf_counter() - began, result
