"""Files of design problems: their fields."""

from typing import Annotated

from pydantic import AfterValidator, WithJsonSchema

from nectosome.description.base import Direction
from nectosome.description.variables import RangesText
from nectosome.io.schema.described import Described, Text, unfit
from nectosome.units import InputError

from .constraints import read_constraint
from .quantities import QUANTITIES, formula_of


def _goal(text: str) -> str:
    try:
        if text:
            formula_of(text, "goal")
    except InputError as error:
        raise unfit(error.message) from None
    return text


def _limit(text: str) -> str:
    try:
        read_constraint(text)
    except InputError as error:
        raise unfit(error.message) from None
    return text


_ABOUT = [quantity.about for quantity in QUANTITIES.values()]
_NAMES = {"enum": [*QUANTITIES], "enumDescriptions": _ABOUT}
_EXPRESSION = {"type": "string", "pattern": r"[-+*/(]", "examples": ["forward_speed/power"]}
Goal = Annotated[str, AfterValidator(_goal), WithJsonSchema({"anyOf": [_NAMES, _EXPRESSION]})]
LimitText = Annotated[
    Text,
    AfterValidator(_limit),
    WithJsonSchema({"type": "string", "examples": ["torque <= 0.5 N m", "motor 0.89 N m, 22 rad/s"]}),
]


class ProblemDescription(Described):
    """A design problem: what of a robot may vary, and what is made as large or small as possible."""

    about: str = ""
    """What the problem is and where its numbers come from, in sentences."""
    vary: RangesText
    """Quantities of the robot, by path or alias, each with a range; of a mission its numbers, as `swim.until`."""
    maximise: Goal = ""
    """Quantity of the motion, or expression of several, made as large as possible; speed, where nothing is said."""
    minimise: Goal = ""
    """Quantity of the motion, or expression of several, made as small as possible, instead of one to maximise."""
    keep: tuple[LimitText, ...] = ()
    """Limits that the motion keeps: a quantity, <= or >= and a value, or a motor by stall torque and no-load speed."""
    forward: Direction | None = None
    """Direction of the world along which speed and thrust count; x, where nothing is said."""
    mission: str = ""
    """A mission whose time is made as short as possible: one that ships, by name, or a file beside this one."""
