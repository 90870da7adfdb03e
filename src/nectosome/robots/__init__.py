"""The robots that ship as files, and `build`, which turns a description into a robot."""

from pathlib import Path

from nectosome.io import InputError, RobotDescription, did_you_mean, load_robot

from .build import bind, build

__all__ = ["bind", "build", "describe", "names"]

_FOLDER = Path(__file__).parent


def names() -> list[str]:
    """Names of the robots that ship."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def describe(robot: str) -> RobotDescription:
    """Description of a robot that ships, by name, or of a robot file, by path. Raises InputError."""
    if robot in names():
        return load_robot(_FOLDER / f"{robot}.yaml")
    path = Path(robot)
    if path.suffix in (".yaml", ".yml") or path.exists():
        return load_robot(path)
    raise InputError(
        f'there is no robot called "{robot}", nor a file of that name.{did_you_mean(robot, names())} '
        f"Robots that ship: {', '.join(names())}."
    )
