"""Long computations: a progress bar on stderr, and cancellation by Ctrl-C."""

import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from nectosome.cli.output import tell

_DELAY = 2.0  # s, before a bar appears


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[str, float], None]]:
    """Yield update(task, share done); the bar appears after two seconds, and only on a terminal."""
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
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


def cancellable(compute: Callable[[Callable[[], bool]], Any]) -> Any:
    """Return compute(going_on); the first Ctrl-C makes going_on() False, the second ends the program at once."""
    stop = threading.Event()
    with ThreadPoolExecutor(1) as pool:  # a thread, since compiled code does not listen to Ctrl-C
        future = pool.submit(compute, lambda: not stop.is_set())
        while True:
            try:
                return future.result()
            except KeyboardInterrupt:
                if stop.is_set():
                    os._exit(130)
                stop.set()
                tell("stopping; Ctrl-C again stops at once.")
