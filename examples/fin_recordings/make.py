"""Make the synthetic recordings of this folder: the fin with other numbers than those of its file, and noise.

Angles by an encoder at 100 Hz, of 0.2 deg; the force on the load cell, with noise of 5 mN; the torque of the motor.
"""

import sys
from pathlib import Path

import numpy as np

import nectosome as ns

TRUTH = ("k=0.16N m/rad", "c=3mN m s/rad", "drag=1.7", "added=0.8")
SECONDS, RATE, ANGLE, FORCE = 8.0, 100.0, 0.2, 5e-3  # s, Hz, deg, N
PULLS = {"slow": (0.12, 0.5), "middle": (0.15, 1.0), "fast": (0.1, 2.0)}  # N m, Hz


def main(folder: Path) -> None:
    """Write three recordings."""
    rng = np.random.default_rng(1)
    robot = ns.apply_settings(ns.describe(str(Path(__file__).with_name("fin.yaml"))), TRUTH)
    for name, (torque, frequency) in PULLS.items():
        drive = f"limbs.fin.joint.torque={{kind: sine, amplitude: {torque} N m, frequency: {frequency} Hz}}"
        built = ns.build(ns.apply_settings(robot, [drive]))
        run = ns.simulate(built, SECONDS, samples=int(SECONDS * RATE) + 1, rtol=1e-6)
        time, angle = np.asarray(run.value.time), np.rad2deg(np.asarray(run.value.state.q)[:, 0])
        force = run.to_dataset()["support_force"].sel(axis="y").values
        given = 1e3 * torque * np.sin(2 * np.pi * frequency * time)
        seen = angle + ANGLE * rng.normal(size=time.size), force + FORCE * rng.normal(size=time.size)
        rows = np.column_stack([time, given, seen[0], seen[1]])
        head = "time (s),torque (mN m),angle (deg),push (N)"
        form = ["%.2f", "%.3f", "%.2f", "%.4f"]
        np.savetxt(folder / f"{name}.csv", rows, form, ",", header=head, comments="")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
