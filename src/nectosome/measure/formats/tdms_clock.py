"""The time of the channels of a TDMS group: a channel of its own, or made of their waveform properties."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nectosome.measure.formats.conventions import text
from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.items import Item

_Properties = Mapping[str, Any]


class Ramp:
    """Equally spaced numbers."""

    def __init__(self, start: float, step: float, rows: int):
        self.shape, self.dtype, self._start, self._step = (rows,), np.dtype(float), start, step

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._start + self._step * np.arange(*rows.indices(self.shape[0]))


@dataclass(frozen=True)
class _Clock:
    """When, or where, the values of a channel were taken; equal for channels that belong together."""

    start: float
    step: float
    rows: int
    name: str
    unit: str

    def __str__(self) -> str:
        return f"every {self.step:g} {self.unit}{f' from {self.start:g}' if self.start else ''}"

    def item(self, group: str) -> Item:
        """The column of it."""
        note = f"{self.name}: made of wf_increment = {self.step:g} and wf_start_offset = {self.start:g}"
        ramp = Ramp(self.start, self.step, self.rows)
        return Item(self.name, ramp, self.unit, group=group, along=str(self), first=True, notes=[note])


def with_clock(items: Sequence[Item], properties: Mapping[str, _Properties]) -> list[Item]:
    """Return the channels of a group, and before them their times where no channel is the time.

    `properties` are those of the channels, by name. Channels with different clocks get a different `along`.
    """
    times = {item.array.shape for item in items if item.first}
    if any(item.array.shape in times for item in items if not item.first):
        return list(items)
    zero = next((p["wf_start_time"] for p in properties.values() if "wf_start_time" in p), None)
    clocks = {item.name: _clock(item.array.shape[0], properties[item.name], zero) for item in items}
    known = list(dict.fromkeys(clock for clock in clocks.values() if clock is not None))
    by_rows = {rows: [clock for clock in known if clock.rows == rows] for rows in {clock.rows for clock in known}}
    told = []
    for item in items:
        clock = clocks[item.name]
        if clock is None and len(by_rows.get(item.array.shape[0], [])) == 1:  # a channel computed from the others
            clock = by_rows[item.array.shape[0]][0]
        told.append(item if clock is None else replace(item, along=str(clock)))
    return [*(clock.item(items[0].group) for clock in known), *told]


def _clock(rows: int, properties: _Properties, zero: np.datetime64 | None) -> _Clock | None:
    step, start = (_number(properties.get(key, 0)) for key in ("wf_increment", "wf_start_offset"))
    if not (math.isfinite(step) and step > 0 and math.isfinite(start)):
        return None
    later = _seconds(properties.get("wf_start_time", zero), zero)
    if abs(later) > step / 2:  # less is the jitter with which tasks start
        start += later
    name, unit = (text(properties.get(key, "")) for key in ("wf_xname", "wf_xunit_string"))
    other = name and not is_time(name)
    return _Clock(start, step, rows, name if other else "time", unit if other else unit or "s")


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float | np.number) else math.nan


def _seconds(time: Any, zero: Any) -> float:
    both = isinstance(time, np.datetime64) and isinstance(zero, np.datetime64)
    return float((time - zero) / np.timedelta64(1, "s")) if both else 0.0
