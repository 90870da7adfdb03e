"""A corrected simulator as labelled data: over its grid, at the experiments, and at those to make next."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from .conditions import Experiments
from .gaussian_process import Surface
from .method import Corrected
from .next_experiment import Next

if TYPE_CHECKING:
    import xarray as xr

_TAKEN = ("simulated", "parameter", "measured", "predicted", "expected", "reason")


def corrected_data(
    fitted: Corrected,
    simulated: "xr.DataArray",
    experiments: Experiments,
    left_out: Surface,
    planned: Sequence[Next] = (),
) -> "xr.Dataset":
    """All that is known after a correction of `simulated`, the grid that the table was made of.

    - over the conditions: the quantity by its own name, corrected, and `_error` behind it, its standard error;
      `simulated` with the nominal parameter; `parameter` and `parameter_error` (NaN where none is told).
    - over `experiment`: `measured`, `measured_error`, `simulated_there`, `parameter_there`, and what the others tell of
      it, `predicted` and `predicted_error` (`leave_one_out`); its conditions are `measured_<name>`.
    - over `next`: `expected`, `expected_error`, `reason`; its conditions are `next_<name>`.

    Attributes name the `quantity`, its `conditions` and the `parameter`.
    """
    import xarray as xr

    table, grid, told = fitted.table, fitted.table.points, fitted.field is not None

    def unit(name: str) -> dict[str, str]:
        return {"units": str(simulated[name].attrs.get("units", ""))}

    def parameter(points: Float[np.ndarray, "n d"]) -> Surface:
        none = np.full(len(points), np.nan)
        return fitted.parameter(points) if told else Surface(none, none)

    name, own = str(simulated.name), unit(table.called) if told else {"units": ""}
    name = "corrected" if name in _TAKEN or name in table.names else name
    found, field, value = fitted.predict(grid), parameter(grid), {"units": table.unit}
    over = {
        name: (found.mean, value),
        f"{name}_error": (found.error, value),
        "simulated": (table.simulated(grid)[0], value),
        "parameter": (field.mean, own),
        "parameter_error": (field.error, own),
    }
    there = {
        "measured": (experiments.values, value),
        "measured_error": (experiments.errors, value),
        "simulated_there": (table.simulated(experiments.conditions)[0], value),
        "parameter_there": (parameter(experiments.conditions).mean, own),
        "predicted": (left_out.mean, value),
        "predicted_error": (left_out.error, value),
    }
    later = {
        "expected": (np.array([one.expected for one in planned], float), value),
        "expected_error": (np.array([one.error for one in planned], float), value),
        "reason": (np.array([one.reason for one in planned], str), {}),
    }
    points = np.array([one.conditions for one in planned]).reshape(-1, len(table.names))
    shape, names = tuple(x.size for x in table.levels), table.names
    return xr.Dataset(
        {key: (names, x.reshape(shape), attrs) for key, (x, attrs) in over.items()}
        | {key: ("experiment", x, attrs) for key, (x, attrs) in there.items()}
        | {key: ("next", x, attrs) for key, (x, attrs) in later.items()},
        coords={key: (key, x, unit(key)) for key, x in zip(names, table.levels, strict=True)}
        | {f"measured_{k}": ("experiment", x, unit(k)) for k, x in zip(names, experiments.conditions.T, strict=True)}
        | {f"next_{k}": ("next", x, unit(k)) for k, x in zip(names, points.T, strict=True)},
        attrs={"quantity": name, "parameter": table.called if told else ""},
    )
