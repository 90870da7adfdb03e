"""What is being computed, for how long, and the time left, on stderr; and Ctrl-C."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Column

from nectosome.cli.output import tell
from nectosome.io.work_clock import WorkClock

_DELAY = 2.0  # s, before a progress bar appears
_LINE = 60.0  # s, between lines where stderr is no terminal
_BAR, _TIMES = 16, 30  # characters


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[str, float], None]]:
    """Yield update(what, share done) of work that `label` names.

    On a terminal a bar appears after two seconds, and goes when the work is done; else stderr has a line a minute.
    """
    work, done = WorkClock(label), threading.Event()
    console = Console(stderr=True)
    show = _draw if console.is_terminal else _write_lines
    thread = threading.Thread(target=show, args=(work, console, done), daemon=True)
    thread.start()
    try:
        yield work.update
    finally:
        done.set()
        thread.join()


def _draw(work: WorkClock, console: Console, done: threading.Event) -> None:
    """A bar that moves to and fro until a share is known."""
    if done.wait(_DELAY):
        return
    room = Column(no_wrap=True, overflow="ellipsis", max_width=max(console.width - _BAR - _TIMES, 10))
    words = TextColumn("{task.description}", markup=False, table_column=room)
    times = TextColumn("{task.fields[times]}", markup=False, table_column=Column(no_wrap=True))
    with Progress(words, BarColumn(_BAR), times, console=console, transient=True) as bar:
        task = bar.add_task(work.label, total=None, times="")
        while not done.wait(0.2):
            total = 1.0 if work.share > 0 else None
            bar.update(task, total=total, completed=work.share, description=work.words, times=work.times)


def _write_lines(work: WorkClock, console: Console, done: threading.Event) -> None:
    while not done.wait(_LINE):
        share = f"{100 * work.share:.0f} %, " if work.share > 0 else ""
        tell(f"{work.words} ({share}{work.times})", kept=False)


def cancellable(compute: Callable[[Callable[[str, float], bool]], Any], update: Callable[[str, float], None]) -> Any:
    """Return compute(progress), where progress(task, share done) updates the bar and returns whether to go on.

    The first Ctrl-C, or request to end (SIGTERM), makes it False, the second ends the program at once.
    """
    stop = threading.Event()

    def interrupted(*_: object) -> None:  # an exception may be raised in a callback of JAX, which swallows it
        if stop.is_set():
            os._exit(130)
        stop.set()
        tell("stopping; Ctrl-C again stops at once.")

    def progress(what: str, share: float) -> bool:
        update(what, share)
        return not stop.is_set()

    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
    heard = {
        one: handler for one, handler in usual.items() if signal.getsignal(one) is handler
    }  # not in the background
    for one in heard:
        signal.signal(one, interrupted)
    try:
        with ThreadPoolExecutor(1) as pool:  # a thread, since compiled code does not listen to Ctrl-C
            return pool.submit(compute, progress).result()
    finally:
        for one, handler in heard.items():
            signal.signal(one, handler)
