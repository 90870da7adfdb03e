"""Missions: what a robot is made to do, mode after mode, and what ends each of them."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, get_args

from pydantic import BeforeValidator, Field

from nectosome.description.base import Described, Name, OneOrMany
from nectosome.description.fields import Duration, Quantity
from nectosome.description.paths import resolve
from nectosome.description.robot import RobotDescription
from nectosome.description.settings import parse_setting
from nectosome.description.validate import line_of, validate_as
from nectosome.io.yaml_text import Key, read_text, read_yaml
from nectosome.units import InputError, did_you_mean, shorten

Happening = Literal["touchdown", "liftoff", "surface", "low_wall", "high_wall"]
_LENGTH, _ANGLE = Quantity("length"), Quantity("angle")
_PLACES: dict[str, Quantity] = {f"position.{axis}": _LENGTH for axis in "xyz"} | {"pitch": _ANGLE, "heading": _ANGLE}
DURATION = Quantity("time", minimum=0)
_Text = Annotated[str, BeforeValidator(lambda value: str(value) if isinstance(value, int | float) else value)]


class ModeDescription(Described):
    """One mode: `set` quantities of the robot, by path or alias, `until` something happens.

    A value is reached at once, or evenly `in` a time: `0.61 L in 10 s`. `until` is a time in the mode (`20 s`),
    `touchdown` or `liftoff` (of the first, of the last foot), `surface` (the robot's top comes out of the water),
    `low_wall` or `high_wall` (the contact of its hull with the wall at the smaller, at the larger x), a place such as
    `position.x > 0.9 m`, `position.z < 20 cm`, `pitch > 10 deg` or `heading > 170 deg` (of its x axis, seen from
    above), or a list of these, of which the first counts. Where none comes within `longest` [s] the mission ends.
    """

    name: Name
    set: dict[str, _Text] = Field(default_factory=dict)
    until: Annotated[tuple[_Text, ...], Field(min_length=1), OneOrMany()]
    longest: Duration = 120.0


class MissionDescription(Described):
    """A mission: its `modes`, in order."""

    about: str = ""
    modes: Annotated[tuple[ModeDescription, ...], Field(min_length=1)]


class Event(NamedTuple):
    """What ends a mode: a time in it [s], something that happens, or a place that is passed."""

    told: str
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
    found = validate_as(MissionDescription, data, "A mission has at least one mode.", file=source, lines=lines)
    seen: dict[str, int] = {}
    modes = []
    for k, mode in enumerate(found.modes):
        if mode.name in seen:
            raise _mistake(
                f"there is a mode of this name before, number {seen[mode.name]}.", ("modes", k, "name"), source, lines
            )
        seen[mode.name] = k + 1
        changes: dict[str, Change] = {}
        for name, value in mode.set.items():
            try:
                one = _read_change(name, value, robot)
                twice = next((path for path in one if path in changes), None)
                if twice is not None:
                    raise InputError(f"{twice} is set twice in this mode.")
                changes |= one
            except InputError as error:
                raise _mistake(error.message, ("modes", k, "set", name), source, lines) from None
        try:
            until = tuple(_read_event(event, robot) for event in mode.until)
        except InputError as error:
            raise _mistake(error.message, ("modes", k, "until"), source, lines) from None
        modes.append(Mode(mode.name, changes, until, mode.longest))
    return Mission(robot, tuple(modes), text)


def _mistake(why: str, path: Key, source: str, lines: Mapping[Key, int]) -> InputError:
    return InputError(why, file=source, line=line_of(path, lines), field=shorten(".".join(map(str, path)), 120))


def _read_change(name: str, text: str, robot: RobotDescription) -> dict[str, Change]:
    value, ramp, time = (part.strip() for part in text.partition(" in "))
    seconds = 0.0
    resolve(robot, name)
    if ramp:
        try:
            seconds = DURATION.read(time, units_required=True)
        except ValueError as error:
            raise InputError(str(error)) from None
    return {path: Change(x, seconds) for path, x in parse_setting(f"{name}={value}", robot).items()}


def _read_event(text: str, robot: RobotDescription) -> Event:
    """Event in words, where the robot can have it."""
    what = text.strip()
    place = re.fullmatch(r"([a-z.]+)\s*([<>])\s*(.+)", what)
    if place is None and re.match(r"[-+]?[\d.]", what):
        try:
            return Event(what, "time", DURATION.read(what, units_required=True))
        except ValueError as error:
            raise InputError(str(error)) from None
    if place is not None and place[1] in _PLACES:
        try:
            return Event(what, place[1], _PLACES[place[1]].read(place[3], units_required=True), place[2] == "<")
        except ValueError as error:
            raise InputError(str(error)) from None
    known = [*get_args(Happening), *(f"{name} > value" for name in _PLACES), "a time"]
    for name in get_args(Happening):
        if what == name:
            _check_possible(name, robot)
            return Event(what, name)
    raise InputError(f'"{shorten(what)}" is nothing that a mode can end with.{did_you_mean(what, known)}')


def _check_possible(happening: Happening, robot: RobotDescription) -> None:
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
