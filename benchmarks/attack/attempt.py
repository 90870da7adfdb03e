"""One attack: what is given to a command line within this process, and what is wrong with its answer."""

import contextlib
import os
import re
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from tests.cli.answers import contents, faults, obeyed

from nectosome.cli import main
from nectosome.units import InputError, brief, shorten

SECONDS = {False: 3.0, True: 10.0}  # of a processor, that refused and accepted input may take
MEGABYTES = 300.0  # of memory above that of before
_HANGS = 120  # s of wall time until an attack is stopped, on a machine as busy as may be
_LONGEST, _WARNINGS = 1000, 20  # characters of a line, and lines of warnings


class Outcome(NamedTuple):
    """What came of an attack."""

    accepted: bool  # the input was good all the same
    faults: list[str]  # none where it was survived


class Attack(NamedTuple):
    """What is wrong, in words, and the attempt: it gets an empty folder, which is the current one."""

    about: str
    attempt: Callable[[Path], Outcome]


class _HangsError(BaseException):
    """Not an Exception, so that nothing on the way takes it for its own."""


def commanded(
    argv: tuple[str, ...],
    files: Mapping[str, bytes],
    named: tuple[str, ...],
    read: Callable[[], object] | None = None,
    makes: tuple[str, ...] = (),
) -> Callable[[Path], Outcome]:
    """A command line, with these files in its folder, whose message has one of `named`.

    Where a good file would be computed with, `read` reads it, and the command is given only what that refuses. What is
    good may write the files that it `makes`.
    """

    def attempt(folder: Path) -> Outcome:
        for name, content in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        before = contents(folder)
        found, accepted = list[str](), False
        with measured(found) as verdict:
            accepted = verdict.accepted = read is not None and _reads(read, found)
        if not accepted and not found:
            accepted = told(argv, named, found)
        if accepted:
            for name in makes:
                (folder / name).unlink(missing_ok=True)
        return Outcome(accepted, found + changed(before, folder))

    return attempt


def warm_up(good: Iterable[Callable[[Path], Outcome]]) -> None:
    """See that good input is accepted, which also loads and compiles what attacks are not to be charged with."""
    for attempt in good:
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            outcome = attempt(Path(folder))
            if not outcome.accepted:
                raise AssertionError(f"Good input is refused: {outcome.faults}")


def _reads(read: Callable[[], object], found: list[str]) -> bool:
    try:
        read()
    except InputError:
        return False
    except Exception:
        found.append(f"raised\n{traceback.format_exc()}")
        return False
    return True


def told(argv: tuple[str, ...], named: tuple[str, ...], found: list[str]) -> bool:
    """Run a command line within this process, add what is wrong with its answer to `found`; whether it was accepted."""
    code = -1
    with measured(found) as verdict, streams() as said:
        try:
            code = main([*argv])
        except (Exception, SystemExit):
            found.append(f"raised\n{traceback.format_exc()}")
        verdict.accepted = code == 0
    out, err = said
    found += judged(code, out, err, named)
    return code == 0


def judged(code: int, out: str, err: str, named: tuple[str, ...]) -> list[str]:
    """What is wrong with an answer."""
    lines = err.splitlines()
    if code:
        found = faults(code, err) + (["prints to stdout"] if out and not out.startswith("{") else [])
        known = {short for name in named for short in (name, brief(name)[:150], brief(f'"{shorten(name)}"'))} - {""}
        found += [] if any(name in err for name in known) else [f"names none of {[name[:60] for name in named]}"]
    else:
        found = ["says Traceback"] if "Traceback" in err else []
        found += [f"{len(lines)} warnings"] if len(lines) > _WARNINGS else []
    found += [f"a line of {len(line)} characters" for line in lines if len(line) > _LONGEST]
    if orders := obeyed(out + err):
        found.append(f"a terminal would obey {orders}")
    return [f"{one}: {err[:400]!r}" for one in found]


def changed(before: list[tuple[str, int]], folder: Path) -> list[str]:
    """What is new, changed or gone in a folder."""
    differ = {*before} ^ {*contents(folder)}
    return [f"changes {sorted(differ)[:4]}"] if differ else []


@dataclass
class _Verdict:
    accepted: bool = False


@contextlib.contextmanager
def measured(found: list[str]) -> Iterator[_Verdict]:
    """Add to `found` what takes too much time or memory; it is stopped where it does not end."""

    def stop(*_: object) -> None:
        raise _HangsError

    verdict = _Verdict()
    before, began, start = signal.signal(signal.SIGALRM, stop), time.process_time(), peak(reset=True)
    signal.alarm(_HANGS)
    try:
        yield verdict
    except _HangsError:
        found.append(f"does not end within {_HANGS} s\n{traceback.format_exc()}")
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    seconds, megabytes = time.process_time() - began, peak() - start
    if seconds > SECONDS[verdict.accepted]:
        found.append(f"takes {seconds:.1f} s")
    if megabytes > MEGABYTES:
        found.append(f"takes {megabytes:.0f} MB")


def peak(*, reset: bool = False) -> float:
    """Largest memory of this process [MB] since it was reset (Linux; 0 elsewhere)."""
    status, clear = Path("/proc/self/status"), Path("/proc/self/clear_refs")
    if not status.exists():
        return 0.0
    if reset:
        clear.write_text("5")
    found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text())
    return int(found[1]) / 1024 if found else 0.0


@contextlib.contextmanager
def streams() -> Iterator[list[str]]:
    """Catch what is said on stdout and stderr, by libraries in C too; warnings are told as those of a command are."""
    said = list[str]()
    with contextlib.ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.showwarning = lambda message, *_, **__: print(brief(str(message)), file=sys.stderr)
        sys.stdout.flush(), sys.stderr.flush()
        files = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(2)]
        kept = [os.dup(number) for number in (1, 2)]
        before = sys.stdout, sys.stderr
        for number, file in zip((1, 2), files, strict=True):
            os.dup2(file.fileno(), number)
        sys.stdout, sys.stderr = (
            stack.enter_context(open(number, "w", encoding="utf-8", errors="backslashreplace", closefd=False))
            for number in (1, 2)
        )
        try:
            yield said
        finally:
            sys.stdout.flush(), sys.stderr.flush()
            sys.stdout, sys.stderr = before
            for number, old in zip((1, 2), kept, strict=True):
                os.dup2(old, number)
                os.close(old)
            for file in files:
                file.seek(0)
                said.append(file.read().decode("utf-8", "replace"))
