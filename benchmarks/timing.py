"""Clocks. What runs on one core is timed by the processor time it takes: other work on the machine does not count."""

import statistics
import time
from collections.abc import Callable
from typing import Any

import jax

now = time.process_time


def clock(f: Callable[[], Any], repeats: int = 5) -> float:
    """Median time of a call that is compiled already [s]."""
    return statistics.median(once(f)[0] for _ in range(repeats))


def once(f: Callable[[], Any]) -> tuple[float, Any]:
    """Time of one call [s], and what it returns."""
    began = now()
    result = jax.block_until_ready(f())
    return now() - began, result
