"""A simulated grid and experiments that differ from it in a known way; both are synthetic, by a formula.

The simulator takes F = Cn A f^2 with Cn = 1, the truth has Cn = 0.8 and 0.05 N more. Peaks are 3 Cn A f^2 in both.
"""

import json
from pathlib import Path

import numpy as np
import xarray as xr

from nectosome.io import save_dataset

A, FREQUENCIES, CN = np.radians([20.0, 30.0, 40.0, 50.0, 60.0]), [0.4, 0.7, 1.0, 1.3], [0.5, 0.75, 1.0, 1.5, 2.0]
PLAN = [(i, j) for i in range(5) for j in range(4) if (i + 2 * j) % 5 in (0, 2)] + [(0, 3), (4, 0)]
SAMPLES = 40  # of a cycle


def mean(a, f):
    return 0.8 * a * f**2 + 0.05


def peak(a, f):
    return 3 * 0.8 * a * f**2


def grid(over=("A", "f", "Cn")) -> xr.Dataset:
    """What a sweep gives of forces along x and y: the water pushes towards -y."""
    coords = {"A": ("A", A, {"units": "rad"}), "f": ("f", FREQUENCIES, {"units": "Hz"}), "Cn": ("Cn", CN)}
    thrust = xr.DataArray(A, dims="A") * xr.DataArray(FREQUENCIES, dims="f") ** 2 * xr.DataArray(CN, dims="Cn")
    along = xr.DataArray([0.1, -1.0], coords={"axis": ["x", "y"]}, dims="axis")
    force = (thrust * along).assign_attrs(units="N")
    tops = (3 * thrust * abs(along)).assign_attrs(units="N")
    power = (2 * thrust).assign_attrs(units="W")
    data = xr.Dataset({"force": force, "force_peak": tops, "power": power}, coords=coords)
    for name, at in (("A", A[2]), ("f", FREQUENCIES[2]), ("Cn", 1.0)):
        data = data if name in over else data.sel({name: at}, drop=True)
    return data


def signal(a, f, cycles=5.0, scale=1.0):
    """Times and forces; the first cycle has not settled yet."""
    t = np.arange(round(cycles * SAMPLES)) / (SAMPLES * f)
    x = mean(a, f) + (peak(a, f) - mean(a, f)) * np.sin(2 * np.pi * f * t)
    return t, scale * x * (1 + 0.5 * (t * f < 1 - 1e-9))


def recording(a, f, *, name="run.csv", units=("rad", "Hz", "N"), **how) -> xr.Dataset:
    t, x = signal(a, f, **how)
    coords = {"time": ("time", t, {"units": "s"}), "A": ((), a, {"units": units[0]}), "f": ((), f, {"units": units[1]})}
    made = json.dumps({"file": f"folder/{name}", "repairs": [], "warnings": []})
    return xr.Dataset({"force": ("time", x, {"units": units[2]})}, coords, {"provenance": made})


def write_campaign(folder: Path, plan=PLAN, scatter=0.02) -> Path:
    """Recordings and the campaign that lists them; all conditions are measured twice, every third three times."""
    rng = np.random.default_rng(3)
    lines = ["columns: {force: {column: F, unit: N}}", "time: {column: t, unit: s}", "recordings:"]
    folder.mkdir(exist_ok=True)
    for k, (i, j) in enumerate(plan):
        for repeat in range(3 if k % 3 == 0 else 2):
            name = f"run_{i}_{j}_{repeat}.csv"
            rows = np.transpose(signal(A[i], FREQUENCIES[j], scale=1 + scatter * rng.normal()))
            np.savetxt(folder / name, rows, fmt="%.9g", delimiter=",", header="t,F", comments="")
            degrees = round(np.degrees(A[i]))
            lines.append(f"  - {{file: {name}, conditions: {{A: {degrees} deg, f: {FREQUENCIES[j]} Hz}}}}")
    file = folder / "campaign.yaml"
    file.write_text("\n".join(lines) + "\n")
    return file


def write_grid(file: Path, **how) -> Path:
    save_dataset(grid(**how), file)
    return file
