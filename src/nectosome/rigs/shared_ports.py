"""Devices of a rig file at one serial port: a motor and an IMU of one microcontroller share it, others are refused."""

from collections.abc import Mapping
from itertools import combinations
from typing import Any

from nectosome.units import InputError

from .imu import SerialIMU
from .rig import Rig
from .serial_motor import SerialMotor

_SAME = "baud", "timeout", "attempts", "start"


def share_ports(rigs: Mapping[str, Rig | None], given: Mapping[str, Any]) -> None:
    """Let a motor and an IMU behind one microcontroller speak over one line, in turn.

    `given` are the fields of the devices as written. Raises InputError, with the field of the later device, where two
    of one port are no such pair, and for settings of the line that differ.
    """
    with_port = [(name, device) for name, device in given.items() if hasattr(device, "port")]
    for (first, one), (second, other) in combinations(with_port, 2):
        if one.port != other.port:
            continue
        pair = rigs[first], rigs[second]
        motor = next((rig for rig in pair if isinstance(rig, SerialMotor)), None)
        sensor = next((rig for rig in pair if isinstance(rig, SerialIMU)), None)
        if motor is None or sensor is None:
            raise InputError(
                f'{other.port} is the port of "{first}" too. A port takes one device, or a `serial` and a `serial_imu` '
                "of one microcontroller; servos on one bus are one device with several `servos`.",
                field=f"{second}.port",
            )
        for name in _SAME:
            mine, its = getattr(other, name), getattr(one, name)
            if mine != its:
                raise InputError(
                    f'{mine:g}, and {its:g} for "{first}" at the same port: they share its line. Write one value.',
                    field=f"{second}.{name}",
                )
        sensor.line.share(motor.line)
