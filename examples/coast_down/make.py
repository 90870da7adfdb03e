"""Make the synthetic recordings of this folder: the hull with other numbers than those of its file, and noise.

Speeds at 10 Hz as of a camera, with noise of 5 mm/s, from the moment at which the hull was let go.
"""

import sys
from pathlib import Path

import numpy as np

import nectosome as ns
from nectosome.solve import reading

TRUTH = ("area=32cm2", "linear=0.6N s/m", "added=1.4kg")
SECONDS, RATE, NOISE = 30.0, 10.0, 5e-3  # s, Hz, m/s
PUSHED = {"bare": ("16.8kg", "1.1m/s"), "leaded": ("24.8kg", "0.9m/s")}


def main(folder: Path) -> None:
    """Write both recordings."""
    rng = np.random.default_rng(1)
    hull = str(Path(__file__).with_name("hull.yaml"))
    for name, (mass, speed) in PUSHED.items():
        settings = (*TRUTH, f"mass={mass}", f"body.joint.velocity={speed}")
        run = ns.simulate(hull, SECONDS, settings=settings, samples=int(SECONDS * RATE) + 1, rtol=1e-6)
        time, surge = np.asarray(run.value.time), reading(run, "surge")
        rows = np.column_stack([time, surge + NOISE * rng.normal(size=time.size)])
        np.savetxt(folder / f"{name}.csv", rows, "%.4f", ",", header="time (s),speed (m/s)", comments="")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
