"""Missions: the modes of a robot one after another, what ends each of them, and which of their numbers may be chosen.

A number is called `MODE.QUANTITY`, the value to which a mode sets a quantity, by the path or the alias of the robot, or
`MODE.until`, the duration of a mode that ends by time.
"""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, get_args

from pydantic import Field

from nectosome.description.fields import Duration, Name
from nectosome.description.period import check_no_update_rate
from nectosome.description.robot import RobotDescription, numeric_paths, resolve
from nectosome.description.robot_file import read_value
from nectosome.description.variables import Variable, read_range
from nectosome.io.schema.described import Described, OneOrMany, Text
from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.validate import errors_at, validate_as
from nectosome.io.yaml_text import read_text, read_yaml, write_yaml
from nectosome.units import InputError, did_you_mean, format_quantity, shorten

Happening = Literal["touchdown", "liftoff", "surface", "low_wall", "high_wall"]
_LENGTH, _ANGLE = Quantity("length"), Quantity("angle")
_PLACES: dict[str, Quantity] = {f"position.{axis}": _LENGTH for axis in "xyz"} | {"pitch": _ANGLE, "heading": _ANGLE}
_DURATION = Quantity("time", minimum=0)


class ModeDescription(Described):
    """One mode of a mission: the robot gets new values, and goes on with them until something happens."""

    name: Name
    """Name of the mode; no two of a mission have the same."""
    set: dict[str, Text] = Field(default_factory=dict)
    """Quantities of the robot, by path or alias, with their values: `jet: 10.5 rad/s`. A value is reached at once, or
    evenly in a time: `volume: 0.61 L in 10 s`."""
    until: Annotated[tuple[Text, ...], Field(min_length=1), OneOrMany()]
    """What ends the mode. A time in it: `20 s`. A happening: `touchdown` or `liftoff` (of the first, of the last foot),
    `surface` (the robot's top comes out of the water), `low_wall` or `high_wall` (its hull touches the wall at the
    smaller, at the larger x). A place: `position.x > 0.9 m`, `position.z < 20 cm`, `pitch > 10 deg`, `heading > 170
    deg` (of its x axis, seen from above). Of a list, what comes first."""
    longest: Duration = 120.0
    """Time in the mode after which the mission ends where nothing of `until` has come."""


class MissionDescription(Described):
    """A mission: modes of a robot, in order."""

    about: str = ""
    """What the mission is, in sentences."""
    modes: Annotated[tuple[ModeDescription, ...], Field(min_length=1)]
    """The modes, one after another."""


class Event(NamedTuple):
    """What ends a mode: a time in it [s], something that happens, or a place that is passed."""

    text: str
    kind: str  # "time", a `Happening`, or one of `_PLACES`
    limit: float = 0.0  # [s, m or rad]
    below: bool = False  # a place has to be below its limit


class Change(NamedTuple):
    """Where a quantity is taken, and in which time from what it is [s]."""

    value: float
    seconds: float


class Mode(NamedTuple):
    """A mode of a mission for one robot."""

    name: str
    changes: dict[str, Change]  # by path
    until: tuple[Event, ...]
    longest: float  # [s]


class Mission(NamedTuple):
    """A robot and the modes it goes through; `text` is the file it was read from."""

    robot: RobotDescription
    modes: tuple[Mode, ...]
    text: str = ""


def load_mission(path: str | Path, robot: RobotDescription) -> Mission:
    """Mission in a file, for a robot. Raises InputError that names file, line and field."""
    return parse_mission(read_text(path), robot, str(path))


def parse_mission(text: str, robot: RobotDescription, source: str = "mission") -> Mission:
    """Mission in YAML `text`, for a robot; `source` names it in messages. Raises InputError."""
    data, lines = read_yaml(text, source)
    mission = validate_as(MissionDescription, data, "mission", file=source, lines=lines)

    at = partial(errors_at, source, lines)
    names = [mode.name for mode in mission.modes]
    modes = []
    for k, mode in enumerate(mission.modes):
        with at("modes", k, "name"):
            if mode.name in names[:k]:
                raise InputError(f"there is a mode of this name before, number {names.index(mode.name) + 1}.")
        changes: dict[str, Change] = {}
        for name, value in mode.set.items():
            with at("modes", k, "set", name):
                one = _read_change(name, value, robot)
                if twice := [path for path in one if path in changes]:
                    raise InputError(f"{twice[0]} is set twice in this mode.")
                changes |= one
        with at("modes", k, "until"):
            until = tuple(_read_event(event, robot) for event in mode.until)
        modes.append(Mode(mode.name, changes, until, mode.longest))
    return Mission(robot, tuple(modes), text)


