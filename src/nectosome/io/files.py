"""Robot files: YAML to a description and back."""

from pathlib import Path
from typing import Any

from nectosome.io.atomic import reason
from nectosome.io.description import RobotDescription
from nectosome.io.errors import InputError
from nectosome.io.plain import to_plain
from nectosome.io.validate import validate
from nectosome.io.yaml_text import read_yaml, write_yaml

MAX_BYTES = 1_000_000


def load_robot(path: str | Path) -> RobotDescription:
    """Return the robot described in the YAML file at `path`.

    Raises InputError with file, line and field for whatever is wrong: no such file, no text, no YAML, no robot.
    """
    source = str(path)
    try:
        with Path(path).open("rb") as file:
            raw = file.read(MAX_BYTES + 1)
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("this is not a text file.", file=source) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {reason(error)}.", file=source) from None
    if len(raw) > MAX_BYTES:
        raise InputError("larger than 1 MB, too large for a robot file.", file=source)
    return parse_robot(text, source)


def parse_robot(text: str, source: str = "robot") -> RobotDescription:
    """Return the robot described in YAML `text`; `source` names it in messages. Raises InputError."""
    data, lines = read_yaml(text, source)
    return validate(data, file=source, lines=lines)


def dump_robot(description: RobotDescription) -> str:
    """Return YAML text with readable units that loads as exactly the same description."""
    return write_yaml(to_plain(description))


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a robot file, for editors."""
    return RobotDescription.model_json_schema()
