"""Choices that are no numbers, such as the model of a servo from the catalogue: each makes a robot of its own."""

from collections.abc import Iterable

from nectosome.description import RobotDescription
from nectosome.io.schema.structure import at_path
from nectosome.units import InputError


def is_choice(name: str, description: RobotDescription) -> bool:
    """Whether a path is that of a text or a switch of the robot, such as `body.joint.servo.model`."""
    here, value = at_path(description, name)
    return here is not None and here.quantity is None and isinstance(value, str | bool)


def choices_of(name: str, values: object) -> tuple[str, ...]:
    """The texts `a,b,c` that a choice takes, or texts one by one. Raises InputError for none and for one twice."""
    given = values.split(",") if isinstance(values, str) else values if isinstance(values, Iterable) else [values]
    found = tuple(str(text).strip() for text in given)
    if not all(found) or not found:
        raise InputError("takes no value: write a list, as in XC330-M288-T,XW540-T140-R.", field=name)
    if len(set(found)) < len(found):
        raise InputError("takes a value twice.", field=name)
    return found
