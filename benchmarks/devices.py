"""512 designs and 1024 crawls on this machine's accelerator, and in two threads of its processor; compilation apart.

Each device has a process of its own and solves each batch three times; the numbers of both are compared. How the time
of a step goes with the number of robots says what bounds it. Without an accelerator there is the processor only.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .timing import timed

_OVER = {"L": np.linspace(0.35, 0.65, 8), "alpha": np.radians(np.linspace(20, 70, 8)), "omega": np.linspace(5, 20, 8)}
_CRAWLS, _AGAIN = 1024, 3
_COUNTS, _SHORT = (1, 32, 1024, 8192), 5.0  # crawls, and for how long [s]


def run(file: str) -> None:
    """Time both batches in this process; keep their numbers in a file."""
    import jax

    from nectosome.designs import sweep
    from nectosome.identification.gait.walks import Walks
    from nectosome_studies.poseidrone.crawl import fit

    device = jax.devices()[0]
    print(f"\n{device.device_kind}, {device.platform}, jax {jax.__version__}", flush=True)
    over = {name: tuple(values.tolist()) for name, values in _OVER.items()}
    speeds = _told("512 designs, steady", lambda: sweep("flagellum", over, workers=2)["speed"].values)
    of = fit()
    rows = of.ranges.values(np.random.default_rng(0).uniform(size=(_CRAWLS, len(of.variables))))
    gaits = _told(f"1024 crawls of {of.seconds:g} s", lambda: of.walked(rows)[0].gait)
    np.savez(file, speeds=speeds, gaits=gaits)
    for count in () if device.platform == "cpu" else _COUNTS:
        walks = Walks(of.description, [v.name for v in of.variables], seconds=_SHORT, window=_SHORT)
        some = np.resize(rows, (count, rows.shape[1]))
        walks(some)
        wall, _, _ = timed(lambda walks=walks, some=some: walks(some))
        step = wall / _SHORT * walks.step
        print(f"  {count:5d} crawls: {step * 1e6:.0f} us a step, {step / count * 1e6:.2f} us a robot", flush=True)


def _told(what: str, solve: Callable[[], np.ndarray]) -> np.ndarray:
    compiled, *_ = timed(solve)
    runs = [timed(solve) for _ in range(_AGAIN)]
    wall, spent = (float(np.median([each[k] for each in runs])) for k in (0, 1))
    found = runs[0][2]
    done = int(np.isfinite(found).reshape(512 if found.size == 512 else _CRAWLS, -1).all(axis=1).sum())
    print(f"  {what:20s} {wall:8.2f} s, processor {spent:8.2f} s; first {compiled:.1f} s; {done} solved", flush=True)
    return found


def _on(platform: str, file: Path) -> None:
    cpu = platform == "cpu"
    subprocess.run(
        [sys.executable, "-c", f"from benchmarks.devices import run; run({str(file)!r})"],
        check=True,
        env={**os.environ, **({"JAX_PLATFORMS": "cpu", "NPROC": "2"} if cpu else {})},
        preexec_fn=_two_processors if cpu else None,
    )


def _two_processors() -> None:
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])


def main() -> None:
    asked = [sys.executable, "-c", "import jax; print(jax.default_backend())"]
    here = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        files = {name: Path(folder) / f"{name}.npz" for name in dict.fromkeys((here, "cpu"))}
        for name, file in files.items():
            _on(name, file)
        if len(files) > 1:
            one, other = (np.load(file) for file in files.values())
            for name in one:
                both = np.isfinite(one[name]) & np.isfinite(other[name])
                same = both.sum() == np.isfinite(one[name]).sum() == np.isfinite(other[name]).sum()
                off = np.abs(one[name] - other[name])[both] / np.abs(other[name]).max(where=both, initial=0.0)
                print(f"  {name}: median difference {np.median(off):.1e}, largest {off.max():.1e}; same solved: {same}")


if __name__ == "__main__":
    main()
