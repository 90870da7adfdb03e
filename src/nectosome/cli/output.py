"""What commands print and write: results to stdout, sentences to stderr, files that the user asks for.

With `--json` stdout has one JSON object instead, whatever happens, and stderr the same sentences. Its keys:

- `command`, `exit_code`, `title`, `status` and `status_reason` of a solver, `settings`, `made_with` (versions, time);
- `values` and `tables` of numbers as they were computed, in SI units, each with its `unit`. One that is NaN or infinite
  is null, with a `reason`. Quantities are called as in results: `reaction` and its largest magnitude `reaction_peak`;
- `notes`, `warnings`, `files` written; of `measure` also `parts`, one a recording;
- `error`: null where the exit code is 0, else a `message`, and the `file`, `line` and `field` that it is about.
"""

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Any, cast

from cyclopts import Parameter
from rich.console import Console

from nectosome.io.file_system import exists, is_file, is_folder, is_taken, reason
from nectosome.io.results import SUFFIXES, provenance, save_dataset
from nectosome.io.summary import Summary
from nectosome.units import InputError, brief, cut_words, printable

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.units.errors import ReasonedStatus

Save = Annotated[Path | None, Parameter("--save", help="Write the data to this file (.nc or .csv).")]
Plot = Annotated[Path | None, Parameter("--plot", help="Write a page with figures to this file (.html).")]
Force = Annotated[bool, Parameter("--force", help="Overwrite files that exist.")]
JSON = "--json"  # read by `main` too, before the options are, so that a mistake in these is told likewise
Json = Annotated[
    bool,
    Parameter(
        JSON,
        help="Print one JSON object: numbers in SI units with their units, settings, files, warnings, or an error.",
    ),
]


@Parameter(name="*")
@dataclass(frozen=True)
class Outputs:
    """Data and page that a command writes on request: `--save`, `--plot` and `--force`; and `--json`."""

    save: Save = None
    plot: Plot = None
    force: Force = False
    as_json: Json = False

    @property
    def given(self) -> list[Path]:
        """The files to write."""
        return [path for path in (self.save, self.plot) if path is not None]

    def check(self) -> None:
        """Raise InputError where a file cannot be written, before anything is computed."""
        check_target(self.save, "--save", SUFFIXES, self.force)
        check_target(self.plot, "--plot", (".html",), self.force)

    def write(
        self, data: "xr.Dataset", page: "Callable[[xr.Dataset, Path], object] | None", *others: Path | None
    ) -> None:
        """Write data and page as requested, and print their names and those of files that are written already."""
        if self.save is not None:
            save_dataset(data, self.save)
        if self.plot is not None and page is not None:
            page(data, self.plot)
        report(*self.given, *others)


@dataclass(frozen=True)
class Page(Outputs):
    """The page that a command writes on request: `--plot` and `--force`."""

    save: Annotated[None, Parameter(parse=False)] = None


@dataclass(frozen=True)
class Data(Outputs):
    """The data that a command writes on request: `--save` and `--force`."""

    plot: Annotated[None, Parameter(parse=False)] = None


def described(data: "xr.Dataset", title: str, settings: Mapping[str, Any]) -> "xr.Dataset":
    """Return the data with its title, and its provenance with `settings` as text."""
    given = {key: value if value is None else str(value) for key, value in settings.items()}
    data.attrs |= {"title": title, "provenance": json.dumps(provenance(given))}
    return data


@dataclass
class _Answer:
    """What `--json` prints at the end of a command."""

    found: dict[str, Any]
    files: list[str]
    told: list[str]


_answer: _Answer | None = None  # of the command that runs; None where it prints text


def answered(command: str, run: Callable[[], tuple[int, InputError | None]]) -> int:
    """Run a command, print what it found as one JSON object, and return its exit code.

    run() returns the exit code and the user's mistake, if there was one. Raises InputError where stdout cannot take it.
    """
    global _answer
    _answer = answer = _Answer(Summary().to_json(), [], [])
    try:
        code, mistake = run()
    finally:
        _answer = None
    error = None
    if mistake is not None:
        error = {key: getattr(mistake, key) for key in ("file", "line", "field")}
        error = {"message": brief(mistake.message)} | error
    elif code:
        error = {"message": " ".join(answer.told), "file": None, "line": None, "field": None}
    else:
        answer.found["warnings"] += answer.told
    found = {"command": command, "exit_code": code, **answer.found, "files": answer.files, "error": error}
    _print(json.dumps(found, indent=2, allow_nan=False))
    return code


