"""Tables of servos, motors and tendons: largest torques, speeds, tensions, limits, mean powers; and warnings."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nectosome.description import robot_of_run
from nectosome.io.tables import Number, Table
from nectosome.units import show_quantity

from ..motor_results import overloaded, tracking_warnings
from ..transport import battery_endurance

Arrays = Mapping[str, np.ndarray]

LOOP_PEAKS = ("tracking_error", "speed_error", "voltage_demand")  # without the way to the motion
MOTOR_PEAKS = ("motor_torque", "motor_rate", "current", *LOOP_PEAKS)
MOTOR_MEANS = ("electrical_power", "motor_heat", "battery_power")


def endurance(arrays: Arrays, attributes: Mapping[str, Any], weights: np.ndarray) -> np.ndarray:
    """Return the time [s] for which each battery gives its mean current; `weights` are those of the samples in it."""
    known = robot_of_run(str(attributes["robot"])).batteries
    batteries = [known[str(name)] for name in arrays["battery"]]
    energy, open_voltage = np.array([(b.stored, b.voltage) for b in batteries], dtype=float).reshape(-1, 2).T
    return battery_endurance(energy, open_voltage, arrays["battery_voltage"], arrays["battery_power"], weights)


def _lasting(time: float, speed: float) -> list[Number]:
    """Endurance and range; nothing where the energy of a battery is not known, no range without a speed, NaN."""
    if math.isnan(time):
        return []
    return [Number(time, "s", shown=_hours(time)), *([] if math.isnan(speed) else [Number(time * speed, "m")])]


def _hours(time: float) -> str:
    """Time in hours and minutes from two minutes on, else as it is."""
    minutes = round(time / 60)
    return f"{minutes // 60} h {minutes % 60:02d} min" if minutes >= 2 else ""


def servos(arrays: Arrays, peaks: Arrays) -> tuple[list[Table], list[str]]:
    """Return largest torques and speeds of servos whose limits are known beside these, and warnings where beyond."""
    if "reaction_limit" not in arrays:
        return [], []
    heads = {"joint": "servo", "reaction_peak": "torque", "reaction_limit": "limit", "reaction_share": "share"}
    heads |= {"drive_velocity_peak": "speed", "drive_velocity_limit": "limit", "drive_velocity_share": "share"}
    limits = zip(map(str, arrays["prescribed"]), arrays["reaction_limit"], arrays["drive_velocity_limit"], strict=True)
    rows = []
    for (name, *most), *given in zip(limits, peaks["reaction"], peaks["drive_velocity"], strict=True):
        if most[0] == most[0]:  # NaN: none is known
            cells = zip(map(float, given), map(float, most), ("N m", "rad/s"), strict=True)
            rows.append((name, *(cell for x, end, unit in cells for cell in _of_limit(x, end, unit))))
    return [Table("servos", heads, rows)], overloaded(arrays, peaks["reaction"], peaks["drive_velocity"])


def _of_limit(value: float, limit: float, unit: str) -> tuple[Number, Number, Number]:
    share = "" if math.isnan(value / limit) else f"{100 * value / limit:.0f} %"
    return Number(value, unit), Number(limit, unit), Number(value / limit, shown=share)


def motors(
    arrays: Arrays, attributes: Mapping[str, Any], means: Arrays, peaks: Arrays, speed: float
) -> tuple[list[Table], list[str]]:
    """Return largest values of motors, mean powers of them and of batteries, and warnings; nothing without motors.

    With `battery_endurance` among the means how long a battery lasts, and how far at a speed [m/s]; NaN leaves it out.
    """
    if "motor" not in arrays:
        return [], []
    heads = {"joint": "motor", "torque": "torque", "rate": "speed", "tracking_error": "error"}
    heads |= {
        "speed_error": "speed error",
        "current": "current",
        "electrical_power": "mean power",
        "motor_heat": "heat",
    }
    shown = ("motor_torque", "motor_rate", "tracking_error", "speed_error", "current")
    rows = []
    largest = zip(*(peaks[name] for name in shown), strict=True)
    taken = zip(means["electrical_power"], means["motor_heat"], strict=True)
    for name, most, watts in zip(map(str, arrays["motor"]), largest, taken, strict=True):
        turns = name.endswith(".angle")
        units = ("N m", "rad/s", "rad", "rad/s", "A") if turns else ("N", "m/s", "m", "m/s", "A")
        cells = [Number(float(x), unit) for x, unit in zip(most, units, strict=True)]
        if turns and cells[2].measured:
            cells[2] = cells[2]._replace(shown=show_quantity(cells[2].value, "angle"))
        rows.append((name, *cells, *(Number(float(x), "W") for x in watts)))
    errors = ("tracking_error", "speed_error")
    without = {name for name in errors if all(x != x for x in map(float, peaks[name]))}  # NaN: no motor has such a loop
    tables = [Table("motors", heads, rows, computed=True, hidden=without)]
    if "battery_power" in means:
        each = zip(map(str, arrays["battery"]), means["battery_power"], means["battery_endurance"], strict=True)
        given = [(name, Number(float(watts), "W"), *_lasting(float(time), speed)) for name, watts, time in each]
        heads = {"battery": "battery", "power": "mean power", "endurance": "endurance", "range": "range"}
        tables.append(Table("batteries", heads, given))
    description = robot_of_run(str(attributes["robot"]))
    return tables, tracking_warnings(description, {"motor": arrays["motor"], **peaks})


def tendons(arrays: Arrays, mean: np.ndarray, most: np.ndarray) -> list[Table]:
    """Return mean and largest tensions [N] of tendons over joints; nothing without tendons."""
    rows = [
        (name, Number(float(x), "N", float(peak)), Number(float(peak), "N"))
        for name, x, peak in zip(map(str, arrays["tendon"]), mean, most, strict=True)
    ]
    return [Table("tendons", {"tendon": "tendon", "tension": "mean tension", "tension_peak": "largest"}, rows)]
