"""Where the robots that ship lie, and how they are found by name."""

import re
from pathlib import Path

_FOLDER = Path(__file__).parent


def file_of(name: str) -> Path:
    """File of a robot that ships."""
    return _FOLDER / f"{name}.yaml"


def file_names() -> list[str]:
    """Names of the robots that ship as files."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def flagella_count(name: str) -> int | None:
    """4 of "flagella4"; None for other names."""
    found = re.fullmatch(r"flagella(\d{1,3})", name)
    return int(found[1]) if found else None
