"""The robot that a command works on: built, its masses checked; and warnings of values that no robot has."""

from typing import TYPE_CHECKING

from nectosome.cli.output import tell
from nectosome.description import RobotDescription
from nectosome.description.plausible import meaningless
from nectosome.units import count

if TYPE_CHECKING:
    from nectosome.mechanism import Robot

_NAMED = 6  # at most so many values by name


def build_weighed(description: RobotDescription, source: str) -> "Robot":
    """Return the robot of a description, which comes from `source`, and tell of values that no robot has.

    Raises InputError as `weigh` does.
    """
    from nectosome.model import build
    from nectosome.solve.weights import weigh

    robot = build(description)
    weigh(robot, source)
    tell_far_out(description, source)
    return robot


def tell_far_out(description: RobotDescription, source: str) -> None:
    """Tell of values that no robot has, of a description that comes from `source`."""
    far_out = list(meaningless(description))
    for path, sentence in far_out[:_NAMED]:
        tell(f"{source}, {path}: {sentence}")
    if len(far_out) > _NAMED:
        tell(f"{source}: {count(len(far_out) - _NAMED, 'more value')} of this kind. nectosome check shows all.")
