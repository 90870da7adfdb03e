"""What a public function takes for a robot: a name, a path, a description or a built robot."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nectosome.description import RobotDescription, apply_settings
from nectosome.mechanism import Robot
from nectosome.robots import describe
from nectosome.units import InputError, shorten

from .build import build

RobotLike = str | Path | RobotDescription | Robot

_EXPECTED = "Give a robot's name, the path of its file, its description, or what ns.build makes of one."
_RUN = "A run knows its robot: run.value.system."


def description_of(robot: RobotLike, settings: Iterable[str] = ()) -> RobotDescription:
    """Description of a robot that is given by name, path, description or built.

    `settings` such as `E=3MPa` change quantities of it. Raises InputError where it is nothing of these, where there is
    no such robot, file or quantity, and for a built robot whose numbers or parts were changed since it was built.
    """
    settings = [settings] if isinstance(settings, str) else list(settings)
    if isinstance(robot, str | Path):
        return describe(str(robot), settings)
    if isinstance(robot, RobotDescription):
        return apply_settings(robot, settings) if settings else robot
    if not isinstance(robot, Robot):
        raise InputError(f"{kind_of(robot)} is given where a robot is expected. {_EXPECTED}{_way_out(robot)}")
    if robot.description is None:
        raise InputError(
            "this robot has no description: it was put together or changed after it was built. Give its description."
        )
    return apply_settings(robot.description, settings) if settings else robot.description


def robot_of(robot: RobotLike, settings: Iterable[str] = ()) -> Robot:
    """Built robot of a name, path, description or built robot, which is handed back as it is without `settings`.

    Raises InputError as `description_of` does.
    """
    if isinstance(robot, Robot) and not settings:
        return robot
    return build(description_of(robot, settings))


def kind_of(thing: Any) -> str:
    """What something is, for a message: its kind, and a number or text itself."""
    kind = type(thing)
    if thing is None:
        return "nothing (None)"
    if kind.__name__ in _KINDS:
        return _KINDS[kind.__name__]
    if isinstance(thing, bool | int | float | bytes):
        return f"the {kind.__name__} {shorten(thing)}"
    return f"{'an' if kind.__name__[0].lower() in 'aeiou' else 'a'} {kind.__name__}"


_KINDS = {
    "Dataset": "a dataset",
    "DataArray": "a data array",
    "DataFrame": "a table",
    "ndarray": "an array of numbers",
    "ArrayImpl": "an array of numbers",
    "Run": "a run",
    "Steady": "a steady motion",
    "Periodic": "a periodic motion",
    "Static": "a static equilibrium",
}


def _way_out(thing: Any) -> str:
    if type(thing).__name__ == "Dataset":
        return " The text of a dataset's robot is in its attribute robot; nectosome.description.parse_robot reads it."
    return f" {_RUN}" if type(thing).__name__ in ("Run", "Steady", "Periodic", "Static") else ""
