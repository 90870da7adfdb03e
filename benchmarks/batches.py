"""110 paddles beside MuJoCo in two threads, and the sweep of the paper: the paddle with its stops, at its cycle."""

import numpy as np

from nectosome.core import Status
from nectosome.designs.sweep import sweep

from .paddle import AMPLITUDES, FREQUENCIES, grid
from .timing import timed

_AIM = 10.0  # s, of the sweep


def main() -> None:
    grid(2)
    over = {"N": (1, 2, 3), "A": tuple(AMPLITUDES), "f": tuple(FREQUENCIES)}
    print("\n  sweep of the shipped paddle, with stops: N = 1, 2, 3, 330 cycles, two threads")
    for what in ("first, with compilation", "compiled"):
        wall, spent, found = timed(lambda: sweep("paddle", over, workers=2))
        solved = int(np.isin(found["status"], (Status.SOLVED.name, Status.SETTLED.name)).sum())
        print(f"    {what:24s} {wall:6.1f} s, processor {spent:6.1f} s (aim {_AIM:.0f} s), {solved} solved", flush=True)


if __name__ == "__main__":
    main()
