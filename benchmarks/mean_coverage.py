"""Whether 95 % intervals of `measure --means` hold the truth: on 200 drawn benches, all synthetic.

    python -m benchmarks.mean_coverage

Each bench has a load cell at 80 Hz, and measures some conditions some times. Cycles of a force with three harmonics
come after 1.4 s at rest and before 0.4 s of it. Beside the truth: white noise; hum of 50 Hz of the mains, whose phase
is drawn, and of which the samples make 30 Hz; a zero and a drift of the cell, a straight line and a random walk; and
runs whose whole force is off by a share, and whose phase by an angle, drawn anew for each run. The zero comes off as a
campaign's `at_rest: [0..1.4 s, -0.4..0 s]` does it. Sizes are drawn for each bench. Printed: how many of the intervals
of all conditions hold the number without all that, and half their widths beside it.
"""

import json
import sys
from typing import NamedTuple

import numpy as np
import xarray as xr

from nectosome.measure.condition_means import condition_means

BENCHES = 200
_REST, _END, _RATE, _HUM = 1.4, 0.4, 80.0, 50.0


class Bench(NamedTuple):
    """Sizes that a bench has."""

    amplitudes: np.ndarray  # of the fin [rad]
    frequencies: np.ndarray  # [Hz]
    repeats: int
    seconds: float  # of a run that moves
    noise: float  # of a sample, by the largest force
    hum: float  # by the same
    drift: float  # from the beginning to the end, by the same
    walk: float  # likewise, of the random part
    scatter: float  # between runs, as a share
    lag: float  # between runs [rad]


def drawn(rng: np.random.Generator) -> Bench:
    """A bench."""
    return Bench(
        np.radians(np.sort(rng.uniform(10, 50, rng.integers(2, 4)))),
        np.sort(rng.uniform(0.5, 1.5, rng.integers(2, 4))),
        int(rng.integers(2, 6)),
        rng.uniform(6, 15),
        *(float(size * 10 ** rng.uniform(-0.5, 0.5)) for size in (0.03, 0.02, 0.05, 0.005, 0.02, 0.02)),
    )


def truth(A: float, f: float) -> tuple[float, complex, complex]:
    """Mean, first harmonic of the force [N], and that of the way [m]."""
    size = A * f**2
    return 0.25 * size, size * np.exp(0.6j), 0.1 * A + 0j


def recorded(bench: Bench, A: float, f: float, rng: np.random.Generator) -> xr.Dataset:
    """A run."""
    cycles = np.floor(bench.seconds * f)
    t = np.arange(0, _REST + cycles / f + _END, 1 / _RATE) + rng.uniform(0, 1 / _RATE)
    moves = (t >= _REST) & (t <= _REST + cycles / f)
    mean, force, way = truth(A, f)
    turn = 2 * np.pi * f * (t - _REST)
    late, share = bench.lag * rng.normal(), 1 + bench.scatter * rng.normal()
    size = abs(force)
    pulls = (
        mean + (force * np.exp(1j * (turn + late))).real + 0.2 * size * np.cos(2 * turn) + 0.1 * size * np.sin(3 * turn)
    )
    largest = np.max(bench.amplitudes) * np.max(bench.frequencies) ** 2
    walk = np.cumsum(rng.normal(size=t.size)) / np.sqrt(t.size)
    cell = share * pulls * moves + largest * (
        bench.noise * rng.normal(size=t.size)
        + bench.hum * np.sin(2 * np.pi * _HUM * t + rng.uniform(0, 2 * np.pi))
        + bench.drift * rng.normal() * t / t[-1]
        + bench.walk * walk
        + rng.normal()
    )
    rests = [t < _REST, t > _REST + cycles / f]
    zero = np.interp(t, [t[rest].mean() for rest in rests], [cell[rest].mean() for rest in rests])
    data = {
        "force": ("time", cell - zero, {"units": "N"}),
        "way": ("time", (way * np.exp(1j * turn)).real * moves, {"units": "m"}),
    }
    coords = {"time": ("time", t, {"units": "s"}), "A": ((), A, {"units": "rad"}), "f": ((), f, {"units": "Hz"})}
    window = f"{_REST} .. {_REST + cycles / f} s"
    return xr.Dataset(data, coords, {"provenance": json.dumps({"file": "run.csv"}), "window": json.dumps(window)})


def main(benches: int) -> None:
    """Print the share of intervals that hold, of each number."""
    held: dict[str, list[bool]] = {}
    widths: dict[str, list[float]] = {}
    for seed in range(benches):
        rng = np.random.default_rng(seed)
        bench = drawn(rng)
        runs = [
            recorded(bench, A, f, rng)
            for A in bench.amplitudes
            for f in bench.frequencies
            for _ in range(bench.repeats)
        ]
        found = condition_means(runs, "force", "way")
        for k in range(found.sizes["condition"]):
            mean, force, way = truth(float(found["A"][k]), float(found["f"][k]))
            area = np.pi * abs(force) * abs(way) * np.sin(np.angle(force / way))
            true = {"mean": mean, "amplitude": abs(force), "phase": float(np.angle(force / way)), "loop_area": area}
            for name, x in true.items():
                low, high = (float(found[f"{name}_{end}"][k]) for end in ("low", "high"))
                held.setdefault(name, []).append(low <= x <= high)
                widths.setdefault(name, []).append(0.5 * (high - low) / abs(x))
    for name, each in held.items():
        middle = 100 * np.median(widths[name])
        print(f"{name}: {sum(each)} of {len(each)} hold ({100 * np.mean(each):.1f} %), half width {middle:.1f} %")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else BENCHES)
