"""Friction tests of two pneumatic actuators (3D-printed-pneumatic-actuator, E. Zillen, TU Delft; CC0).

An actuator under constant pressure is drawn out and let back, ten times; the difference of both directions is friction.
"""

from importlib.resources import as_file, files
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from nectosome.measure import calibrate, read
from nectosome.measure.signals import StrokeWindow, split, strokes

_EXCURSION = 10e-3  # m, between turning points
_PLACES = np.linspace(5e-3, 30e-3, 26)  # m, at which strokes out and back are compared; turns lie outside
_SENSORS = {"laser": "distance", "pressure_sensor": "pressure", "force_sensor": "force"}


class FrictionTest(NamedTuple):
    """What a file comes to; arrays by run."""

    recording: xr.Dataset
    runs: list[tuple[StrokeWindow, StrokeWindow]]  # strokes out and back
    friction: np.ndarray  # half the mean difference of the pulls out and back [N]
    loop_area: np.ndarray  # work lost in a run between the first and the last place [J]
    pulls: np.ndarray  # pull on the strokes out and back at `places` [run, 2, place] [N]
    places: np.ndarray  # [m]
    calibrations: xr.Dataset  # gain and zero of each sensor, and what is left


def friction_test(path: Path) -> FrictionTest:
    """Read a file and split it into runs, each a stroke out and back. Raises InputError where it cannot be read."""
    with as_file(files("nectosome.papers").joinpath("measure", "pneumatic.yaml")) as sheet:
        recording = read(path, sheet)
    found = strokes(recording["distance"], _EXCURSION)
    pairs = [(a, b) for a, b in pairwise(found) if a.change > 0 > b.change]
    pulls = np.array([[_pull(part) for part in split(recording, pair)] for pair in pairs])
    difference = pulls[:, 0] - pulls[:, 1]
    return FrictionTest(
        recording,
        pairs,
        0.5 * difference.mean(axis=1),
        np.trapezoid(difference, _PLACES, axis=1),
        pulls,
        _PLACES,
        xr.concat(
            [calibrate(recording[sensor], recording[quantity]) for sensor, quantity in _SENSORS.items()],
            xr.DataArray(list(_SENSORS), dims="sensor", name="sensor"),
        ),
    )


def _pull(stroke: xr.Dataset) -> np.ndarray:
    """Pull at `_PLACES` on a stroke in one direction, but for noise [N]."""
    order = np.argsort(stroke["distance"].values, kind="stable")
    return np.interp(_PLACES, stroke["distance"].values[order], stroke["force"].values[order])
