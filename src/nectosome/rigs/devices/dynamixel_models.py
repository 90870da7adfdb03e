"""Dynamixel servos of one control table: models, registers, units, and what can be recorded.

The table is that of the X series (but the XL-320) and of the MX series with protocol 2.0: ROBOTIS e-Manual, a page for
each model. All of them have 4096 steps a turn, of which 0 to 4095 are allowed in position mode.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple


class Register(NamedTuple):
    """A value in the control table."""

    address: int
    size: int  # [bytes]
    signed: bool = False

    def value(self, data: bytes) -> int:
        """The number in its bytes."""
        return int.from_bytes(data, "little", signed=self.signed)

    def bytes(self, value: int) -> bytes:
        """The bytes of a number."""
        return value.to_bytes(self.size, "little", signed=self.signed)


DRIVE_MODE, OPERATING_MODE = Register(10, 1), Register(11, 1)
MOST_STEP, LEAST_STEP = Register(48, 4), Register(52, 4)
TORQUE, HARDWARE_ERROR, WATCHDOG = Register(64, 1), Register(70, 1), Register(98, 1)
PROFILE_VELOCITY, GOAL, POSITION = Register(112, 4), Register(116, 4, True), Register(132, 4, True)

STEPS, MIDDLE = 4096, 2048  # a turn; its middle
STEP = 2 * math.pi / STEPS  # [rad]
SPEED_UNIT = 0.229 * 2 * math.pi / 60  # [rad/s]
WATCHDOG_UNIT = 0.02  # [s]
EXPIRED = 0xFF  # in the register of the watchdog
POSITION_MODE = 3
ODD_DRIVE_MODES = {0x04: "times its motions instead of limiting their speed", 0x08: "takes torque on by itself"}
FAULTS = {0x01: "input voltage", 0x04: "overheating", 0x08: "encoder", 0x10: "electrical shock", 0x20: "overload"}


class ServoReading(NamedTuple):
    """A reading that may be recorded beside the angle: unit * number + shift."""

    register: Register
    si: str
    unit: float  # of the register; that of a current is the model's
    shift: float = 0.0
    signed: bool = False  # whether it turns round with the servo's `sign`


CHANNELS = {
    "speed": ServoReading(Register(128, 4, True), "rad/s", SPEED_UNIT, signed=True),
    "current": ServoReading(Register(126, 2, True), "A", math.nan, signed=True),
    "voltage": ServoReading(Register(144, 2), "V", 0.1),
    "temperature": ServoReading(Register(146, 1), "K", 1.0, 273.15),
}


@dataclass(frozen=True)
class Model:
    """A model of this control table."""

    name: str
    current: float | None = None  # [A]
    """Unit of the current; None where it reports an estimated load instead."""


_430, _V430, _330, _MX = 2.69e-3, 1.34e-3, 1e-3, 3.36e-3  # units of current [A]
MODELS = {
    30: Model("MX-28"), 311: Model("MX-64", _MX), 321: Model("MX-106", _MX),
    1000: Model("XH430-W350", _430), 1010: Model("XH430-W210", _430),
    1001: Model("XD430-T350", _430), 1011: Model("XD430-T210", _430),
    1020: Model("XM430-W350", _430), 1030: Model("XM430-W210", _430),
    1040: Model("XH430-V350", _V430), 1050: Model("XH430-V210", _V430),
    1060: Model("XL430-W250"), 1070: Model("XC430-W150"), 1080: Model("XC430-W240"),
    1090: Model("2XL430-W250"), 1160: Model("2XC430-W250"),
    1100: Model("XH540-W270", _430), 1110: Model("XH540-W150", _430),
    1101: Model("XD540-T270", _430), 1111: Model("XD540-T150", _430),
    1120: Model("XM540-W270", _430), 1130: Model("XM540-W150", _430),
    1140: Model("XH540-V270", _430), 1150: Model("XH540-V150", _430),
    1170: Model("XW540-T260", _430), 1180: Model("XW540-T140", _430), 1310: Model("XW540-H260", _430),
    1190: Model("XL330-M077", _330), 1200: Model("XL330-M288", _330),
    1210: Model("XC330-T181", _330), 1220: Model("XC330-T288", _330),
    1230: Model("XC330-M181", _330), 1240: Model("XC330-M288", _330),
    1270: Model("XW430-T333", _430), 1280: Model("XW430-T200", _430),
}  # fmt: skip


def family(number: int) -> str:
    """What a model is that has another control table; empty where it is not known."""
    if number in (29, 310, 320):
        return "an MX servo with protocol 1.0: change its firmware to protocol 2.0 with the DYNAMIXEL Wizard"
    if number == 350:
        return "an XL-320, which has a control table of its own"
    if 2000 <= number < 2200:
        return "of the P series, which has a control table of its own"
    if number > 35_000:
        return "of the PRO series or a gripper, which have control tables of their own"
    return ""
