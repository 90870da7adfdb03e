r"""Can a rotation and a translation (section 4.2, Algorithm 1) make the paddle's model agree with experiments?

The algorithm moves the points (A, f, F) of the model, as close as it can, onto those measured, and takes the thrust of
a moved point as that of its stroke. A rotation keeps distances: no thrust gets smaller by a share unless the points
turn away from their strokes. It depends on the units of the three axes, which the paper does not print: here all are
tried, the ranges of A and f being as long as 0.001 to 1000 N. An affine map $F' = c_0 + c_1 A + c_2 f + c_3 F$ of the
same experiments depends on none.

Synthetic experiments without noise, of two truths: Cn falls with amplitude and frequency, as in Fig. 5a; and there is a
plane besides, as a force that the rig adds.
"""

from collections.abc import Mapping
from itertools import product

import numpy as np
import xarray as xr
from jaxtyping import Float, Int

from nectosome.identification import SimToReal, align_points, errors_of

from .transfer import SyntheticCampaign, campaign

TRUTHS = {"falling": "multiplicative", "plane": "tilt"}  # by scorecard row
SHARE = 0.25  # that is measured, the largest of Table 3
_LENGTHS = np.logspace(-3, 3, 31)  # N


def corrected(simulated: xr.Dataset, truths: xr.Dataset) -> xr.Dataset:
    """Mean relative errors [percent] over all strokes (truth; by: start, rotation, affine).

    `start` is that of the model, `rotation` that in the units that suit it best.
    """
    cases = [campaign(simulated, truths.sel(truth=name), 0, 0.0) for name in TRUTHS.values()]
    errors = [_errors(one, one.rows(SHARE)) for one in cases]
    coords = {"truth": [*TRUTHS], "by": ["start", "rotation", "affine"]}
    return xr.Dataset({"error": (("truth", "by"), errors, {"units": "percent"})}, coords)


def _errors(one: SyntheticCampaign, rows: Int[np.ndarray, "m"]) -> tuple[float, float, float]:
    start, _ = one.table.simulated(one.table.points)
    affine = SimToReal("affine").fit(one.table, one.at(rows)).predict(one.table.points).mean
    strokes = one.table.in_box(one.table.points)
    in_all_units = (_rotated(strokes * scale, start, one.mean, rows) for scale in product(_LENGTHS, _LENGTHS))
    return _error(one, start), min(_error(one, thrust) for thrust in in_all_units), _error(one, affine)


def _rotated(
    strokes: Float[np.ndarray, "n 2"],
    start: Float[np.ndarray, "n"],
    measured: Float[np.ndarray, "n"],
    rows: Int[np.ndarray, "m"],
) -> Float[np.ndarray, "n"]:
    """Thrust after Algorithm 1, from the strokes that were measured; these are in newtons too."""
    points, targets = (np.column_stack([strokes, thrust]) for thrust in (start, measured))
    return align_points(points[rows], targets[rows])(points)[:, -1]


def _error(one: SyntheticCampaign, thrust: Float[np.ndarray, "n"]) -> float:
    none = np.zeros_like(thrust)
    return errors_of(thrust, one.mean, none, none).mean


def numbers(found: xr.Dataset) -> Mapping[str, float]:
    """By scorecard row."""
    return {
        f"paddle/rotation/{truth}/{by}": float(found["error"].sel(truth=truth, by=by))
        for truth in found["truth"].values
        for by in found["by"].values
    }
