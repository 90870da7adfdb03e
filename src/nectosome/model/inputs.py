"""What a public function takes for a robot: a name, a path, a description or a built robot."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nectosome.description import RobotDescription, apply_settings
from nectosome.mechanism import Robot
from nectosome.robots import describe
from nectosome.units import InputError, kind_of

RobotLike = str | Path | RobotDescription | Robot

_EXPECTED = "Give a robot's name, the path of its file, its description, or what ns.build makes of one."
_OF_A_RUN = " A run knows its robot: run.value.system."
_WAY_OUT = {
    "Dataset": " The text of a dataset's robot is in its attribute robot; nectosome.description.parse_robot reads it.",
    **dict.fromkeys(("Run", "SimulationRun", "Steady", "Periodic", "Static"), _OF_A_RUN),
}


def description_of(robot: RobotLike, settings: Iterable[str] = ()) -> RobotDescription:
    """Description of a robot that is given by name, path, description or built.

    `settings` such as `E=3MPa` change quantities of it. Raises InputError where it is nothing of these, where there is
    no such robot, file or quantity, for settings that are no text, and for a built robot whose numbers or parts were
    changed since it was built.
    """
    settings = _texts(settings)
    if isinstance(robot, str | Path):
        return describe(str(robot), settings)
    if isinstance(robot, RobotDescription):
        return apply_settings(robot, settings) if settings else robot
    if not isinstance(robot, Robot):
        raise InputError(
            f"{kind_of(robot)} is given where a robot is expected. {_EXPECTED}{_WAY_OUT.get(type(robot).__name__, '')}"
        )
    if robot.description is None:
        raise InputError(
            "this robot has no description: it was put together or changed after it was built. Give its description."
        )
    return apply_settings(robot.description, settings) if settings else robot.description


def _texts(settings: Any) -> list[str]:
    texts = list(settings) if isinstance(settings, Iterable) and not isinstance(settings, str) else [settings]
    for text in texts:
        if not isinstance(text, str):
            raise InputError(f'{kind_of(text)} is no setting. Write text, as in "omega=14.4rad/s".', field="settings")
    return texts
