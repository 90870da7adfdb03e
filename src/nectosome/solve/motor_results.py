"""Results of drives with motors and of their batteries, as labelled arrays, and warnings of servos that saturate."""

from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.core import DriveOutput
from nectosome.description import RobotDescription
from nectosome.mechanism import Diagnosis, Robot
from nectosome.units import show_quantity

_MOTOR, _BATTERY = ("motor",), ("battery",)
# at each time, and of a cycle as means or, with `_peak`, as largest magnitudes
MOTOR_VARIABLES: dict[str, tuple[tuple[str, ...], str]] = {
    "motor_reference": (_MOTOR, "rad or m"),
    "motor_position": (_MOTOR, "rad or m"),
    "tracking_error": (_MOTOR, "rad or m"),
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

    `motor_reference` is that of a servo, and `tracking_error` its reference less its position, NaN without a position
    loop; `battery_power` is what a battery gives to its drives and to the electronics.
    """
    if not robot.powered.groups:
        return {}
    values = of_motors(d)
    known = {name: kind for name, kind in MOTOR_VARIABLES.items() if kind[0] == _MOTOR or robot.powered.battery_names}
    return {name: (("time", *dims), values[name], unit) for name, (dims, unit) in known.items()}


def of_motors(d: Diagnosis) -> dict[str, Any]:
    """The same by name, traced or not."""
    reference = d.powered.reference
    moving = {"motor_reference": reference, "motor_position": d.motor_position, "motor_rate": d.motor_rate}
    moving["tracking_error"] = reference - d.motor_position
    return moving | of_drives(d.powered, d.battery_voltage, d.battery_power)


def of_drives(p: DriveOutput, voltage: Any, power: Any) -> dict[str, Any]:
    """Those of torque, current and power, of what motors do and of voltages and powers of batteries."""
    electric = {"motor_torque": p.torque, "current": p.current, "motor_voltage": p.voltage}
    powers = {"electrical_power": p.electrical, "motor_heat": p.heat}
    return electric | powers | {"battery_voltage": voltage, "battery_power": power}


def tracking_warnings(description: RobotDescription, names: np.ndarray, error: Float[np.ndarray, "motor"]) -> list[str]:
    """A sentence for each servo with a larger tracking error than that at which it has its full voltage.

    `error` [rad, m] is the largest one of each motor.
    """
    sentences: list[str] = []
    for name, most in zip(map(str, names), map(float, error), strict=True):
        full = getattr(description.parts[name.rpartition(".")[0]].joint.powered, "full_voltage_at", None)
        if full is not None and most > full:
            shown = [show_quantity(x, "angle" if name.endswith(".angle") else "length") for x in (most, full)]
            why = f"its tracking error is up to {shown[0]}, and from {shown[1]} on it has its full voltage"
            sentences.append(f"the servo of {name} cannot follow its motion: {why}")
    return sentences
