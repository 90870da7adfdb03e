"""The pneumatic tail of the paper as a model that was identified, and as a file of one."""

from pathlib import Path

import numpy as np

from nectosome.controllers import PIDGains
from nectosome.identification.fits.identifiability import Interval
from nectosome.identification.hysteresis.files import HysteresisFit
from nectosome.identification.hysteresis.fit import Identified
from nectosome.io import save_dataset
from nectosome.rigs import CommandLimits, Limits, MeasurementLimits
from nectosome_studies.fishtail import plant
from nectosome_studies.fishtail.plant import NOISE, recorded

MM, BAR, DT = 1e-3, 1e5, 5e-3
COMMAND, MEASURED = (
    CommandLimits(-plant.LARGEST, plant.LARGEST, plant.LIMIT),
    MeasurementLimits(-25 * MM, 25 * MM, 5 * MM),
)
LIMITS = Limits({"pressure": COMMAND}, {"displacement": MEASURED})
GAINS = PIDGains(np.array([[0.00523, 0.866, 0.00489]]) * BAR / MM)


def tail() -> Identified:
    """Table 1 of the paper."""
    hysteresis = plant.hysteresis()
    slopes = np.cumsum([float(hysteresis.direct), *np.asarray(hysteresis.weights)])
    theta = {"frequency": plant.FREQUENCY, "damping": plant.DAMPING}
    values = theta | {f"slope{k}": slope for k, slope in enumerate(slopes)}
    intervals = {name: Interval(0.9 * value, 1.1 * value, True, True) for name, value in values.items()}
    return Identified(theta, intervals, np.asarray(hysteresis.thresholds), slopes, NOISE, 2, ())


def save_tail(path: Path) -> None:
    """As `identify hysteresis --save` writes it."""
    save_dataset(HysteresisFit(tail(), (recorded(1.5),)).to_dataset(), path)
