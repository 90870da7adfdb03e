"""Forces of the vortex lattice that ship, so that they are there without it: `lattice_beats.csv`, `lattice_strips.csv`.

`benchmarks/vortex_lattice.py` makes them again, with `tuna_fin.csv`.
"""

from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
import pandas as pd

from .lattice import LatticeForces

BEATS, STRIPS = "lattice_beats.csv", "lattice_strips.csv"
_STRIP = ("from_m", "to_m", "lift_cos_N", "lift_sin_N", "thrust_N")


def kept() -> tuple[str, dict[str, LatticeForces]]:
    """How they were made, and forces by case."""
    folder = files("nectosome_studies").joinpath("vortex")
    made, beats = _read(folder.joinpath(BEATS))
    _, strips = _read(folder.joinpath(STRIPS))
    found = {}
    for name in dict.fromkeys(beats["case"]):
        lift, thrust, power = _columns(beats, name, "lift_N", "thrust_N", "power_W")
        begins, ends, cosine, sine, share = _columns(
            strips, name, "from_m", "to_m", "lift_cos_N", "lift_sin_N", "thrust_N"
        )
        found[name] = LatticeForces(lift, thrust, power, np.append(begins[0], ends), cosine + 1j * sine, share)
    return made, found


def keep(folder: Path, made: str, forces: dict[str, LatticeForces]) -> None:
    """Write both files into a folder; `made` says how, in a line."""
    beats = [
        pd.DataFrame(
            {
                "case": name,
                "phase": np.arange(len(f.lift)) / len(f.lift),
                "lift_N": f.lift,
                "thrust_N": f.thrust,
                "power_W": f.power,
            }
        )
        for name, f in forces.items()
    ]
    strips = [
        pd.DataFrame(
            np.stack([f.ends[:-1], f.ends[1:], np.real(f.strip_lift), np.imag(f.strip_lift), f.strip_thrust], axis=1),
            columns=[*_STRIP],
        ).assign(case=name)
        for name, f in forces.items()
    ]
    for name, tables in ((BEATS, beats), (STRIPS, strips)):
        rows = pd.concat(tables).to_csv(index=False, float_format="%.6g")
        folder.joinpath(name).write_text(f"# {made}\n{rows}", encoding="utf-8")


def _columns(table: pd.DataFrame, case: str, *names: str) -> np.ndarray:
    """Columns of the rows of a case."""
    return table.loc[table["case"] == case, [*names]].to_numpy().T


def _read(path: Traversable) -> tuple[str, pd.DataFrame]:
    with path.open(encoding="utf-8") as file:
        return file.readline().removeprefix("#").strip(), pd.read_csv(file)