def write(summary: Summary) -> None:
    """Print what a command found to stdout. Raises InputError where it cannot take any more."""
    if _answer is not None:
        _answer.found |= summary.to_json()
        return
    width = shutil.get_terminal_size().columns
    out = cast("IO[str]", Stdout())
    console = Console(file=out, width=width, markup=False, emoji=False, highlight=False, soft_wrap=True)
    for line in summary.lines(width):
        line.plain = cut_words(printable(line.plain))  # names come from files
        console.print(line)


class Stdout:
    """stdout for rich, which ends the process where a pipe is closed. Raises InputError where it takes no more."""

    def write(self, text: str) -> int:  # noqa: D102
        with _writable():
            return sys.stdout.write(text)

    def flush(self) -> None:  # noqa: D102
        with _writable():
            sys.stdout.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(sys.stdout, name)


def write_text(text: str) -> None:
    """Print text to stdout as it is; in JSON it is a note. Raises InputError where stdout cannot take any more."""
    if _answer is not None:
        _answer.found["notes"].append(text)
    else:
        _print(text)


def _print(text: str) -> None:
    with _writable():
        print(printable(text), flush=True)


class ReaderGoneError(Exception):
    """What reads stdout, such as `head`, wants no more of it."""


@contextmanager
def _writable() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the rest of the buffer goes nowhere
        if isinstance(error, BrokenPipeError):
            raise ReaderGoneError from None
        raise InputError(f"cannot write the output: {error.strerror}.") from None


def report(*files: Path | None, words: str = "") -> None:
    """Print the names of files that are written to stdout; where `words` tell of them, these to stderr instead."""
    names = [str(path) for path in files if path is not None]
    if _answer is not None:
        _answer.files += names
    if words:
        tell(words, kept=False)
    elif names and _answer is None:
        _print(f"written: {', '.join(names)}")


def tell(sentence: str, *, kept: bool = True) -> None:
    """Print one line to stderr; in JSON it is a warning, or says why a command failed, unless not `kept`."""
    line = brief(sentence)
    with suppress(OSError):  # a stderr that is full or closed does not change how a command ends
        print(line, file=sys.stderr, flush=True)
    if _answer is not None and kept:
        _answer.told.append(line)


def unsolved(name: str, status: "ReasonedStatus", why: str = "", more: Mapping[str, Any] | None = None) -> int:
    """Print that a computation came to this status, in other words where given, and return the exit code 1.

    In JSON there is `more` beside the status.
    """
    if _answer is not None:
        _answer.found |= {"status": status.name, "status_reason": status.reason, **(more or {})}
    tell(f"{name}: {why or f'{status.reason}.'}")
    return 1


_HINTS = {"--plot": " A page is written: a camera button above each of its plots saves that as a picture (.png)."}


def check_target(path: Path | None, option: str, suffixes: str | tuple[str, ...], force: bool = False) -> None:
    """Raise InputError where no file can be written at `path`, or where one exists and `force` is not given."""
    if path is None:
        return
    suffixes = (suffixes,) if isinstance(suffixes, str) else suffixes
    if path.suffix not in suffixes:
        *first, last = suffixes
        allowed = f"{', '.join(first)} or {last}" if first else last
        raise InputError(f'"{path}" does not end in {allowed}.{_HINTS.get(option, "")}', field=option)
    check_folder(path.parent, option, f".{path.name}.12345678")
    if is_folder(path):
        raise InputError(f"cannot write {path}: it is a folder.", field=option)
    if exists(path) and not is_file(path):
        raise InputError(f"cannot write {path}: it is not a file.", field=option)
    if is_taken(path) and not force:
        raise InputError(f"{path} exists. Give another name, or --force to overwrite it.", field=option)


def check_folder(folder: Path, option: str, name: str = ".nectosome") -> None:
    """Raise InputError where no file called `name` can be made in `folder`."""
    probe = folder / name
    try:
        probe.touch(exist_ok=False)
        probe.unlink()
    except (OSError, ValueError) as error:
        raise InputError(f"cannot write into {folder}: {reason(error)}.", field=option) from None
