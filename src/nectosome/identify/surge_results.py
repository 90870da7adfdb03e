"""What recordings tell of a body in surge, as labelled data: parameters, and speeds measured and computed."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .deviation import deviation
from .surge import Surge, SurgeRecording

if TYPE_CHECKING:
    import xarray as xr

_UNITS = {"added_mass": "kg", "drag": "kg/m", "alpha": "1/m", "gamma": "1/kg"}


def surge_data(found: Surge, train: Sequence[SurgeRecording], test: Sequence[SurgeRecording] = ()) -> "xr.Dataset":
    """Parameters and their motion beside recordings that were fitted (`train`) and others.

    - over `parameter` (added_mass, drag, and alpha, gamma of the linear model; `unit`): `value`, `error`, `percent`,
      and the 95 % interval, `low` to `high`.
    - over `recording` (its name; `used` says train or test): `deviation_mean`, `deviation_std`, `deviation_largest`
      [percent of the root mean square of the measured speed].
    - over `sample`, recording by recording (`of` is its place): `time`, `measured`, `computed`, `thrust`.

    Attributes: `method`, `mass`, and `warnings` as JSON.
    """
    import xarray as xr

    parts = found.physical, found.rate
    values, errors, percent = (np.concatenate([getattr(p, name) for p in parts]) for name in _EACH)
    low, high = np.concatenate([part.interval() for part in parts]).T
    over = {"value": values, "error": errors, "percent": percent, "low": low, "high": high}
    recordings = [*train, *test]
    computed = [found.speed(recording) for recording in recordings]
    deviations = np.array([deviation(r.speed, v) for r, v in zip(recordings, computed, strict=True)])
    names = ("deviation_mean", "deviation_std", "deviation_largest")
    along = {
        "time": ([r.time for r in recordings], "s"),
        "measured": ([r.speed for r in recordings], "m/s"),
        "computed": (computed, "m/s"),
        "thrust": ([r.trial.inputs[0](r.time) for r in recordings], "N"),
    }
    return xr.Dataset(
        {name: ("parameter", x) for name, x in over.items()}
        | {name: ("recording", x, {"units": "percent"}) for name, x in zip(names, deviations.T, strict=True)}
        | {name: ("sample", np.concatenate(x), {"units": unit}) for name, (x, unit) in along.items()},
        coords={
            "parameter": [*_UNITS],
            "unit": ("parameter", [*_UNITS.values()]),
            "recording": [r.name for r in recordings],
            "used": ("recording", ["train"] * len(train) + ["test"] * len(test)),
            "of": ("sample", np.repeat(np.arange(len(recordings)), [len(r.time) for r in recordings])),
        },
        attrs={"method": found.method, "mass": found.mass, "warnings": json.dumps(found.warnings)},
    )


_EACH = ("values", "errors", "percent")
