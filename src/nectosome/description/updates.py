"""Update rates of servos: which a robot has, and what goes with them."""

import math
from collections.abc import Iterable

from nectosome.description.robot import RobotDescription, resolve
from nectosome.io.schema.structure import numeric_values
from nectosome.units import InputError, show_quantity

_MOST = 50  # cycles in a period that is proposed
_DENSE = 1000  # samples of a cycle
_FIELD = ".update_rate"


def update_rates(description: RobotDescription) -> tuple[float, ...]:
    """Rates [Hz] at which the sampled loops of its servos update."""
    return tuple(value for path, value in numeric_values(description).items() if is_update_rate(path))


def is_update_rate(path: str) -> bool:
    """Whether a quantity is the update rate of a loop."""
    return path.endswith(_FIELD)


def check_no_update_rate(description: RobotDescription, names: Iterable[str]) -> None:
    """Raise InputError where one of these quantities is an update rate, which is fixed and has no derivatives."""
    for name in names:
        if any(map(is_update_rate, resolve(description, name))):
            why = "neither changes within a motion nor has derivatives: updates come or go one by one."
            raise InputError(f"{why} Set it, or sweep a list of rates.", field=name)


def check_updates(rates: Iterable[float], period: float) -> None:
    """Raise InputError where a period [s] is not that of a loop: its updates at a rate [Hz] are no whole number."""
    for rate in rates:
        if not _fits(rate, period):
            n = rate * period
            fitting = [show_quantity(k / period, "frequency") for k in (math.floor(n), math.ceil(n)) if k > 0]
            cycles = next((k for k in range(2, _MOST + 1) if _fits(rate, k * period)), None)
            longer = cycles and f", the period {show_quantity(cycles * period, 'time')} ({cycles} cycles)"
            shown = show_quantity(rate, "frequency"), show_quantity(period, "time")
            why = f"at {shown[0]} a loop has {n:.4g} updates in a period of {shown[1]}: it does not repeat itself."
            way_out = f"Take {' or '.join(fitting)}{longer or ''}, or no update_rate, for a continuous loop."
            raise InputError(f"{why} {way_out}", field="update_rate")


def samples_at_updates(rates: Iterable[float], period: float, samples: int) -> int:
    """At least `samples` even times from 0 to a period [s], with all updates among them and three times between.

    `samples` where that took more than a thousand: the jumps at so many updates are small.
    """
    each = 4 * math.lcm(*(round(rate * period) for rate in rates))
    return samples if each > _DENSE else -(-(samples - 1) // each) * each + 1


def _fits(rate: float, period: float) -> bool:
    """Whether the period ends with an update, as near as `nectosome.core.updates` tells times apart."""
    n = round(rate * period)
    return n > 0 and abs(n / rate - period) <= 1e-12 * max(1.0, period)
