"""Where the robots that ship lie, and how they are found by name."""

from pathlib import Path

_FOLDER = Path(__file__).parent


def file_of(name: str) -> Path:
    """File of a robot that ships."""
    return _FOLDER / f"{name}.yaml"


def file_names() -> list[str]:
    """Names of the robots that ship as files."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))
