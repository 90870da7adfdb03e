"""Make the synthetic recordings of this folder: the fishtail as the paper's parameters have it, with noise.

Commands of four waves and displacements, at 100 Hz; the valve follows commands at 3.8 bar/s at most.
"""

import sys
from pathlib import Path

import numpy as np

from nectosome_studies.fishtail.plant import BAR, MM, recorded

FREQUENCIES, EVERY = (0.5, 0.8, 1.0, 1.5), 10  # Hz, and samples of 1 ms


def main(folder: Path) -> None:
    """Write a file a frequency."""
    for frequency in FREQUENCIES:
        run = recorded(frequency, seed=1)
        time = run.dt * np.arange(len(run.pressure))
        rows = np.column_stack([time, run.pressure / BAR, run.displacement / MM])[::EVERY]
        head = "time (s),pressure (bar),displacement (mm)"
        np.savetxt(folder / f"waves_{frequency:g}.csv", rows, ["%.2f", "%.5f", "%.3f"], ",", header=head, comments="")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
