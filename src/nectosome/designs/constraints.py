"""Limits on a motion, and a motor's torque-speed line; written as people write them."""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nectosome.units import InputError, check_share, format_quantity, parse_quantity, read_quantity, shorten

from .quantities import QUANTITIES, check_quantity


class Constraint(ABC):
    """A weighted sum of quantities that must not be more than 0, in units of its limit."""

    quantity: str  # that is limited
    probability: float = 0.0  # with which it is kept; 0: by the robot of the design's file

    @property
    @abstractmethod
    def weights(self) -> dict[str, float]:
        """Weight of each quantity that counts."""

    @property
    @abstractmethod
    def offset(self) -> float:
        """What is added to the sum."""

    def excess(self, numbers: Mapping[str, Any]) -> Any:
        """By how much the constraint is broken: at most 0 where it is kept."""
        return self.offset + self.weighted(numbers)

    def weighted(self, numbers: Mapping[str, Any]) -> Any:
        """Weighted sum of quantities; of their derivatives it is that of the excess."""
        return sum(weight * numbers[name] for name, weight in self.weights.items())

    @property
    def _odds(self) -> str:
        """Its probability, as it is written."""
        return f" @ {percent(self.probability)}" if self.probability else ""


@dataclass(frozen=True)
class Limit(Constraint):
    """`quantity <= value` or `quantity >= value` [SI], in units of the value."""

    quantity: str
    upper: bool
    value: float
    probability: float = 0.0

    @property
    def weights(self) -> dict[str, float]:
        """The quantity in units of its limit, negative where that is a lower one."""
        return {self.quantity: (1.0 if self.upper else -1.0) / (abs(self.value) or 1.0)}

    @property
    def offset(self) -> float:
        """Minus the limit, in the same units."""
        return -self.weights[self.quantity] * self.value

    def __str__(self) -> str:
        value = format_quantity(self.value, QUANTITIES[self.quantity].dimension)
        return f"{self.quantity} {'<=' if self.upper else '>='} {value}{self._odds}"


SERVOS_FOLLOW = Limit("voltage_demand", True, 1.0)
"""Servos have the voltage that their motion asks for."""


@dataclass(frozen=True)
class MotorLine(Constraint):
    r"""Torque of a motor at a drive rate: $\tau \le \tau_0 (1 - \omega / \omega_0)$, in units of $\tau_0$."""

    stall: float  # [N m]
    no_load: float  # [rad/s]
    probability: float = 0.0
    quantity = "torque"

    @property
    def weights(self) -> dict[str, float]:
        """Torque and rate as shares of their largest."""
        return {"torque": 1 / self.stall, "drive_rate": 1 / self.no_load}

    @property
    def offset(self) -> float:
        """Minus 1: the sum of both shares on the line."""
        return -1.0

    def __str__(self) -> str:
        stall, no_load = format_quantity(self.stall, "torque"), format_quantity(self.no_load, "angular_speed")
        return f"motor {stall}, {no_load}{self._odds}"


def percent(share: float) -> str:
    """Share as people write it: `90 %`."""
    return f"{100 * share:.6g} %"


def read_percent(given: str | float, field: str) -> float:
    """Read `10 %`, or 0.1. Raises InputError unless it lies between 0 and 100 %."""
    text = given.replace("%", " percent") if isinstance(given, str) else given
    share = read_quantity(text, "number", field)
    check_share(share, field)
    return share


def read_constraint(text: str) -> Constraint:
    """Read `torque <= 0.5 N m`, or `motor 0.89 N m, 22 rad/s` (stall torque, no-load speed). Raises InputError.

    `@ 90 %` behind it: it is kept with that probability.
    """
    rule, at, odds = str(text).partition("@")
    motor = re.fullmatch(r"\s*motor\s+([^,]+),([^,]+)", rule)
    limit = re.fullmatch(r"\s*(\w+)\s*(<=|>=)\s*(.+)", rule)
    try:
        probability = read_percent(odds.strip(), "constraint") if at else 0.0
        if motor is not None:
            stall, no_load = map(parse_quantity, map(str.strip, motor.groups()), ("torque", "angular_speed"))
            if stall <= 0 or no_load <= 0:
                raise ValueError(f'"{shorten(text)}": stall torque and no-load speed must be more than 0.')
            return MotorLine(stall, no_load, probability)
        if limit is None:
            raise ValueError(f'"{shorten(text)}" is no constraint. Write it as in "torque <= 0.5 N m".')
        name, sense, value = limit.groups()
        check_quantity(name, "constraint")
        return Limit(name, sense == "<=", parse_quantity(value.strip(), QUANTITIES[name].dimension), probability)
    except ValueError as error:
        raise InputError(str(error), field="constraint") from None
