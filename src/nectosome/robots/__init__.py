"""The robots that ship, and `build`, which turns a description into a robot."""

import os

from nectosome.io import InputError, RobotDescription, did_you_mean, load_robot

from .build import Blueprint, bind, blueprint_of, build, fill
from .flagella import flagella
from .shipped import file_names, file_of, flagella_count

__all__ = ["Blueprint", "bind", "blueprint_of", "build", "describe", "fill", "flagella", "names"]


def names() -> list[str]:
    """Names of the robots that ship; flagella4 stands for any number of flagella."""
    return sorted([*file_names(), "flagella4"])


def describe(robot: str) -> RobotDescription:
    """Description of a robot that ships, by name, or of a robot file, by path. Raises InputError."""
    if robot in file_names():
        return load_robot(file_of(robot))
    count = flagella_count(robot)
    if count is not None:
        return flagella(count)
    if robot.endswith((".yaml", ".yml")) or os.path.exists(robot):  # noqa: PTH110  Path.exists raises on long names
        return load_robot(robot)
    raise InputError(f'there is no robot called "{robot}", nor a file of that name.{did_you_mean(robot, names())}')
