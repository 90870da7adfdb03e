"""Data that others published, read as they are: friction of pneumatic actuators, swimming of catsharks."""

import numpy as np
import xarray as xr

from ..study import Progress, StudyPart
from .catshark import by_speed, catsharks
from .figures import panels
from .friction import TESTS, Comparison, FrictionTest, compare, friction_test, runs_of, to_dataset

__all__ = ["panels", "part"]


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows; there is nothing to shorten."""
    del quick
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
    return StudyPart(numbers, data, runs, recorded=True)


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
