"""Files as `measure`, `measure --means` and `track` save them, of small synthetic data."""

import json
from pathlib import Path

import numpy as np
import xarray as xr
from tests.synthetic_campaign import FREQUENCIES, A, recording

from nectosome.measure import read
from nectosome.measure.condition_means import condition_means


def recorded(folder: Path) -> xr.Dataset:
    """A recording of a CSV file in the folder: a push of 1 to 3 N."""
    file = folder / "push.csv"
    file.write_text("time (s),push (N),angle (deg)\n0,1,10\n1,2,20\n2,3,30\n")
    return read(file).load()


def means() -> xr.Dataset:
    """Of a force at two conditions, each measured twice."""
    runs = [recording(A[0], f, name=f"{k}.csv", scale=1 + 0.01 * k) for k, f in enumerate([*FREQUENCIES[:2]] * 2)]
    return condition_means(runs, "force")


def tracked() -> xr.Dataset:
    """Two segments with a joint in five frames, in one of which the second is not seen."""
    time, seen = np.arange(5) / 25, np.ones((5, 2))
    seen[3, 1] = np.nan
    direction = np.stack([0 * time, np.sin(time)], axis=1) * seen
    about = {"file": "film.mp4", "reader": "video", "found": ["25 frames a second"], "warnings": ["tail: covered"]}
    over = ("time", "segment")
    return xr.Dataset(
        {
            "direction": (over, direction, {"units": "rad"}),
            "length": (over, 0.1 * seen, {"units": "m"}),
            "quality": (over, 0.9 * seen, {"units": "1"}),
            "reason": (over, np.isnan(seen).astype(np.int8), {"units": "1"}),
            "joint_angle": (("time", "joint"), np.diff(direction, axis=1), {"units": "rad"}),
        },
        {"time": ("time", time, {"units": "s"}), "segment": ["head", "tail"], "joint": ["head-tail"]},
        {"title": "film.mp4", "provenance": json.dumps(about)},
    )
