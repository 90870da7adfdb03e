"""Schedules: the numbers of a mission that may be chosen, and missions as text.

`MODE.QUANTITY` is what a mode sets a quantity to, by the path or the alias of the robot; `MODE.until` is how long a
mode lasts that ends by time.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from nectosome.description.fields import Quantity
from nectosome.description.mission import DURATION, Mission
from nectosome.description.paths import numeric_paths, resolve
from nectosome.description.variables import Variable, read_range
from nectosome.io.yaml_text import write_yaml
from nectosome.units import InputError, did_you_mean, format_quantity, shorten

_UNTIL = "until"


class _Place(NamedTuple):
    """Where a number stands."""

    mode: int
    paths: tuple[str, ...]  # that the mode sets; () of the time that ends it
    event: int  # that time among what ends the mode; -1 of paths


def read_schedule_variable(name: str, span: str | Sequence[float], mission: Mission) -> Variable:
    """Read a range of a mission's number, such as `5..20s` of `swim.until`.

    Raises InputError for an unknown name, a value that its quantity does not allow, an empty range.
    """
    place, known = _place(mission, name), numeric_paths(mission.robot)
    quantities: list[Quantity] = [known[path] for path in place.paths] or [DURATION]
    return read_range(name, span, quantities)


def with_schedule(mission: Mission, values: Mapping[str, float]) -> Mission:
    """A mission with some of its numbers changed [SI]; each name may touch what others do not. Raises InputError."""
    modes = list(mission.modes)
    touched: dict[tuple[int, str], str] = {}
    for name, value in values.items():
        place = _place(mission, name)
        for path in place.paths or (_UNTIL,):
            other = touched.setdefault((place.mode, path), name)
            if other != name:
                raise InputError(f"is named twice: {other} stands for it too.", field=name)
        mode = modes[place.mode]
        changes = mode.changes | {path: mode.changes[path]._replace(value=value) for path in place.paths}
        until = list(mode.until)
        if not place.paths:
            until[place.event] = until[place.event]._replace(told=format_quantity(value, "time"), limit=value)
        modes[place.mode] = mode._replace(changes=changes, until=tuple(until))
    changed = mission._replace(modes=tuple(modes))
    return changed._replace(text=dump_mission(changed))


def get_schedule(mission: Mission, name: str) -> float:
    """A mission's number [SI]; of several, the first. Raises InputError."""
    place = _place(mission, name)
    mode = mission.modes[place.mode]
    return mode.changes[place.paths[0]].value if place.paths else mode.until[place.event].limit


def dump_mission(mission: Mission) -> str:
    """YAML text of a mission, which reads back as the same modes."""
    known = numeric_paths(mission.robot)
    modes = []
    for mode in mission.modes:
        said: dict[str, object] = {"name": mode.name}
        if mode.changes:
            said["set"] = {
                path: format_quantity(change.value, known[path].dimension)
                + (f" in {format_quantity(change.seconds, 'time')}" if change.seconds else "")
                for path, change in mode.changes.items()
            }
        said["until"] = [event.told for event in mode.until]
        said["longest"] = format_quantity(mode.longest, "time")
        modes.append(said)
    return write_yaml({"modes": modes})


def _place(mission: Mission, name: str) -> _Place:
    known: dict[str, _Place] = {}
    for k, mode in enumerate(mission.modes):
        known |= {f"{mode.name}.{path}": _Place(k, (path,), -1) for path in mode.changes}
        for alias in mission.robot.aliases:
            paths = tuple(resolve(mission.robot, alias))
            if set(paths) <= set(mode.changes):
                known[f"{mode.name}.{alias}"] = _Place(k, paths, -1)
        times = [i for i, event in enumerate(mode.until) if event.kind == "time"]
        if len(times) == 1:
            known[f"{mode.name}.{_UNTIL}"] = _Place(k, (), times[0])
    if name not in known:
        told = f'"{shorten(name)}" is no number of this mission.{did_you_mean(name, known)}'
        raise InputError(told, field="variables")
    return known[name]
