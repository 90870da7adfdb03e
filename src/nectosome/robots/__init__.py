"""The robots that ship, and `build`, which turns a description into a robot."""

import os
from collections.abc import Iterable

from nectosome.io import InputError, RobotDescription, apply_settings, did_you_mean, load_robot

from .build import Blueprint, bind, blueprint_of, build, fill
from .flagella import flagella
from .paddle import paddle
from .shipped import family_of, file_names, file_of

__all__ = ["Blueprint", "bind", "blueprint_of", "build", "describe", "fill", "flagella", "names", "paddle"]


def names() -> list[str]:
    """Names of the robots that ship; flagella4 and paddle2 stand for any number of flagella and segments."""
    return sorted([*file_names(), "flagella4", "paddle2"])


def describe(robot: str, settings: Iterable[str] = ()) -> RobotDescription:
    """Description of a robot that ships, by name, or of a robot file, by path, with `settings` such as `E=3MPa`.

    Of a family the setting `N=2` says how many flagella or segments. Raises InputError.
    """
    settings = list(settings)
    counts = [text for text in settings if text.partition("=")[0].strip() == "N"] if family_of(robot) else []
    rest = [text for text in settings if text not in counts]
    return apply_settings(_find(robot, counts), rest) if rest else _find(robot, counts)


def _find(robot: str, counts: list[str]) -> RobotDescription:
    family = family_of(robot)
    if family is not None:
        count = _count(counts[-1]) if counts else family[1]
        if count is not None:
            return (flagella if family[0] == "flagella" else paddle)(count)
    if robot in file_names():
        return load_robot(file_of(robot))
    if robot.endswith((".yaml", ".yml")) or os.path.exists(robot):  # noqa: PTH110  Path.exists raises on long names
        return load_robot(robot)
    raise InputError(f'there is no robot called "{robot}", nor a file of that name.{did_you_mean(robot, names())}')


def _count(setting: str) -> int:
    text = setting.partition("=")[2].strip()
    if not (text.isascii() and text.isdigit() and len(text) <= 3):
        raise InputError(f'"{text}" is no number of parts. Write a whole number, as in "N=2".', field="N")
    return int(text)
