"""What the commands write: results to stdout, sentences to stderr, files where the user wants them."""

import os
import sys
from pathlib import Path

from rich.console import Console, RenderableType

from nectosome.units import InputError

_WIDTH = 120  # of what goes to a file or a pipe


def write(*things: RenderableType, wrap: bool = True) -> None:
    """Print to stdout. Raises InputError where it cannot take any more."""
    width = None if sys.stdout.isatty() else _WIDTH
    console = Console(file=sys.stdout, width=width, markup=False, emoji=False, highlight=False, soft_wrap=not wrap)
    try:
        for thing in things:
            console.print(thing)
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is left in the buffer goes nowhere
        raise InputError(f"cannot write the output: {error.strerror}.") from None


def tell(sentence: str) -> None:
    """Print one line to stderr."""
    line = "".join(c if c.isprintable() else " " for c in " ".join(sentence.split()))
    print(line, file=sys.stderr, flush=True)


def check_target(path: Path, option: str, suffix: str) -> None:
    """Raise InputError where no file can be written at `path`, before anything long is computed."""
    if path.suffix != suffix:
        raise InputError(f'"{path}" does not end in {suffix}, as what is written there would.', field=option)
    check_folder(path.parent, option, f".{path.name}.12345678")
    if path.is_dir():
        raise InputError(f"cannot write {path}: it is a folder.", field=option)
    if path.exists() and not path.is_file():
        raise InputError(f"cannot write {path}: it is not a file.", field=option)


def check_folder(folder: Path, option: str, name: str = ".nectosome") -> None:
    """Raise InputError where no file called `name` can be made in `folder`."""
    probe = folder / name
    try:
        probe.touch(exist_ok=False)
        probe.unlink()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"cannot write into {folder}: {why}.", field=option) from None
