"""Steady swimming of small-spotted catsharks (F. Berio and others, scanicula_steady_swimming; MIT).

The Strouhal number of each swim is computed again from its tail beat and held against the number the authors give.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from nectosome.measure import Sheet, read
from nectosome.measure.sheet import SheetEntry, Time

_SHEET = Sheet(
    about="steady swimming of small-spotted catsharks",
    time=Time(absent=True),
    columns={
        "speed_class": SheetEntry("speedBL", unit="1/s", about="speed of the flume in body lengths"),
        "length": SheetEntry("TL", unit="cm", about="total length"),
        "frequency": SheetEntry("TBF", unit="Hz", about="tail beat frequency"),
        "amplitude": SheetEntry("tailAmplitude", unit="", about="tail amplitude in body lengths"),
        "speed": SheetEntry("U", unit="m/s", about="swimming speed"),
        "strouhal": SheetEntry("St", unit="", about="Strouhal number as given"),
    },
)


class Catsharks(NamedTuple):
    """All swims, and medians with quartiles by speed class."""

    swims: xr.Dataset  # with `again`, the Strouhal number f A L / U
    by_speed: xr.Dataset  # along `speed_class`: quartiles [3] of what varies with it


def catsharks(path: Path) -> Catsharks:
    """Read the table and compute Strouhal numbers anew. Raises InputError where it cannot be read."""
    swims = read(path, _SHEET)
    again = swims["frequency"] * swims["amplitude"] * swims["length"] / swims["speed"]
    swims = swims.assign(again=again.assign_attrs(units="", long_name="Strouhal number f A L / U"))
    classes = np.unique(swims["speed_class"].values)
    names = ("frequency", "amplitude", "again")
    quartiles = {
        name: [np.quantile(swims[name].values[swims["speed_class"].values == c], (0.25, 0.5, 0.75)) for c in classes]
        for name in names
    }
    counts = [int(np.sum(swims["speed_class"].values == c)) for c in classes]
    return Catsharks(
        swims,
        xr.Dataset(
            {name: (("speed_class", "quartile"), np.array(values)) for name, values in quartiles.items()}
            | {"count": ("speed_class", counts)},
            coords={"speed_class": classes, "quartile": [0.25, 0.5, 0.75]},
        ),
    )
