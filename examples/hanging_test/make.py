"""Make the synthetic readings of this folder: places on a filament of 7.9 MPa under weights, off by 1 mm.

A finer model makes them than the one of filament.yaml: strain order 5, 20 Gauss points.
"""

import sys
from pathlib import Path

import numpy as np

import nectosome as ns

TRUTH = ("E=7.9MPa", "limbs.filament.strains={torsion: 3, bending_y: 5, bending_z: 3}", "limbs.filament.points=20")
MASSES = ((50.0, 0.0, 0.0), (0.0, 30.0, 0.0), (0.0, 0.0, 10.0))  # g
NOISE = 1.0  # mm
G = 9.80665e-3  # N/g


def main(folder: Path) -> None:
    """Write a row for each set of masses."""
    rng = np.random.default_rng(1)
    robot = ns.apply_settings(ns.describe(str(Path(__file__).with_name("filament.yaml"))), TRUTH)
    rows = []
    for masses in MASSES:
        hung = [f"{name}={-G * mass} N" for name, mass in zip(("low", "middle", "high"), masses, strict=True)]
        shape = ns.static(robot, settings=hung)
        places = [f"filament.{at}.position.{axis}" for at in ("0.7", "tip") for axis in "xz"]
        seen = [1e3 * float(ns.reading(shape, place)[0]) for place in places]
        rows.append([*masses, *(np.array(seen) + NOISE * rng.normal(size=len(seen)))])
    head = "low (g),middle (g),high (g),middle_x (mm),middle_z (mm),tip_x (mm),tip_z (mm)"
    np.savetxt(folder / "shapes.csv", rows, ["%.0f"] * 3 + ["%.1f"] * 4, ",", header=head, comments="")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
