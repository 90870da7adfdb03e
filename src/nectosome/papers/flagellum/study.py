"""Swimming from rest to steady speed: Table II, the strain orders of Fig. 3, and the reversal of thrust."""

import math
import time
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from nectosome.io import RobotDescription, apply_settings, with_values
from nectosome.robots import build, describe, flagella
from nectosome.solve import simulate

from ..study import Progress, Study, printed, score

if TYPE_CHECKING:
    import xarray as xr

NAME = "flagellum"
TITLE = "Soft flagellate propeller"
ABOUT = (
    "A canister with one motor is pushed by a soft tapered filament on a rigid pre-curved hook. All speeds are "
    "predictions by time integration from rest; the constants come from the paper and from the toolbox example it "
    "builds on, and nothing is fitted."
)
_QUANTITIES = {
    "length": "limbs.filament.length",
    "tip_radius": "limbs.filament.tip_radius",
    "bend": "limbs.hook.bend",
    "rate": "limbs.shaft.joint.motion.rate",
    "young": "limbs.filament.young",
}
_OLD = {"length": 0.300, "tip_radius": 2e-3, "bend": 45.0, "rate": 14.4}
_FIG3 = {"length": 0.300, "tip_radius": 1e-3, "bend": 70.0, "rate": 15.0, "young": 8.5e6}
_FREE_RTOL = 1e-3  # of the robot with four flagella, an example that no row depends on
_SETTLE = 5.0  # s: the slowest mode decays at 1.9 1/s or faster


def run(quick: bool, progress: Progress) -> Study:
    """All runs and rows; `quick` keeps the rows and loosens the integration tolerance."""
    began = time.perf_counter()
    book = printed(NAME)
    rtol = 1e-3 if quick else 1e-5
    base = describe("flagellum")
    jobs: dict[str, tuple[str, RobotDescription, float]] = {}
    for k in range(1, 6):
        entry = book[f"flagellum/table2/row{k}/speed"]
        jobs[f"row{k}"] = (f"Table II, row {k}", _design(base, entry["design"]), _SETTLE)
    jobs["old_soft"] = ("old design, silicone", _design(base, {**_OLD, "young": 1378.95e3}), _SETTLE)
    jobs["old_rigid"] = ("old design, ABS", _design(base, {**_OLD, "young": 1681e6}), _SETTLE)
    for order in range(6):
        strains = f"limbs.filament.strains={{torsion: {order}, bending_y: {order}, bending_z: {order}}}"
        jobs[f"order{order}"] = (f"order {order}", apply_settings(_design(base, _FIG3), [strains]), _SETTLE)
    jobs["flagella4"] = ("four flagella on one free canister", flagella(4), 1.0)

    runs = {}
    for i, (key, (label, description, duration)) in enumerate(jobs.items()):
        progress(label, i / len(jobs))
        tolerance = _FREE_RTOL if key == "flagella4" else rtol
        solution = simulate(build(description), duration, rtol=tolerance, atol=tolerance * 1e-2)
        run = solution.to_dataset(description, {"time": duration, "rtol": tolerance})
        run.attrs["label"] = label
        runs[key] = run
    for k in range(1, 6):
        runs[f"row{k}"].attrs["printed_speed"] = book[f"flagellum/table2/row{k}/speed"]["printed"]
    progress("scorecard", 1.0)
    rows = [score(row, book[row], ours) for row, ours in _numbers(runs).items()]
    return Study(NAME, TITLE, ABOUT, rows, runs, time.perf_counter() - began)


def _design(base: RobotDescription, design: dict[str, float]) -> RobotDescription:
    """The flagellum with other numbers; `bend` in degrees, all else SI."""
    values = {_QUANTITIES[name]: math.radians(x) if name == "bend" else x for name, x in design.items()}
    return with_values(base, values)


def steady_speed(run: "xr.Dataset") -> float:
    """Forward speed [m/s] at the end of a run, forward being -x; raises where it had not settled to 1e-4 of itself."""
    speed = -run["velocity"].sel(part="body", axis="x").values
    last = speed[run["time"].values >= run["time"].values[-1] - 0.5]
    if np.ptp(last) > 1e-4 * np.max(np.abs(last)):
        raise RuntimeError(f"{run.attrs['label']}: still accelerating at {float(run['time'][-1])} s")
    return float(last[-1])


def _numbers(runs: "dict[str, xr.Dataset]") -> dict[str, float]:
    """Our numbers by scorecard row."""
    speed = {key: steady_speed(run) for key, run in runs.items() if key != "flagella4"}
    table = [speed[f"row{k}"] for k in range(1, 6)]
    ours = {f"flagellum/table2/row{k}/speed": table[k - 1] for k in range(1, 6)}
    for k in range(1, 6):
        ours[f"flagellum/table2/row{k}/torque"] = float(runs[f"row{k}"]["reaction"][-1, 0])
    ordered = [a > b for a, b in combinations(table, 2)]
    ours["flagellum/table2/order"] = sum(ordered) / len(ordered)
    for order in range(6):
        ours[f"flagellum/fig3/order{order}/speed"] = speed[f"order{order}"]
    for order in (1, 3):
        gain = speed[f"order{order}"] / speed[f"order{order - 1}"] - 1
        ours[f"flagellum/fig3/order{order}/increment"] = 100 * gain
    ours["flagellum/rigid/speed"] = speed["old_rigid"]
    ours["flagellum/soft/speed"] = speed["old_soft"]
    return ours
