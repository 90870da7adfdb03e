"""Where the robots that ship lie, and how they are found by name."""

from pathlib import Path

_FOLDER = Path(__file__).parent


def file_of(name: str) -> Path:
    """File of a robot that ships."""
    return _FOLDER / f"{name}.yaml"


def file_names() -> list[str]:
    """Names of the robots that ship as files."""
    return sorted(path.stem for path in _FOLDER.glob("*.yaml"))


def mission_of(name: str) -> Path | None:
    """Mission file that ships, by name, the robot's or one more; None where there is none."""
    return next((path for path in (_FOLDER / "missions").glob("*.yaml") if path.stem == name), None)
