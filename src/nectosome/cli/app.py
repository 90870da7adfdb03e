"""The commands together, and what becomes of mistakes: one sentence and exit code 2."""

import contextlib
import gc
import os
import sys
import warnings
from collections.abc import Sequence
from importlib.metadata import version
from typing import IO, cast

from cyclopts import App, CycloptsError, Parameter
from cyclopts.exceptions import MissingArgumentError, UnusedCliTokensError
from rich.console import Console

from nectosome.cli.options import COMMANDS
from nectosome.cli.output import JSON, ReaderGoneError, Stdout, answered, tell
from nectosome.io.discovery import load_modules
from nectosome.units import InputError

_READER_GONE = 128 + 13  # as of a process that SIGPIPE ends

app = App(
    name="nectosome",
    help="From a drawing to a tuned underwater soft robot.",
    version=lambda: f"nectosome {version('nectosome')}",
    default_parameter=Parameter(negative=(), json_list=False),
    exit_on_error=False,
    print_error=False,
    suppress_keyboard_interrupt=False,
    result_action="return_value",
)
load_modules("nectosome.cli")
for command in COMMANDS:
    app.command(command)
app.register_install_completion_command(help="Install tab completion for this shell (bash, zsh, fish).")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command (that of the shell by default) and return its exit code.

    0: done. 1: no solution, and why. 2: bad input, with one sentence on stderr. 130: cancelled. 141: what reads stdout
    has gone, as `head` does, of which nothing is said.
    """
    gc.set_threshold(50_000, 20, 20)  # importing and tracing make many objects that stay
    warnings.filterwarnings("ignore", message="Error (reading|writing) persistent compilation cache")
    warnings.filterwarnings("ignore", message="Cannot close a netcdf_file")  # a damaged one, when its error is dropped
    words = [*(sys.argv[1:] if argv is None else argv)]
    if JSON not in words or {"-h", "--help"} & {*words}:
        return _run(words)[0]
    try:
        return answered(" ".join(app.parse_commands(words)[0]), lambda: _run(words))
    except ReaderGoneError:
        return _READER_GONE
    except InputError as error:
        tell(str(error))
        return 2


def _run(words: list[str]) -> tuple[int, InputError | None]:
    """Run a command, and return its exit code and the mistake that it tells of."""
    try:
        code = app(words, console=Console(file=cast("IO[str]", Stdout())))  # of help and the version
    except (CycloptsError, InputError) as error:
        mistake = InputError(_sentence(error)) if isinstance(error, CycloptsError) else error
        tell(str(mistake))
        return 2, mistake
    except KeyboardInterrupt:
        tell("cancelled.")
        return 130, None
    except ReaderGoneError:
        return _READER_GONE, None
    return (code if isinstance(code, int) else 0), None


def run() -> None:
    """Run the command of the shell and end the process at once: taking XLA down in order takes a third of a second.

    All files are written and closed by then.
    """
    warnings.showwarning = lambda message, *_, **__: tell(str(message))
    _open_streams()
    code = main()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):
            stream.flush()
    os._exit(code)


def _open_streams() -> None:
    """Open streams that the shell has closed: else the next file that is opened would get what is printed.

    What is said to a closed stderr goes nowhere. A closed stdout cannot be written, as a full disk cannot.
    """
    for number, mode in ((0, os.O_RDONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:  # the lowest number that is free is taken
            os.open(os.devnull, mode)
    if sys.stdout is None:
        sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: PTH123, SIM115


def _sentence(error: CycloptsError) -> str:
    """Say what is wrong with the options, without the names of Python's things."""
    error.verbose = False
    where = " ".join(error.command_chain or ())
    if isinstance(error, MissingArgumentError) and error.argument is not None:
        name = error.keyword or error.argument.name
        what = f"{name} needs a value." if name.startswith("-") else f"{name} is missing."
    elif isinstance(error, UnusedCliTokensError):
        what = f'"{" ".join(error.unused_tokens or ())}" is one too many.'
    else:
        what = str(error)
    return f"{where}: {what} See nectosome {where} --help." if where else f"{what} See nectosome --help."
