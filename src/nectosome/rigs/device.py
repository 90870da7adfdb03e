"""Shared by rigs of devices: packages that are extras, errors of serial lines, and repeated attempts."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from nectosome.io import extras
from nectosome.units import InputError

from .rig import RigError

try:
    from termios import error as terminal_error  # not caught by pyserial, and no OSError
except ImportError:  # on Windows
    terminal_error = OSError


def package(name: str, extra: str) -> Any:
    """A module that comes with an extra of this package."""
    try:
        return extras.package(name, extra)
    except InputError as error:
        raise RigError(str(error)) from error


@contextmanager
def line(device: str) -> Iterator[None]:
    """Errors of a serial line, or its absence, become RigError."""
    try:
        yield
    except (OSError, terminal_error, ValueError) as error:
        raise RigError(
            f"{device}: the line does not work ({one_line(error)}). "
            "Look at the port's name, the cable, the power, and whether another program uses the port."
        ) from error


def insisted(step: Callable[[], object], otherwise: str) -> None:
    """Try a step that must not fail up to three times; `otherwise` tells a person what to do if it fails."""
    for left in (2, 1, 0):
        try:
            step()
            return
        except RigError as error:
            if not left:
                raise RigError(f"{error} {otherwise}") from error


def one_line(error: object) -> str:
    """A message without line breaks and full stop."""
    return " ".join(str(error).split()).rstrip(".")
