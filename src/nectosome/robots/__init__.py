"""The robots that ship, as files and as families of them, by name."""

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from nectosome.description import RobotDescription, apply_settings, load_robot
from nectosome.io.file_system import entries, exists
from nectosome.units import InputError, did_you_mean, kind_of

from .beetle import beetle, beetle_free, paddle
from .flagella import flagella
from .shipped import file_names, file_of, mission_of

__all__ = ["beetle", "beetle_free", "describe", "flagella", "is_count", "mission_of", "names", "of_family", "paddle"]

_FAMILIES = {"beetle": beetle, "beetle_free": beetle_free, "flagella": flagella, "paddle": paddle}
_COUNT = "N"  # of flagella or segments
_USUAL = {"beetle": 3, "beetle_free": 3}  # how many parts where no number is given


def names() -> list[str]:
    """Names of the robots that ship; flagella4, paddle2 and beetle1 stand for any number of flagella and segments."""
    return sorted([*file_names(), *_USUAL, "beetle1", "flagella4", "paddle2"])


def describe(robot: str | Path, settings: Iterable[str] = ()) -> RobotDescription:
    """Description of a robot that ships, by name, or of a robot file, by path, with `settings` such as `E=3MPa`.

    Of a family the setting `N=2` says how many flagella or segments, of a file `limbs.fin.repeat.count=4` how many
    copies of a limb, `rays.fin.count=4` how many rays. Raises InputError.
    """
    if not isinstance(robot, str | Path):
        raise InputError(f"{kind_of(robot)} is given where the name of a robot or the path of its file is expected.")
    family, count = _family(str(robot))
    numbers, copies, others = [], {}, []
    for setting in [settings] if isinstance(settings, str) else settings:
        name = setting.partition("=")[0].strip()
        if family is not None and name == _COUNT:
            numbers.append(setting)
        elif is_count(name) and name != _COUNT:
            copies[name] = _count(setting)
        else:
            others.append(setting)
    count = [count, *map(_count, numbers)][-1]
    description = _load(str(robot), copies) if family is None or count is None else family(count)
    return apply_settings(description, others, Path(robot).parent) if others else description


def is_count(name: str) -> bool:
    """Return whether a setting is how many parts there are: `N` of a family, of a file `limbs.fin.repeat.count` or
    `rays.fin.count`."""
    return name == _COUNT or re.fullmatch(r"limbs\.[^.]+\.repeat\.count|rays\.[^.]+\.count", name) is not None


def of_family(robot: str) -> RobotDescription | None:
    """Robot of a family, such as flagella2, by its name; None where it is of none. Raises InputError."""
    family, count = _family(robot)
    return None if family is None or count is None else family(count)


def _family(robot: str) -> tuple[Callable[[int], RobotDescription] | None, int | None]:
    match = re.fullmatch(r"([a-z_]+?)(\d{1,3})?", robot)
    family = _FAMILIES.get(match[1]) if match else None
    return family, int(match[2]) if match and match[2] else _USUAL.get(robot)


def _load(robot: str, copies: Mapping[str, int]) -> RobotDescription:
    if robot in file_names():
        return load_robot(file_of(robot), copies)
    if robot.endswith((".yaml", ".yml")) or exists(robot):
        return load_robot(robot, copies)
    files = [path.name for path in entries(".", "*.y*ml")]
    near = did_you_mean(robot, names()) or did_you_mean(f"{Path(robot).stem}.yaml", files, most=0)
    raise InputError(f'there is no robot called "{robot}", nor a file of that name.{near}')


def _count(setting: str) -> int:
    text = setting.partition("=")[2].strip()
    if not (text.isascii() and text.isdigit() and len(text) <= 3):
        name = setting.partition("=")[0].strip()
        raise InputError(f'"{text}" is not a number of parts. Write a whole number, as in "{name}=2".', field=name)
    return int(text)
