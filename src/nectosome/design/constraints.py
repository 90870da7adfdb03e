"""Limits on a steady motion, and a motor's torque-speed line; written as people write them."""

import re
from dataclasses import dataclass

from nectosome.io import InputError, did_you_mean, format_quantity, parse_quantity
from nectosome.io.errors import shorten

from .quantities import QUANTITIES


@dataclass(frozen=True)
class Limit:
    """`quantity <= value` or `quantity >= value` [SI]."""

    quantity: str
    upper: bool
    value: float

    @property
    def uses(self) -> tuple[str, ...]:
        """Quantities that are needed."""
        return (self.quantity,)

    def excess(self, numbers):
        """By how much the limit is passed, in units of itself: at most 0 where it is kept."""
        scale = abs(self.value) or 1.0
        over = (numbers[self.quantity] - self.value) / scale
        return over if self.upper else -over

    def __str__(self) -> str:
        value = format_quantity(self.value, QUANTITIES[self.quantity].dimension)
        return f"{self.quantity} {'<=' if self.upper else '>='} {value}"


@dataclass(frozen=True)
class MotorLine:
    r"""Torque of a motor at a drive rate: $\tau \le \tau_0 (1 - \omega / \omega_0)$."""

    stall: float  # [N m]
    no_load: float  # [rad/s]
    uses = ("torque", "drive_rate")

    def excess(self, numbers):
        """By how much the torque is above the line, in stall torques."""
        return numbers["torque"] / self.stall - (1 - numbers["drive_rate"] / self.no_load)

    def __str__(self) -> str:
        stall, no_load = format_quantity(self.stall, "torque"), format_quantity(self.no_load, "angular_speed")
        return f"motor {stall}, {no_load}"


Constraint = Limit | MotorLine


def read_constraint(text: str) -> Constraint:
    """Read `torque <= 0.5 N m`, or `motor 0.89 N m, 22 rad/s` (stall torque, no-load speed). Raises InputError."""
    motor = re.fullmatch(r"\s*motor\s+([^,]+),([^,]+)", str(text))
    limit = re.fullmatch(r"\s*(\w+)\s*(<=|>=)\s*(.+)", str(text))
    try:
        if motor is not None:
            stall, no_load = (
                parse_quantity(part.strip(), kind)
                for part, kind in zip(motor.groups(), ("torque", "angular_speed"), strict=True)
            )
            if stall <= 0 or no_load <= 0:
                raise InputError(
                    f'"{shorten(text)}": stall torque and no-load speed must be more than 0.', field="constraint"
                )
            return MotorLine(stall, no_load)
        if limit is None:
            raise InputError(
                f'"{shorten(text)}" is no constraint. Write it as in "torque <= 0.5 N m".', field="constraint"
            )
        name, sense, value = limit.groups()
        if name not in QUANTITIES:
            near = did_you_mean(name, QUANTITIES)
            raise InputError(f'"{shorten(name)}" is no quantity of a steady motion.{near}', field="constraint")
        return Limit(name, sense == "<=", parse_quantity(value.strip(), QUANTITIES[name].dimension))
    except ValueError as error:
        raise InputError(str(error), field="constraint") from None
