"""The period after which all motions and drives of a robot repeat themselves."""

import math
from collections.abc import Iterator
from typing import Any

from nectosome.description.robot import RobotDescription
from nectosome.description.signals import RateLength
from nectosome.units import InputError, show_quantity

_MOST = 50  # cycles of the fastest drive in the common period
_SAME = 1e-9  # relative difference of frequencies that counts as none


def drive_period(description: RobotDescription) -> float:
    """Shortest time [s] after which all motions and drives of the description repeat themselves.

    What turns at a constant rate repeats itself after a turn. A ramp is refused: the motion that a robot keeps does not
    depend on how it was begun, and nothing repeats itself while the ramp lasts; and so is a recording. Raises
    InputError for a ramp and a recording, where nothing goes to and fro or round, where something slides away for ever,
    and where there is no common period of at most 50 cycles of the fastest drive.
    """
    found = drive_frequencies(description)
    if not found:
        raise InputError("nothing of this robot is driven to and fro or round, so there is no period.", field="period")
    fastest = max(found.values())
    for cycles in range(1, _MOST + 1):
        turns = [cycles * frequency / fastest for frequency in found.values()]
        if all(abs(n - round(n)) <= _SAME * n for n in turns):
            return cycles / fastest
    path, slowest = min(found.items(), key=lambda item: item[1])
    shown = ", ".join(show_quantity(frequency, "frequency") for frequency in sorted(set(found.values())))
    why = f"{show_quantity(slowest, 'frequency')} has no common period with the rest ({shown}) within {_MOST} cycles."
    raise InputError(f"{why} Choose frequencies in a simple ratio.", field=path)


def drive_frequencies(description: RobotDescription) -> dict[str, float]:
    """Frequency [Hz], by its path, of everything that is made to go to and fro or round.

    Raises InputError for a ramp, for a recording, and where something slides away for ever.
    """
    return dict(_frequencies(description))


def driving_signals(description: RobotDescription) -> dict[str, Any]:
    """Description, by its path, of each signal that drives a robot. Raises InputError for a jet's motor."""
    limbs = {"body": description.body} | {f"limbs.{name}": limb for name, limb in description.limbs.items()}
    return {path: signal for place, limb in limbs.items() for path, signal in _driving(limb, place)}


def _frequencies(description: RobotDescription) -> Iterator[tuple[str, float]]:
    for path, signal in driving_signals(description).items():
        if getattr(signal, "ramp", 0.0):
            raise InputError("what begins slowly does not repeat itself. Set it to 0 s.", field=f"{path}.ramp")
        if signal.kind == "recording" and len(set(signal.values)) > 1:
            why = "a recording does not repeat itself. Cut one period out of it and give that as a cycle."
            raise InputError(why, field=f"{path}.values")
        moves = len(set(signal.values)) > 1 if signal.kind == "cycle" else getattr(signal, "amplitude", 0.0)
        if signal.kind in ("sine", "stroke", "cycle", "wave") and signal.frequency and moves:
            yield f"{path}.frequency", signal.frequency
        if signal.kind == "rate" and signal.rate:
            if isinstance(signal, RateLength):
                raise InputError("what slides on and on never comes back. Give the period.", field=f"{path}.rate")
            yield f"{path}.rate", abs(signal.rate) / (2 * math.pi)


def _driving(limb: Any, place: str) -> Iterator[tuple[str, Any]]:
    """Path and description of each signal that drives a part: its joint, its shape, its loads."""
    yield from _signals(limb.joint, f"{place}.joint")
    if limb.kind == "rod":
        yield from _signals(limb, place)
    yield from _of_loads(limb.loads, f"{place}.loads")


_DRIVING = {"jet": "crank", "tendon": "tension", "chamber": "pressure", "muscle": "moment"}


def _of_loads(loads: dict[str, Any], place: str) -> Iterator[tuple[str, Any]]:
    """Path and description of the signal of each load that has one. Raises InputError for a jet's motor."""
    for name, load in loads.items():
        if load.kind == "jet" and load.motor is not None:
            raise InputError("a motor finds its own speed. Simulate the robot.", field=f"{place}.{name}.motor")
        if load.kind in _DRIVING:
            signal = _DRIVING[load.kind]
            yield f"{place}.{name}.{signal}", getattr(load, signal)


def _signals(joint: Any, place: str) -> Iterator[tuple[str, Any]]:
    """Path and description of each signal of a joint; motions and drives of several coordinates hold more than one."""
    for name in ("motion", "torque", "force", "drive"):
        found = getattr(joint, name, None)
        if found is None:
            continue
        if hasattr(found, "kind"):
            yield f"{place}.{name}", found
            continue
        for key in type(found).model_fields:
            if getattr(found, key) is not None:
                yield f"{place}.{name}.{key}", getattr(found, key)
