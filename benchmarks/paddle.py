"""8 s of a rowing paddle without stops, one and a grid of 110, beside MuJoCo, on one core.

Springs, masses and the servo's sine are the same in both codes; drags are not (blades here, MuJoCo's ellipsoids), so
each code is held against its own fine run: root mean square of the angles over all samples, hinges and robots.
"""

import statistics

import mujoco
import numpy as np

from .paddles import SAMPLE, SECONDS, Run, one_here, one_there, some_here, some_there
from .timing import Row, time_at, timed

_ERRORS = (0.1, 0.01)  # degrees, at which times are compared
_TOLERANCES, _FINEST = (1e-2, 3e-3, 1e-3, 1e-4, 1e-5), 1e-10
# steps a sample; those of 12.5 ms are stable with three hinges, not with four
_STEPS = {"RK4": (8, 10, 12, 20, 40), "implicitfast": (20, 40, 100, 200, 400), "Euler": (20, 40, 100, 200, 400)}
_FINEST_STEPS = 200
AMPLITUDES, FREQUENCIES = np.radians(np.arange(30.0, 76.0, 5.0)), np.arange(3, 14) / 10
_LANES = 55


def main() -> None:
    print(f"\npaddle without stops, {SECONDS:.0f} s: MuJoCo {mujoco.__version__}; medians of interleaved runs")
    for hinges in (3, 4):
        _one(hinges)
    grid(1)


def _one(hinges: int) -> None:
    """One paddle, compiled before, at 75 deg and 1.1 Hz."""
    print(f"\n  one paddle of {hinges} hinges, 75 deg, 1.1 Hz")
    here = {f"{m}, rtol {r:.0e}": one_here(hinges, m, r) for m in ("explicit", "implicit") for r in _TOLERANCES}
    steps = [(i, k) for i, all_k in _STEPS.items() for k in all_k if hinges == 3 or k > _STEPS["RK4"][0]]
    there = {f"{i}, {_milli(k)}": one_there(hinges, i, k) for i, k in steps}
    ends = one_here(hinges, "explicit", _FINEST), one_there(hinges, "RK4", _FINEST_STEPS)
    _compare(*_rows((here, there), ends, 5))


def grid(threads: int) -> None:
    """110 paddles of 3 hinges."""
    grid = np.array([(A, f) for A in AMPLITUDES for f in FREQUENCIES])
    print(f"\n  {len(grid)} paddles of 3 hinges, {threads} {'thread' if threads == 1 else 'threads'}")
    here = {f"explicit, rtol {r:.0e}": some_here(3, grid, r, _LANES, threads) for r in _TOLERANCES[:-1]}
    there = {f"RK4, {_milli(k)}": some_there(3, grid, "RK4", k, threads) for k in _STEPS["RK4"]}
    ends = some_here(3, grid, _FINEST, _LANES, 2), some_there(3, grid, "RK4", _FINEST_STEPS, 2)
    _compare(*_rows((here, there), ends, 3))


def _milli(steps: int) -> str:
    return f"{1e3 * SAMPLE / steps:.3g} ms"


def _rows(codes: tuple[dict[str, Run], ...], ends: tuple[Run, ...], repeats: int) -> list[list[tuple[Row, Row]]]:
    """Rows of each code by processor and by wall time. Runs take turns, so that all of them see the same machine."""
    first = [{name: timed(run) for name, run in code.items()} for code in codes]
    times = [{name: [] for name in code} for code in codes]
    for _ in range(repeats):
        for code, kept in zip(codes, times, strict=True):
            for name, run in code.items():
                kept[name].append(timed(run)[:2])
    rows = []
    for code, began, kept, end in zip(("nectosome", "MuJoCo"), first, times, ends, strict=True):
        fine = end()
        rows.append([])
        for name, (compiled, _, angles) in began.items():
            error = float(np.sqrt(np.mean((angles - fine) ** 2)))
            wall, spent = (statistics.median(column) for column in zip(*kept[name], strict=True))
            told = f"{1e3 * spent:8.1f} ms, wall {1e3 * wall:8.1f} ms, first {compiled:5.1f} s"
            print(f"    {code + ' ' + name:34s} {error:9.5f} deg {told}", flush=True)
            rows[-1].append((Row(error, spent), Row(error, wall)))
    return rows


def _compare(ours: list[tuple[Row, Row]], theirs: list[tuple[Row, Row]]) -> None:
    """Ratios of times at equal errors."""
    for error in _ERRORS:
        for k, clock in enumerate(("processor", "wall")):
            a, b = (time_at(error, [row[k] for row in rows]) for rows in (ours, theirs))
            word = f"{max(a / b, b / a):.1f} x {'faster' if a < b else 'slower'}"
            times = f"nectosome {1e3 * a:.1f} ms, MuJoCo {1e3 * b:.1f} ms"
            print(f"    at {error} deg, {clock} time: {times}: {word}", flush=True)


if __name__ == "__main__":
    main()