def _read_change(name: str, text: str, robot: RobotDescription) -> dict[str, Change]:
    value, ramp, time = (part.strip() for part in text.partition(" in "))
    check_no_update_rate(robot, [name])
    seconds = _read(time, _DURATION) if ramp else 0.0
    return {path: Change(x, seconds) for path, x in read_value(name, value, robot).items()}


def _read(text: str, quantity: Quantity) -> float:
    try:
        return quantity.read(text, units_required=True)
    except ValueError as error:
        raise InputError(str(error)) from None


def _read_event(text: str, robot: RobotDescription) -> Event:
    """Event in words, where the robot can have it."""
    what = text.strip()
    place = re.fullmatch(r"([a-z.]+)\s*([<>])\s*(.+)", what)
    if place is None and re.match(r"[-+]?[\d.]", what):
        return Event(what, "time", _read(what, _DURATION))
    if place is not None and place[1] in _PLACES:
        return Event(what, place[1], _read(place[3], _PLACES[place[1]]), place[2] == "<")
    if what in get_args(Happening):
        _check_possible(what, robot)
        return Event(what, what)
    known = [*get_args(Happening), *(f"{name} > value" for name in _PLACES), "a time"]
    raise InputError(f'"{shorten(what)}" is nothing that a mode can end with.{did_you_mean(what, known)}')


def _check_possible(happening: str, robot: RobotDescription) -> None:
    """Raise InputError where a robot cannot have it."""
    loads = {load.kind for part in robot.parts.values() for load in part.loads.values()}
    water = robot.water
    lacks = {
        "touchdown": [("legs", "leg" in loads), ("a floor in its water", water.floor is not None)],
        "surface": [("a surface of its water", water.surface is not None)],
        "low_wall": [("a wall contact", "wall_contact" in loads), ("walls in its water", water.walls is not None)],
    }
    lacks |= {"liftoff": lacks["touchdown"], "high_wall": lacks["low_wall"]}
    for what, there in lacks[happening]:
        if not there:
            raise InputError(f"{robot.name} has no {happening}: it lacks {what}.")


_UNTIL = "until"


class _Place(NamedTuple):
    """Position of a number in a mission."""

    mode: int
    paths: tuple[str, ...]  # that the mode sets; () of the time that ends it
    event: int  # that time among what ends the mode; -1 of paths


def read_schedule_variable(name: str, span: str | Sequence[float], mission: Mission) -> Variable:
    """Read a range of a mission's number, such as `5..20s` of `swim.until`.

    Raises InputError for an unknown name, a value that its quantity does not allow, an empty range.
    """
    known = numeric_paths(mission.robot)
    return read_range(name, span, [known[path] for path in _place(mission, name).paths] or [_DURATION])


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
            until[place.event] = until[place.event]._replace(text=format_quantity(value, "time"), limit=value)
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
        changes = {
            path: format_quantity(change.value, known[path].dimension)
            + (f" in {format_quantity(change.seconds, 'time')}" if change.seconds else "")
            for path, change in mode.changes.items()
        }
        until, longest = [event.text for event in mode.until], format_quantity(mode.longest, "time")
        own: dict[str, object] = {"set": changes} if changes else {}
        modes.append({"name": mode.name, **own, "until": until, "longest": longest})
    return write_yaml({"modes": modes})


def _place(mission: Mission, name: str) -> _Place:
    known: dict[str, _Place] = {}
    for k, mode in enumerate(mission.modes):
        known |= {f"{mode.name}.{path}": _Place(k, (path,), -1) for path in mode.changes}
        for alias in mission.robot.number_aliases:
            paths = tuple(resolve(mission.robot, alias))
            if set(paths) <= set(mode.changes):
                known[f"{mode.name}.{alias}"] = _Place(k, paths, -1)
        times = [i for i, event in enumerate(mode.until) if event.kind == "time"]
        if len(times) == 1:
            known[f"{mode.name}.{_UNTIL}"] = _Place(k, (), times[0])
    if name not in known:
        why = f'"{shorten(name)}" is no number of this mission.{did_you_mean(name, known)}'
        raise InputError(why, field="variables")
    return known[name]
