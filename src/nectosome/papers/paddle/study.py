"""The study of the paddle: thrust over strokes, joints and hinges (Experiment A)."""

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from nectosome.robots import build, describe

from ..study import Progress, Study, printed, score
from . import thrust

if TYPE_CHECKING:
    import xarray as xr

NAME = "paddle"
TITLE = "Flexible passive joint paddle"
ABOUT = (
    "A servo rows a paddle of rigid segments on flexible joints with stops: flat in the power stroke, folded in the "
    "recovery stroke. Thrust is what the load cell that holds it must give. All numbers are predictions by the paper's "
    "model with the parameters of its Tables 1 and 2; nothing is fitted, and no raw measurements were published."
)
_JOINTS = (1, 2, 3)
_CYCLES = {"n1_1.1Hz": (1, 1.1), "n2_1.1Hz": (2, 1.1), "n3_1.1Hz": (3, 1.1)}  # joints, frequency [Hz]
_CYCLES |= {"n1_0.6Hz": (1, 0.6), "n2_0.6Hz": (2, 0.6), "n3_0.6Hz": (3, 0.6)}  # of Fig. 4
_CYCLES |= {"n3_0.9Hz": (3, 0.9), "n3_1.0Hz": (3, 1.0)}


def run(quick: bool, progress: Progress) -> Study:
    """All rows and figures; `quick` sweeps over coarser grids."""
    began = time.perf_counter()
    book = printed(NAME)
    data = _sweeps(quick, progress)
    runs: dict[str, xr.Dataset] = {}
    for i, (name, (joints, frequency)) in enumerate(_CYCLES.items()):
        progress(f"cycle of FP{joints}JP at {frequency} Hz", 0.5 + 0.5 * i / len(_CYCLES))
        runs[name] = thrust.cycle(joints, frequency)
    numbers = _numbers(data, runs)
    progress("scorecard", 1.0)
    missing = sorted(set(numbers) ^ set(book))
    if missing:
        raise RuntimeError(f"scorecard rows without a number, or numbers without a row: {missing}")
    rows = [score(row, entry, numbers[row]) for row, entry in book.items()]
    return Study(NAME, TITLE, ABOUT, rows, runs, time.perf_counter() - began, data)


def _sweeps(quick: bool, tell: Progress) -> "dict[str, xr.Dataset]":
    """By figure: `strokes` (joints, amplitude, frequency), `joints` (joints, ...), `hinges` (thickness, length)."""
    import xarray as xr

    amplitudes, frequencies = np.arange(30, 76, 15 if quick else 5), np.arange(3, 14, 2 if quick else 1) / 10
    tell("strokes", 0.0)
    strokes = thrust.over_strokes(_JOINTS, np.radians(amplitudes).tolist(), frequencies.tolist())
    tell("joints", 0.25)
    others = thrust.over_strokes((0, 4, 5), [math.radians(75)], [1.1])
    one = strokes.sel(amplitude=others["amplitude"], frequency=others["frequency"])
    tell("hinges", 0.4)
    steps = (4, 6) if quick else (13, 9)
    hinges = thrust.over_hinges(np.linspace(2e-3, 8e-3, steps[0]).tolist(), np.linspace(0.03, 0.15, steps[1]).tolist())
    return {"strokes": strokes, "joints": xr.concat([others, one], "joints").sortby("joints"), "hinges": hinges}


def _numbers(data: "dict[str, xr.Dataset]", runs: "dict[str, xr.Dataset]") -> dict[str, float]:
    """Our numbers by scorecard row."""
    strokes, by_joints = data["strokes"]["thrust"], data["joints"]["thrust"].squeeze()
    one, two, three = (strokes.sel(joints=n) for n in _JOINTS)
    springs = [attached.load for attached in build(describe("paddle")).loads if attached.name == "spring"]
    return (
        {
            "paddle/eq16/k": float(springs[0].stiffness),
            "paddle/fig9/order-share": float(((three > two) & (two > one)).mean()),
            "paddle/rigid/thrust": float(by_joints.sel(joints=0)),
        }
        | {f"paddle/fig9/n{n}/75deg/1.1Hz/thrust": float(by_joints.sel(joints=n)) for n in _JOINTS}
        | {f"paddle/fig9/ratio/{f}Hz": thrust.gain_over_loss(runs[f"n3_{f}Hz"]) for f in ("0.9", "1.0")}
    )
