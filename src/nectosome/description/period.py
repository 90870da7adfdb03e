"""The period after which all drives of a robot repeat themselves, and the update rates of its servos."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from nectosome.description.drives import FreeMotor
from nectosome.description.robot import RobotDescription, check_description, resolve, with_values
from nectosome.description.signals import RateSignal, SignalDescription, SumSignal
from nectosome.io.schema.structure import items, numeric_values
from nectosome.units import InputError, show_quantity

_MOST = 50  # cycles of the fastest drive in a common period
_DENSE = 1000  # samples of a cycle
_SAME = 1e-9  # relative difference of frequencies that counts as none
_ASIDE = {"phase", "offset", "forward_share", "start", "value"}  # fields of signals without a say in the period


def drive_period(description: RobotDescription) -> float:
    """Shortest time [s] after which all motions, drives and waves of the description repeat themselves.

    A rotation at a constant rate repeats itself after a turn. Ramps do not count: they end (`without_ramps`). Raises
    InputError for a recording, if no drive is periodic, as with motors at constant voltages, whose period comes with
    the motion, if something slides at a constant speed, and if there is no common period of at most 50 cycles of the
    fastest drive.
    """
    check_description(description)
    frequencies = drive_frequencies(description)
    if not frequencies:
        for path, drive in description.powered.values():
            if isinstance(drive, FreeMotor):
                why = "a motor finds its own speed, so that its period is not known before."
                why = f"{why} `periodic` finds that of a crank that it turns round; else take `steady` or `simulate`."
                raise InputError(why, field=path)
        raise InputError("nothing of this robot is driven to and fro or round, so there is no period.", field="period")
    fastest = max(frequencies.values())
    for cycles in range(1, _MOST + 1):
        turns = [cycles * frequency / fastest for frequency in frequencies.values()]
        if all(abs(n - round(n)) <= _SAME * n for n in turns):
            return cycles / fastest
    path, slowest = min(frequencies.items(), key=lambda item: item[1])
    shown = ", ".join(show_quantity(frequency, "frequency") for frequency in sorted(set(frequencies.values())))
    why = f"{show_quantity(slowest, 'frequency')} has no common period with the rest ({shown}) within {_MOST} cycles."
    raise InputError(f"{why} Choose frequencies in a simple ratio.", field=path)


def beat_of(description: RobotDescription) -> float | None:
    """Period of the drives [s]; None where they have none."""
    try:
        return drive_period(description)
    except InputError:
        return None


def without_ramps(description: RobotDescription) -> RobotDescription:
    """The robot with its drives at their full size from the start, as in the cycle that it comes to."""
    ramps = _ramps(description)
    return with_values(description, dict.fromkeys(ramps, 0.0)) if ramps else description


def ramps_end(description: RobotDescription) -> float:
    """Time [s] at which the last drive has its full size."""
    return max(_ramps(description).values(), default=0.0)


def _ramps(description: RobotDescription) -> dict[str, float]:
    return {path: value for path, value in numeric_values(description).items() if _is_ramp(path) and value != 0}


def check_no_ramps(description: RobotDescription, names: Iterable[str]) -> None:
    """Raise InputError where one of these quantities of a robot is a ramp, which no cycle depends on."""
    for name in names:
        if any(map(_is_ramp, resolve(description, name))):
            raise InputError("acts only while the motion begins: the cycle is the same whatever it is.", field=name)


def _is_ramp(path: str) -> bool:
    """Whether a quantity is the time in which a drive grows to its full size."""
    return path.endswith(".ramp")


def drive_frequencies(description: RobotDescription) -> dict[str, float]:
    """Frequency [Hz] of each periodic drive, by its path.

    Raises InputError for a recording, and if something slides at a constant speed.
    """
    frequencies: dict[str, float] = {}
    for path, signal in driving_signals(description).items():
        field, why = signal.once
        if why and signal.moves:
            raise InputError(why, field=f"{path}.{field}")
        if signal.period is not None and signal.moves:
            frequencies[f"{path}.frequency"] = dict(signal)["frequency"]
        if isinstance(signal, RateSignal) and signal.rate:
            if signal.dimension != "angle":
                raise InputError("what slides on and on never comes back. Give the period.", field=f"{path}.rate")
            frequencies[f"{path}.rate"] = abs(signal.rate) / (2 * math.pi)
    for name, flow in description.water.flows.items():
        if flow.once:
            raise InputError(flow.once, field=f"water.flows.{name}.kind")
        frequencies |= {f"water.flows.{name}.{field}": value for field, value in flow.moving.items()}
    return frequencies


def like_periods(description: RobotDescription, name: str, values: Sequence[float]) -> list[int]:
    """For each value of a quantity, the index of the first one that gives the same frequencies and update rates.

    So a period, and whether updates fit it, need to be known for few of many values: whatever an amplitude is, what
    counts is whether it is 0.
    """
    flows = [f"water.flows.{flow}" for flow in description.water.flows]
    places = [f"{path}." for path in (*driving_signals(description), *flows)]
    fields = set[str]()
    for path in resolve(description, name):
        place = next((place for place in places if path.startswith(place)), None)
        if place is not None or is_update_rate(path):
            fields.add(path.removeprefix(place or ""))
    fields -= _ASIDE
    first = dict[Any, int]()
    kinds = [x if fields - {"amplitude"} else bool(x) if fields else None for x in values]
    return [first.setdefault(kind, k) for k, kind in enumerate(kinds)]


def driving_signals(description: RobotDescription) -> dict[str, SignalDescription]:
    """Description, by its path, of each signal that drives a robot or moves its water."""
    signals: dict[str, SignalDescription] = {}
    for name, part in description.parts.items():
        for group in ("joint", "motion", "drive", "loads"):
            if hasattr(part, group):
                signals |= _signals(getattr(part, group), f"{description.place_of(name)}.{group}")
    return signals | dict(_signals(description.water.flows, "water.flows"))


def _signals(value: Any, path: str) -> Iterator[tuple[str, SignalDescription]]:
    """Yield the path and the description of each signal in a group of fields; of a sum, of each term."""
    if isinstance(value, SignalDescription) and not isinstance(value, SumSignal):
        yield path, value
        return
    for key, item in items(value):
        yield from _signals(item, f"{path}.{key}")


def update_rates(description: RobotDescription) -> tuple[float, ...]:
    """Rates [Hz] at which the sampled loops of its servos update."""
    return tuple(value for path, value in numeric_values(description).items() if is_update_rate(path))


def is_update_rate(path: str) -> bool:
    """Whether a quantity is the update rate of a loop."""
    return path.endswith(".update_rate")


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
