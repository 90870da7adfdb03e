"""What a run's page says of the flow about loads: a table of dimensionless numbers, and where a model is left."""

import numpy as np
import xarray as xr

from nectosome.description import RobotDescription
from nectosome.description.ranges import NUMBERS
from nectosome.solve import flow_rows, out_of_range
from nectosome.solve.mean_window import mean_weights, mean_window

from .markup import plain
from .still import html_table

_COLUMNS = {key: words for key, words in NUMBERS.items() if key != "aspect_ratio"}  # not of the flow


def regime_parts(run: xr.Dataset, robot: RobotDescription | None) -> list[str]:
    """The table and a sentence for each load whose model is left; nothing of runs without such numbers."""
    if robot is None or "flow_number" not in run:
        return []
    time = run["time"].values
    start = mean_window(time, run.attrs).start if time.size > 1 else 0.0
    weights = mean_weights(time, start, float(time[-1]))
    arrays = {name: run[name].values for name in ("load", "part", "flow_number")}
    arrays |= {name: np.tensordot(weights, run[name].values, axes=1) for name in ("load_power", "load_force")}
    rows = flow_rows(arrays, robot)
    if not rows:
        return []
    known = [key for key in _COLUMNS if any(row.numbers[key] == row.numbers[key] for row in rows)]
    heads = ("regime", "length", *(_COLUMNS[key] for key in known))
    cells = [(f"{row.name} on {row.where}", row.length, *(_shown(row.numbers[key]) for key in known)) for row in rows]
    warned = [f"<p>Warning: {plain(words)}.</p>" for words in out_of_range(arrays, robot)]
    return [html_table([heads, *cells]), *warned]


def _shown(value: float) -> str:
    return "" if np.isnan(value) else "infinite" if np.isinf(value) else f"{value:.4g}"
