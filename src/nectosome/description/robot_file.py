"""Robot files: YAML to a description and back, by way of plain data (text with units, lists and dicts)."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic_core import PydanticCustomError

from nectosome.description.mesh_added_mass import with_added_mass
from nectosome.description.meshes import MeshShape
from nectosome.description.parts import Rigid
from nectosome.description.robot import RobotDescription, check_description
from nectosome.io.atomic import write_atomic
from nectosome.io.schema.described import inside
from nectosome.io.schema.structure import to_plain
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import Key, read_text, read_yaml, write_yaml
from nectosome.units import InputError


def load_robot(path: str | Path, copies: Mapping[str, int] | None = None) -> RobotDescription:
    """Return the robot described in the YAML file at `path`.

    - copies: counts of limbs that take the place of the file's, such as {"limbs.fin.repeat.count": 4}.

    Raises InputError with file, line and field for whatever is wrong: no such file, no text, no YAML, no robot.
    """
    data, lines = read_yaml(read_text(path), str(path))
    for name, count in (copies or {}).items():
        *groups, last = name.split(".")
        place = data
        for group in groups:
            place = place.get(group) if isinstance(place, dict) else None
        if not isinstance(place, dict) or last not in place:
            raise InputError("the file has no limb with such a count.", file=str(path), field=name)
        place[last] = count
    description = validate(data, file=str(path), lines=lines)
    for name, part in description.parts.items():
        if isinstance(part, Rigid) and isinstance(part.shape, MeshShape):
            with _in_part(path, description.place_of(name)):
                with inside("shape"):
                    shape = part.shape.refreshed(Path(path).parent)
                if shape is not part.shape:
                    loads = with_added_mass(part.loads, shape, Path(path).parent)
                    description = description.with_part(name, shape=shape, loads=loads)
    return description


@contextmanager
def _in_part(path: str | Path, part: str) -> Iterator[None]:
    """Name file and field in errors of a mesh that has changed."""
    try:
        with inside(part):
            yield
    except PydanticCustomError as error:
        raise InputError(error.message(), file=str(path), field=(error.context or {})["field"]) from None


def parse_robot(text: str, source: str = "robot") -> RobotDescription:
    """Return the robot described in YAML `text`; `source` names it in messages. Raises InputError."""
    data, lines = read_yaml(text, source)
    return validate(data, file=source, lines=lines)


def validate(
    data: Any, *, file: str | None = None, lines: Mapping[Key, int] | None = None, folder: Path | None = None
) -> RobotDescription:
    """Return the description in plain `data`; InputError names file, line and field of the first mistake.

    Names of other files are relative to `folder`, else to that of `file`.
    """
    return validate_as(RobotDescription, data, "robot", file=file, lines=lines, folder=folder)


def dump_robot(description: RobotDescription) -> str:
    """Return YAML text with readable units that loads as exactly the same description."""
    return write_yaml(to_plain(description))


def save_robot(description: RobotDescription, path: str | Path) -> None:
    """Write a robot file that `load_robot` reads as exactly the same description, whole or not at all.

    Raises InputError for what is no description, and where it cannot be written.
    """
    check_description(description)
    write_atomic(path, dump_robot(description).encode())
