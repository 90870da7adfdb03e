"""What a fit of a robot found, as labelled data."""

import json
from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from nectosome.io.dimensions import DIMENSIONS

from .metrics import range_errors
from .robot_fit import RobotFit
from .robot_trials import RobotTrial

if TYPE_CHECKING:
    import xarray as xr


def robot_data(found: RobotFit, held_out: "Collection[tuple[RobotTrial, np.ndarray]]" = ()) -> "xr.Dataset":
    """Parameters, and the robot beside recordings that were fitted and others, in SI units.

    - over `parameter` (`unit`): `value`, its 95 % interval `low` to `high`, `told`, and `before`, as it was described.
    - over `column` (`reading`, `units_of`): `error`, its standard error.
    - over `recording` (`used`: train or test) and `column`: `e_rmsp`, `e_mp` [percent of its range].
    - over `sample`: `time`, `measured`, `computed`; `of` and `of_column` are places of its recording and its column.

    Attributes: `starts`, `agree`, and `words`, `warnings`, `notes` as JSON.
    """
    import xarray as xr

    rows = [*zip(found.trials, found.computed, strict=True), *held_out]
    of, column, time, measured, computed = [], [], [], [], []
    errors = np.full((len(rows), len(found.compared), 2), np.nan)
    for i, (trial, y) in enumerate(rows):
        for c in range(len(found.compared)):
            there = np.isfinite(trial.measured[c]) & np.isfinite(y[c])
            if there.any():  # a robot that was held out may be one that cannot be simulated
                errors[i, c] = range_errors(y[c][there], trial.measured[c][there])
            of += [i] * trial.time.size
            column += [c] * trial.time.size
            time.append(trial.time)
            measured.append(trial.measured[c])
            computed.append(y[c])
    low, high = np.array([(one.low, one.high) for one in found.told.intervals()]).T
    notes = [f"{trial.file}: {note}" for trial, _ in rows for note in trial.notes]
    return xr.Dataset(
        {
            "value": ("parameter", found.theta),
            "low": ("parameter", low),
            "high": ("parameter", high),
            "before": ("parameter", found.before),
            "told": ("parameter", found.told.told),
            "error": ("column", found.errors),
            "e_rmsp": (("recording", "column"), errors[..., 0], {"units": "percent"}),
            "e_mp": (("recording", "column"), errors[..., 1], {"units": "percent"}),
            "time": ("sample", np.concatenate(time), {"units": "s"}),
            "measured": ("sample", np.concatenate(measured)),
            "computed": ("sample", np.concatenate(computed)),
        },
        coords={
            "parameter": [v.name for v in found.variables],
            "unit": ("parameter", [DIMENSIONS[v.dimension].unit for v in found.variables]),
            "column": [one.column for one in found.compared],
            "reading": ("column", [one.text for one in found.compared]),
            "units_of": ("column", [one.reading.unit for one in found.compared]),
            "recording": [trial.name for trial, _ in rows],
            "used": ("recording", ["train"] * len(found.trials) + ["test"] * (len(rows) - len(found.trials))),
            "of": ("sample", of),
            "of_column": ("sample", column),
        },
        attrs={
            "starts": found.starts,
            "agree": found.agree,
            "words": json.dumps(found.told.words()),
            "warnings": json.dumps(found.warnings),
            "notes": json.dumps(notes),
        },
    )
