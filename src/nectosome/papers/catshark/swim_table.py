"""The table of F. Berio and others, which ships beside this file, and how its column of wavelengths may be read.

Berio, Morerod, Di Santo, "Speed-dependent locomotor patterns during steady swimming in a demersal shark", repository
scanicula_steady_swimming (MIT, `midline_kinematics.LICENSE`): 51 swims of five small-spotted catsharks.
"""

from importlib.resources import files
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

VISCOSITY = 1e-6  # of the water [m2/s]: what the table's Reynolds numbers U L/nu say
POINTS = 0.79  # wavelength [L] by the points of three swims, see `wavelengths`


class SwimTable(NamedTuple):
    """Swims, one a row; L is the total length."""

    specimen: np.ndarray
    speed_class: Float[np.ndarray, "n"]  # of the flume [L/s]
    length: Float[np.ndarray, "n"]  # [m]
    frequency: Float[np.ndarray, "n"]  # of the tail [Hz]
    head: Float[np.ndarray, "n"]  # excursion from side to side [L]
    tail: Float[np.ndarray, "n"]  # [L]; St = f A L/U holds with it
    wavelength: Float[np.ndarray, "n"]  # as printed, without a unit; its wave speed is f times it
    speed: Float[np.ndarray, "n"]  # [L/s]
    strouhal: Float[np.ndarray, "n"]


def table(only: str | None = None) -> SwimTable:
    """All swims, or those of one specimen."""
    text = files("nectosome.papers").joinpath("catshark", "midline_kinematics.txt").read_text(encoding="utf-8")
    rows = np.genfromtxt(text.splitlines(), delimiter=",", names=True, dtype=None, encoding="utf-8")
    rows = rows if only is None else rows[rows["specimen"] == only]
    length = rows["TL"] / 100
    return SwimTable(
        rows["specimen"],
        rows["speedBL"].astype(float),
        length,
        rows["TBF"],
        rows["headAmplitude"],
        rows["tailAmplitude"],
        rows["wavelength"],
        rows["U"] / length,
        rows["St"],
    )


def wavelengths(swims: SwimTable) -> dict[str, Float[np.ndarray, "n"]]:
    """Wavelengths of all swims [L], by ways to read them.

    - points: one length for all, by hand from the positions that the repository gives of points on the body: the lag
      from points at 0.35 and 0.45 L to the tip of the tail, by a harmonic at the printed frequency and a straight
      drift. Catshark 11 at 1 L/s gives 0.91, catshark 7 at 2 L/s 0.71, catshark 10 at 4 L/s 0.83 L; with a quadratic
      drift 0.84, 0.70 and 0.76: 0.79 on the mean. None of them are the printed 0.40, 0.57, 0.60, nor twice as much.
    - full: as printed, in body lengths.
    - half: printed were half waves, from one turning point to the next.
    - metres: as printed, in metres.
    """
    return {
        "points": np.full(swims.frequency.shape, POINTS),
        "full": swims.wavelength,
        "half": 2 * swims.wavelength,
        "metres": swims.wavelength / swims.length,
    }
