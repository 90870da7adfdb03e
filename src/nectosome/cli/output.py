"""What commands print and write: results to stdout, sentences and progress to stderr, files that the user asks for."""

import json
import os
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from nectosome.io.results import SUFFIXES, provenance, save_dataset
from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray as xr

_WIDTH = 120  # of what goes to a file or a pipe
_DELAY = 2.0  # s, before a progress bar appears

Save = Annotated[Path | None, Parameter("--save", help="Write the data to this file (.nc or .csv).")]
Plot = Annotated[Path | None, Parameter("--plot", help="Write a page with figures to this file (.html).")]
Force = Annotated[bool, Parameter("--force", help="Overwrite files that exist.")]


@Parameter(name="*")
@dataclass(frozen=True)
class Outputs:
    """Data and page that a command writes on request: `--save`, `--plot` and `--force`."""

    save: Save = None
    plot: Plot = None
    force: Force = False

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


def write(*things: RenderableType, wrap: bool = True) -> None:
    """Print to stdout. Raises InputError where it cannot take any more."""
    width = None if sys.stdout.isatty() else _WIDTH
    console = Console(file=sys.stdout, width=width, markup=False, emoji=False, highlight=False, soft_wrap=not wrap)
    try:
        for thing in things:
            console.print(thing)
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the rest of the buffer goes nowhere
        raise InputError(f"cannot write the output: {error.strerror}.") from None


def report(*files: Path | None) -> None:
    """Print the names of files that are written."""
    names = [str(path) for path in files if path is not None]
    if names:
        write(f"written: {', '.join(names)}", wrap=False)


def tell(sentence: str) -> None:
    """Print one line to stderr."""
    line = "".join(c if c.isprintable() else " " for c in " ".join(sentence.split()))
    print(line, file=sys.stderr, flush=True)


class _Compiling(ProgressColumn):
    """Says so while a first answer waits for the compiler."""

    max_refresh = None

    def render(self, task: Task) -> Text:
        remember = sys.modules.get("nectosome.core.remember")  # not loaded for this: JAX takes a second
        return Text("compiling equations" if remember and remember.compiling else "")


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[str, float], None]]:
    """Yield update(task, share done); the bar appears after two seconds, and only on a terminal."""
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        _Compiling(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    task = bar.add_task(label, total=None)  # pulses until a share is known

    def update(what: str, share: float) -> None:
        bar.update(task, total=1.0, completed=share, description=f"{label}: {what}" if what else label)

    timer = threading.Timer(_DELAY, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield update
    finally:
        timer.cancel()
        timer.join()
        bar.stop()


def cancellable(compute: Callable[[Callable[[str, float], bool]], Any], update: Callable[[str, float], None]) -> Any:
    """Return compute(progress), where progress(task, share done) updates the bar and returns whether to go on.

    The first Ctrl-C makes it False, the second ends the program at once.
    """
    stop = threading.Event()

    def progress(what: str, share: float) -> bool:
        update(what, share)
        return not stop.is_set()

    with ThreadPoolExecutor(1) as pool:  # a thread, since compiled code does not listen to Ctrl-C
        future = pool.submit(compute, progress)
        while True:
            try:
                return future.result()
            except KeyboardInterrupt:
                if stop.is_set():
                    os._exit(130)
                stop.set()
                tell("stopping; Ctrl-C again stops at once.")


def check_target(path: Path | None, option: str, suffixes: str | tuple[str, ...], force: bool = False) -> None:
    """Raise InputError where no file can be written at `path`, or where one exists and `force` is not given."""
    if path is None:
        return
    suffixes = (suffixes,) if isinstance(suffixes, str) else suffixes
    if path.suffix not in suffixes:
        *first, last = suffixes
        allowed = f"{', '.join(first)} or {last}" if first else last
        raise InputError(f'"{path}" does not end in {allowed}.', field=option)
    check_folder(path.parent, option, f".{path.name}.12345678")
    if path.is_dir():
        raise InputError(f"cannot write {path}: it is a folder.", field=option)
    if path.exists() and not path.is_file():
        raise InputError(f"cannot write {path}: it is not a file.", field=option)
    if (path.exists() or path.is_symlink()) and not force:
        raise InputError(f"{path} exists. Give another name, or --force to overwrite it.", field=option)


def check_folder(folder: Path, option: str, name: str = ".nectosome") -> None:
    """Raise InputError where no file called `name` can be made in `folder`."""
    probe = folder / name
    try:
        probe.touch(exist_ok=False)
        probe.unlink()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"cannot write into {folder}: {why}.", field=option) from None
