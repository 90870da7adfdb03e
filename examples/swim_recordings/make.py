"""Make the synthetic recordings of this folder: PoseiDRONE as the paper's parameters have it, with noise.

Speeds at 50 Hz as of a camera, with noise of 5 mm/s; thrusts of the held robot at 200 Hz, begun at another moment, with
noise of 5 mN. Both have the crank's angle.
"""

import sys
from pathlib import Path

import numpy as np

from nectosome_studies.poseidrone.recordings import OMEGA, recording, thrust

SECONDS, STEP, NOISE = 6.0, 0.005, 0.005  # of the thrust: s, s, N
LATER = 0.4  # rad, by which the crank is ahead when the load cell begins


def main(folder: Path) -> None:
    """Write two speeds and two thrusts."""
    rng = np.random.default_rng(1)
    for name, omega in OMEGA.items():
        swim = recording(name, rng)
        kept = swim.time < SECONDS
        time, speed = swim.time[kept], swim.speed[kept]
        rows = np.column_stack([time, speed, omega * time % (2 * np.pi)])
        head = "time (s),speed (m/s),crank (rad)"
        np.savetxt(folder / f"speed_{omega:g}.csv", rows, "%.4f", ",", header=head, comments="")
        time = np.arange(0.0, SECONDS + 1.0, STEP)
        angle = omega * time + LATER
        force = 1e3 * (thrust(angle) + NOISE * rng.normal(size=time.size))
        rows = np.column_stack([time, force, angle % (2 * np.pi)])
        head = "time (s),thrust (mN),crank (rad)"
        np.savetxt(folder / f"thrust_{omega:g}.csv", rows, ["%.3f", "%.1f", "%.4f"], ",", header=head, comments="")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
