"""Where the robots that ship lie, and how they are found by name."""

from pathlib import Path

from nectosome.io.file_system import entries, exists

_FOLDER = Path(__file__).parent


def file_of(name: str) -> Path:
    """File of a robot that ships."""
    return _FOLDER / f"{name}.yaml"


def file_names() -> list[str]:
    """Names of the robots that ship as files."""
    return [path.stem for path in entries(_FOLDER, "*.yaml")]


def mission_of(name: str) -> Path | None:
    """Mission file that ships, by name, the robot's or one more; None where there is none."""
    return next((path for path in entries(_FOLDER / "missions", "*.yaml") if path.stem == name), None)


def starter_names() -> list[str]:
    """Names of the files that a person may start from: small ones made for it, then the robots that ship as files."""
    return [*(path.stem for path in entries(_FOLDER / "templates", "*.yaml")), *file_names()]


def starter_of(name: str) -> Path:
    """File of one of the `starter_names`."""
    own = _FOLDER / "templates" / f"{name}.yaml"
    return own if exists(own) else file_of(name)
