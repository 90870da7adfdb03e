"""Results of drives with motors and of their batteries, as labelled arrays, and what servos cannot do."""

from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription
from nectosome.mechanism import Diagnosis, Robot
from nectosome.units import show_quantity

_MOTOR, _BATTERY = ("motor",), ("battery",)
# at each time, and of a cycle as means or, with `_peak`, as largest magnitudes
MOTOR_VARIABLES: dict[str, tuple[tuple[str, ...], str]] = {
    "asked": (_MOTOR, "rad or m"),
    "reached": (_MOTOR, "rad or m"),
    "lag": (_MOTOR, "rad or m"),
    "motor_rate": (_MOTOR, "rad/s or m/s"),
    "motor_torque": (_MOTOR, "N m or N"),
    "current": (_MOTOR, "A"),
    "motor_voltage": (_MOTOR, "V"),
    "electrical_power": (_MOTOR, "W"),
    "motor_heat": (_MOTOR, "W"),
    "battery_voltage": (_BATTERY, "V"),
    "battery_power": (_BATTERY, "W"),
}


def motor_names(robot: Robot) -> tuple[str, ...]:
    """Names of the coordinates that motors move, such as `arm.angle`."""
    names = robot.tree.coordinate_names
    return tuple(names[i] for i in robot.powered.places(robot.tree, "v"))


def motor_results(robot: Robot, d: Diagnosis) -> dict[str, tuple[tuple[str, ...], np.ndarray, str]]:
    """Variables of motors and batteries over time; nothing without motors.

    `asked` is what a servo is to reach and `lag` what `reached` lacks of it, NaN without a position loop;
    `battery_power` is what a battery gives to its drives and to the electronics.
    """
    if not robot.powered.groups:
        return {}
    values = of_motors(d)
    known = {name: kind for name, kind in MOTOR_VARIABLES.items() if kind[0] == _MOTOR or robot.powered.battery_names}
    return {name: (("time", *dims), values[name], unit) for name, (dims, unit) in known.items()}


def of_motors(d: Diagnosis) -> dict[str, Any]:
    """The same by name, traced or not."""
    p = d.powered
    moving = {"asked": p.asked, "reached": d.reached, "lag": p.asked - d.reached, "motor_rate": d.motor_rate}
    electric = {"motor_torque": p.torque, "current": p.current, "motor_voltage": p.voltage}
    powers = {"electrical_power": p.electrical, "motor_heat": p.heat}
    return moving | electric | powers | {"battery_voltage": d.battery_voltage, "battery_power": d.battery_power}


def lagging(description: RobotDescription, names: np.ndarray, lag: Float[np.ndarray, "motor"]) -> list[str]:
    """A sentence for each servo that stays behind by more than the error at which it has all of its voltage.

    `lag` [rad, m] is the largest one of each motor.
    """
    sentences: list[str] = []
    for name, most in zip(map(str, names), map(float, lag), strict=True):
        servo = getattr(description.parts[name.rpartition(".")[0]].joint, "servo", None)
        if servo is not None and servo.full_voltage_at is not None and most > servo.full_voltage_at:
            kind = "angle" if name.endswith(".angle") else "length"
            behind, full = (show_quantity(x, kind) for x in (most, servo.full_voltage_at))
            why = f"lags by up to {behind}, more than the {full} at which it has all of its voltage"
            sentences.append(f"the servo of {name} cannot do what it is asked: it {why}")
    return sentences
