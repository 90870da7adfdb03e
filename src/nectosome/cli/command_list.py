"""What makes a function, or an app of several, a command: `@command` above it."""

from collections.abc import Callable
from typing import Any, TypeVar

from cyclopts import App

_C = TypeVar("_C", bound=Callable[..., Any] | App)

COMMANDS: list[Callable[..., Any] | App] = []  # of the modules of `cli` that are loaded


def command(made: _C) -> _C:
    """Mark a command: the function with its docstring as help, or the app of its subcommands."""
    COMMANDS.append(made)
    return made
