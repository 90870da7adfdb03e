"""What a MAT-file holds, the same for all its versions: arrays, texts, structs, and what only MATLAB reads."""

from dataclasses import dataclass
from typing import TypeAlias

from nectosome.measure.formats.arrays import Rows

Value: TypeAlias = "Rows | str | dict[str, Value] | list[dict[str, Value]] | Unread"
"""A dict is a struct, a list an array of structs."""


@dataclass(frozen=True)
class Unread:
    """A value that is no array of numbers, text or struct."""

    what: str


_AS_ARRAYS = {
    "timetable": "t = seconds({0}.Properties.RowTimes - {0}.Properties.RowTimes(1)); data = {0}.Variables; "
    "save('new.mat', 't', 'data')",
    "table": "s = table2struct({0}, 'ToScalar', true); save('new.mat', '-struct', 's')",
    "timeseries": "t = {0}.Time; data = {0}.Data; save('new.mat', 't', 'data')",
    "Simulink.SimulationData.Dataset": "t = {0}{{1}}.Values.Time; data = {0}{{1}}.Values.Data; "
    "save('new.mat', 't', 'data')",
    "datetime": "t = seconds({0} - {0}(1)); save('new.mat', 't', '-append')",
    "duration": "t = seconds({0}); save('new.mat', 't', '-append')",
}


def opaque(name: str, kind: str) -> Unread:
    """Return what is told of an object that only MATLAB reads, with the commands that save it as arrays."""
    way_out = _AS_ARRAYS.get(kind)
    hint = f": there, {way_out.format(name)}" if way_out else ": save its numbers as arrays"
    return Unread(f"an object of the class {kind}, which only MATLAB reads{hint}")
