"""Help of every command, as the command line prints it."""

import io
from collections.abc import Iterator

from cyclopts import App
from rich.console import Console

from nectosome.cli.app import app


def names(below: App = app, *path: str) -> Iterator[tuple[str, ...]]:
    """Every command and what is below it, without the options that every command has."""
    for name in below:
        if not name.startswith("-"):
            yield (*path, name)
            yield from names(below[name], *path, name)


def help_texts() -> str:
    """A section for each command."""
    parts = []
    for name in names():
        text = io.StringIO()
        app.help_print(name, console=Console(file=text, width=80, color_system=None, force_terminal=False))
        lines = "\n".join(line.rstrip() for line in text.getvalue().strip().splitlines())
        parts.append(f"## {' '.join(name)}\n\n```text\n{lines}\n```")
    return "\n\n".join(parts)
