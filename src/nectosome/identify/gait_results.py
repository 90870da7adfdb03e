"""What a fit of gaits found, as labelled data."""

import numpy as np
import xarray as xr

from nectosome.io.dimensions import DIMENSIONS

from .evolved import Evolved
from .gait import FEATURES, UNITS
from .gait_fit import GaitFit
from .identifiable import Identifiability
from .walks import Walked


def gait_data(fit: GaitFit, found: Evolved, walked: list[Walked], told: Identifiability, as_good: float) -> xr.Dataset:
    """Parameters, features, motion and history of a fit, in SI units.

    - over `parameter`: the best `value`, its range `low` to `high`; `good_low` to `good_high`, between which candidates
      lie that are as good, of a discrepancy of at most `as_good`; `told`, whether the features tell it.
    - over `trial` and `feature`: `target`, `reached`. Over `trial` and `sample`: `surge`, `heave`, `lean` in the
      window.
    - over `evaluation`: `discrepancy` (eq. 13), of all trials together.
    """
    good = found.close(as_good)
    best = found.rows[int(np.argmin(found.values[:, 0]))]
    series = np.stack([one.series[0] for one in walked])
    time = np.linspace(0.0, fit.window, series.shape[1])
    return xr.Dataset(
        {
            "value": ("parameter", best),
            "low": ("parameter", fit.ranges.bounds[:, 0]),
            "high": ("parameter", fit.ranges.bounds[:, 1]),
            "good_low": ("parameter", good.min(axis=0)),
            "good_high": ("parameter", good.max(axis=0)),
            "told": ("parameter", told.told),
            "target": (("trial", "feature"), np.array([trial.target for trial in fit.trials])),
            "reached": (("trial", "feature"), np.stack([one.gait[0] for one in walked])),
            "unit_of_feature": ("feature", list(UNITS)),
            "surge": (("trial", "sample"), series[..., 0], {"units": "m"}),
            "heave": (("trial", "sample"), series[..., 1], {"units": "m"}),
            "lean": (("trial", "sample"), series[..., 2], {"units": "rad"}),
            "discrepancy": ("evaluation", found.values[:, 0]),
        },
        {
            "parameter": list(fit.ranges.names),
            "feature": list(FEATURES),
            "time": ("sample", time, {"units": "s"}),
            "unit": ("parameter", [DIMENSIONS[v.dimension].unit for v in fit.variables]),
        },
        {"rank": told.rank, "as_good": as_good, "good": len(good), "ended": found.message},
    )
