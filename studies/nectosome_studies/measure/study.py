"""Data that others published, read as they are: friction of pneumatic actuators, swimming of catsharks."""

import time

import numpy as np
import xarray as xr

from ..study import Progress, Study, printed, scored
from . import figures
from .catshark import by_speed, catsharks
from .friction import TESTS, Comparison, FrictionTest, compare, friction_test, runs_of, to_dataset

NAME = "measure"
TITLE = "Friction of pneumatic actuators"
ABOUT = (
    "Recordings that others made and published, read as they are: friction tests of two pneumatic actuators (E. "
    "Zillen, TU Delft; CC0), to half of which a model of friction is fitted, and the swimming of catsharks (F. Berio "
    "and others; MIT)."
)


def run(quick: bool, progress: Progress) -> Study:
    """All rows; there is nothing to shorten."""
    del quick
    began = time.perf_counter()
    numbers: dict[str, float | None] = {}
    runs: dict[str, xr.Dataset] = {}
    data: dict[str, xr.Dataset] = {}
    for i, (key, file) in enumerate(TESTS.items()):
        progress(file, i / 3)
        test = friction_test(key)
        strokes = runs_of(test)
        found = compare(strokes)
        numbers |= {f"measure/pneumatic/{key}/{name}": x for name, x in _numbers(test, found).items()}
        data |= {f"pneumatic_{key}": _strokes(test), f"calibration_{key}": test.calibrations}
        data[f"friction_{key}"] = to_dataset(strokes, found)
        runs[key] = test.recording
    progress("catsharks", 2 / 3)
    swims = catsharks()
    off = np.abs(swims["again"].values - swims["strouhal"].values)
    numbers["measure/catshark/strouhal-max-difference"] = float(np.max(off))
    data["catshark"] = by_speed(swims)
    runs["catshark"] = swims
    progress("scorecard", 1.0)
    rows = scored(printed(NAME), numbers)
    return Study(
        NAME,
        TITLE,
        ABOUT,
        rows,
        runs,
        time.perf_counter() - began,
        data,
        figures=lambda data, runs: figures.panels(data),
        recorded=True,
    )


def _numbers(test: FrictionTest, found: Comparison) -> dict[str, float]:
    dahl = found.fits["dahl"]
    out = {
        "runs": float(test.friction.size),
        "friction": float(test.friction.mean()),
        "loop-area": float(test.loop_area.mean()),
        "curve/held-out-e_rmsp": found.curve,
        "repeat/held-out-e_rmsp": found.repeat,
        "dahl/stiffness": float(dahl.theta[1]),
        "dahl/train-e_rmsp": dahl.train,
    }
    for name, fit in found.fits.items():
        out |= {f"{name}/limit": float(fit.theta[0]), f"{name}/held-out-e_rmsp": fit.held_out}
    return out


def _strokes(test: FrictionTest) -> xr.Dataset:
    """What the report draws of a friction test."""
    return xr.Dataset(
        {
            "pull": (("run", "stroke", "place"), test.pulls, {"units": "N"}),
            "friction": ("run", test.friction, {"units": "N"}),
            "loop_area": ("run", test.loop_area, {"units": "J"}),
        },
        coords={"stroke": ["out", "back"], "place": ("place", test.places, {"units": "m"})},
        attrs={"title": str(test.recording.attrs["title"])},
    )
