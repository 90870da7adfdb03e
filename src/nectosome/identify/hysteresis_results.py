"""What recordings tell of a soft actuator, as labelled data: parameters, and displacements measured and computed."""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from nectosome.actuators import respond
from nectosome.io import InputError

from .hysteresis import Identified, PressureTrial
from .metrics import range_errors

if TYPE_CHECKING:
    import xarray as xr


def hysteresis_data(
    found: Identified, train: Sequence[PressureTrial], test: Sequence[PressureTrial] = ()
) -> "xr.Dataset":
    """Parameters, and the model beside recordings that were fitted (`train`) and others.

    - over `parameter` (frequency, damping, slew if fitted, slopes; `unit`): `value`, and the 95 % interval, `low` to
      `high`; `threshold` [Pa] of the play that a slope begins with, 0 for the first and for what is no slope.
    - over `recording` (its name; `used` says train or test): `e_rmsp`, `e_mp` [percent of its range].
    - over `sample`, recording by recording (`of` is its place): `time`, `pressure`, `measured`, `computed`.

    Attributes: `order` of the transfer function, `noise` [m], and `warnings` as JSON.
    """
    import xarray as xr

    names, recordings, block = [*found.intervals], [*train, *test], found.block()
    computed = [np.asarray(respond(block, one.pressure, one.dt)) for one in recordings]
    errors = np.array([range_errors(y, one.displacement) for y, one in zip(computed, recordings, strict=True)])
    along = {
        "time": ([one.dt * np.arange(len(one.pressure)) for one in recordings], "s"),
        "pressure": ([one.pressure for one in recordings], "Pa"),
        "measured": ([one.displacement for one in recordings], "m"),
        "computed": (computed, "m"),
    }
    plays = np.concatenate([np.zeros(len(found.theta) + 1), found.thresholds])
    return xr.Dataset(
        {
            "value": ("parameter", np.array([*found.theta.values(), *found.slopes])),
            "low": ("parameter", [one.low for one in found.intervals.values()]),
            "high": ("parameter", [one.high for one in found.intervals.values()]),
            "threshold": ("parameter", plays, {"units": "Pa"}),
            "e_rmsp": ("recording", errors[:, 0], {"units": "percent"}),
            "e_mp": ("recording", errors[:, 1], {"units": "percent"}),
        }
        | {name: ("sample", np.concatenate(x), {"units": unit}) for name, (x, unit) in along.items()},
        coords={
            "parameter": names,
            "unit": ("parameter", [_UNITS[name.rstrip("0123456789")] for name in names]),
            "recording": [one.name for one in recordings],
            "used": ("recording", ["train"] * len(train) + ["test"] * len(test)),
            "of": ("sample", np.repeat(np.arange(len(recordings)), [len(one.pressure) for one in recordings])),
        },
        attrs={"order": found.order, "noise": found.noise, "warnings": json.dumps(found.warnings)},
    )


def saved_model(data: "xr.Dataset") -> Identified:
    """The model that `hysteresis_data` holds; its intervals stay there. Raises InputError for data of another kind."""
    if not {"value", "low", "high", "threshold"} <= set(data) or "order" not in data.attrs:
        raise InputError("holds no hysteresis: a file that `nectosome identify fishtail --save` wrote is needed.")
    names = [str(name) for name in data["parameter"].values]
    slopes = np.array([name.startswith("slope") for name in names])
    value = data["value"].values
    return Identified(
        {name: float(x) for name, x, is_slope in zip(names, value, slopes, strict=True) if not is_slope},
        {},
        data["threshold"].values[slopes][1:],
        value[slopes],
        float(data.attrs["noise"]),
        int(data.attrs["order"]),
        tuple(json.loads(data.attrs["warnings"])),
    )


# of what is told: scale and unit by the unit in SI
BENCH_UNITS = {"m/Pa": (1e8, "mm/bar"), "Pa/s": (1e-5, "bar/s"), "rad/s": (1.0, "rad/s"), "": (1.0, "")}
_UNITS = {"frequency": "rad/s", "damping": "", "slew": "Pa/s", "slope": "m/Pa"}
