"""Steady swimming of small-spotted catsharks (F. Berio and others, scanicula_steady_swimming; MIT).

The Strouhal number of each swim is computed again from its tail beat and compared with the number of the authors.
"""

from importlib.resources import as_file, files

import numpy as np
import xarray as xr

from nectosome.measure import Sheet, read
from nectosome.measure.sheet import NO_TIME, SheetEntry

_SHEET = Sheet(
    about="steady swimming of small-spotted catsharks",
    time=NO_TIME,
    columns={
        "speed_class": SheetEntry(column="speedBL", unit="1/s", about="speed of the flume in body lengths"),
        "length": SheetEntry(column="TL", unit="cm", about="total length"),
        "frequency": SheetEntry(column="TBF", unit="Hz", about="tail beat frequency"),
        "amplitude": SheetEntry(column="tailAmplitude", unit="", about="tail amplitude in body lengths"),
        "speed": SheetEntry(column="U", unit="m/s", about="swimming speed"),
        "strouhal": SheetEntry(column="St", unit="", about="Strouhal number as given"),
    },
)


def catsharks() -> xr.Dataset:
    """All swims, with the Strouhal number f A L / U as `again`."""
    with as_file(files("nectosome_studies").joinpath("catshark", "midline_kinematics.txt")) as table:
        swims = read(table, _SHEET)
    again = swims["frequency"] * swims["amplitude"] * swims["length"] / swims["speed"]
    return swims.assign(again=again.assign_attrs(units="", long_name="Strouhal number f A L / U"))


def by_speed(swims: xr.Dataset) -> xr.Dataset:
    """Quartiles (speed_class, quartile) of frequency, amplitude and Strouhal number, and how many swims they are of."""
    classes, counts = np.unique(swims["speed_class"].values, return_counts=True)
    quartiles = {
        name: [np.quantile(swims[name].values[swims["speed_class"].values == c], (0.25, 0.5, 0.75)) for c in classes]
        for name in ("frequency", "amplitude", "again")
    }
    return xr.Dataset(
        {name: (("speed_class", "quartile"), values) for name, values in quartiles.items()}
        | {"count": ("speed_class", counts)},
        coords={"speed_class": classes, "quartile": [0.25, 0.5, 0.75]},
    )
