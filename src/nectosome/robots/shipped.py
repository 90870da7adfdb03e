"""Where the robots that ship lie, and how they are found by name."""

import re
from pathlib import Path

_FOLDER = Path(__file__).parent
FAMILIES = ("flagella", "paddle")


def file_of(name: str) -> Path:
    """File of a robot that ships."""
    return _FOLDER / f"{name}.yaml"


def file_names() -> list[str]:
    """Names of the robots that ship as files."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def family_of(name: str) -> tuple[str, int | None] | None:
    """("flagella", 4) of "flagella4", ("paddle", None) of "paddle"; None for other names."""
    found = re.fullmatch(rf"({'|'.join(FAMILIES)})(\d{{1,3}})?", name)
    return (found[1], int(found[2]) if found[2] else None) if found else None
