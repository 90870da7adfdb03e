"""Results of drives with motors and of their batteries, as labelled arrays, and warnings of servos that saturate."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from nectosome.core import DriveOutput
from nectosome.description import RobotDescription
from nectosome.drives.motor import SATURATION_WIDTH
from nectosome.mechanism import Diagnosis, Robot
from nectosome.units import show_quantity

_MOTOR, _BATTERY = ("motor",), ("battery",)
# at each time, and of a cycle as means or, with `_peak`, as largest magnitudes
MOTOR_VARIABLES: dict[str, tuple[tuple[str, ...], str]] = {
    "motor_reference": (_MOTOR, "rad or m"),
    "motor_position": (_MOTOR, "rad or m"),
    "tracking_error": (_MOTOR, "rad or m"),
    "motor_rate": (_MOTOR, "rad/s or m/s"),
    "speed_error": (_MOTOR, "rad/s or m/s"),
    "voltage_demand": (_MOTOR, "1"),
    "motor_torque": (_MOTOR, "N m or N"),
    "current": (_MOTOR, "A"),
    "motor_voltage": (_MOTOR, "V"),
    "electrical_power": (_MOTOR, "W"),
    "motor_heat": (_MOTOR, "W"),
    "battery_voltage": (_BATTERY, "V"),
    "battery_power": (_BATTERY, "W"),
}


def motor_names(robot: Robot) -> tuple[str, ...]:
    """Names of the coordinates that motors move, such as `arm.angle`, or `fin.bending_z.angle` of a strain's shaft."""
    names = robot.tree.coordinate_names
    return tuple(names[i] for i in robot.powered.places(robot.tree, "v"))


def motor_results(robot: Robot, d: Diagnosis) -> dict[str, tuple[tuple[str, ...], np.ndarray, str]]:
    """Variables of motors and batteries over time; nothing without motors.

    `motor_reference` is that of a servo, and `tracking_error` its reference less its position, NaN without a position
    loop; `speed_error` the rate of its motion less its own, NaN without a velocity loop; `voltage_demand` the share of
    the supply's voltage that its loop asks for, before its limit; `battery_power` is what a battery gives to its drives
    and to the electronics.
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
    moving |= {"tracking_error": reference - d.motor_position, "speed_error": d.powered.speed_error}
    moving["voltage_demand"] = d.powered.demand
    return moving | of_drives(d.powered, d.battery_voltage, d.battery_power)


def of_drives(p: DriveOutput, voltage: Any, power: Any) -> dict[str, Any]:
    """Those of torque, current and power, of what motors do and of voltages and powers of batteries."""
    electric = {"motor_torque": p.torque, "current": p.current, "motor_voltage": p.voltage}
    powers = {"electrical_power": p.electrical, "motor_heat": p.heat}
    return electric | powers | {"battery_voltage": voltage, "battery_power": power}


def tracking_warnings(description: RobotDescription, peaks: Mapping[str, np.ndarray]) -> list[str]:
    """A sentence for each servo that has its full voltage and still cannot follow the angle or the speed of its motion.

    `peaks` has names by `motor`, and by `tracking_error` [rad, m], `speed_error` [rad/s, m/s] and `voltage_demand` the
    largest of each. A position loop cannot follow where its error is larger than that of the full voltage, a velocity
    loop where it asks for more than the voltage, by more than the width in which that limit sets in.
    """
    sentences, powered = list[str](), description.powered
    largest = (peaks[name] for name in ("motor", "tracking_error", "speed_error", "voltage_demand"))
    for motor, error, lacks, demand in zip(*largest, strict=True):
        name, turns = str(motor), str(motor).endswith(".angle")
        full = getattr(powered[name].drive, "full_voltage_at", None)
        if full is not None and error > full:
            shown = [show_quantity(float(x), "angle" if turns else "length") for x in (error, full)]
            why = f"its tracking error is up to {shown[0]}, and from {shown[1]} on it has its full voltage"
            sentences.append(f"the servo of {name} cannot follow its motion: {why}")
        elif np.isfinite(lacks) and demand > 1 + SATURATION_WIDTH:
            short = show_quantity(float(lacks), "angular_speed" if turns else "speed")
            sentences.append(f"the servo of {name} cannot hold its speed: at its full voltage it lacks up to {short}")
    return sentences


def overloaded(arrays: Mapping[str, np.ndarray], torque: np.ndarray, speed: np.ndarray) -> list[str]:
    """A sentence for each servo beyond its limit of torque [N m] or speed [rad/s].

    `arrays` are those of results with `drive_limits`; `torque` and `speed` are the largest ones of prescribed joints.
    """
    if "reaction_limit" not in arrays:
        return []
    sentences: list[str] = []
    limits = arrays["prescribed"], arrays["reaction_limit"], arrays["drive_velocity_limit"]
    for name, most, fastest, given, rate in zip(*limits, torque, speed, strict=True):
        beyond = " and ".join(what for what, over in (("torque", given > most), ("speed", rate > fastest)) if over)
        sentences += [f"the servo of {name} would exceed its limit of {beyond}"] if beyond else []
    return sentences
