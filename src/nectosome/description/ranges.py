"""Ranges in which the models of loads hold, by dimensionless numbers of the flow."""

import math
from typing import NamedTuple

NUMBERS = {
    "reynolds": "Reynolds number",
    "keulegan_carpenter": "Keulegan-Carpenter number",
    "reduced_frequency": "reduced frequency",
    "stalled": "share of time beyond stall",
    "aspect_ratio": "aspect ratio",
    "formation": "formation number",
}
"""Numbers of the flow about a load, in the order in which results have them."""

TOWED = "tow it, or fit one measured speed"
SHAKEN = "let it swing on a spring in water"
THRUST = "measure the held robot's thrust"
BENT = "hang a weight on it, fit its shape"
SWUNG = "let it swing out, and fit its decay"
"""Experiments that tell a number better than the range of its class, `Uncertainty`."""

YIELDS, LOSES = 0.1, 0.4
"""By how much one modulus and one loss of a soft material are off in another motion than that which told them.

A loss factor of 0.1 makes a material 15 % stiffer over a decade of frequency (Kramers and Kronig), and elastomers
become softer with the strain. What has a constant loss factor has half the viscosity at twice the frequency.
"""


class Range(NamedTuple):
    """In which range of one of the `NUMBERS` a model holds, and what happens beyond."""

    number: str
    low: float
    high: float
    beyond: str  # what happens there, a clause
    source: str

    def holds(self, value: float) -> bool:
        """Whether a number is within; also where it is not known, NaN."""
        return not (value < self.low or value > self.high)

    @property
    def words(self) -> str:
        """The range, as in "at least 100"."""
        low, high = _plain(self.low), _plain(self.high)
        if math.isinf(self.high):
            return f"at least {low}"
        return f"up to {high}" if self.low == 0 else f"{low} to {high}"


def at_least(number: str, low: float, beyond: str, source: str) -> Range:
    """A range without an upper end."""
    return Range(number, low, math.inf, beyond, source)


def up_to(number: str, high: float, beyond: str, source: str) -> Range:
    """A range without a lower end."""
    return Range(number, 0.0, high, beyond, source)


def _plain(value: float) -> str:
    """A number as people write it, as in 2e5."""
    return f"{value:g}" if value < 1e5 else f"{value:.0e}".replace("e+0", "e")


QUADRATIC = at_least(
    "reynolds",
    100.0,
    "the coefficient of a slower flow is larger, and not constant; below 0.1 a rod or a cylinder takes stokes_drag",
    "Tritton 1959, Hoerner 1965",
)
"""Where drag goes with the square of speed: cylinders across a flow have 1.0 to 1.2 from 1e3 to 2e5."""
