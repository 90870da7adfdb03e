"""Long work of a tab, one piece at a time, on this machine or a cluster, and a thread for the newest request only."""

import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import viser

from nectosome.io.work_clock import WorkClock
from nectosome.search import LostError, cluster
from nectosome.units import InputError
from nectosome.view.markup import plain
from nectosome.view.style import GREY

_T = TypeVar("_T")
Progress = Callable[[str, float], bool]  # takes what is done, and its share that is done; False where it shall end
Tell = Callable[[str, bool], None]  # takes words to say on the page, and whether they are bad news
_THREAD = "studio-work"
_DOUBLE = 1.0  # s, within which a button that is pressed again was clicked twice
_PATIENCE = 10.0  # s wait for a first worker, in which work cannot be cancelled
_PULSE = 1.0  # s between lines, where nothing new is done
STOP = "Stop, keep the best so far"  # the button of work that has one


def start_thread(name: str, run: Callable[..., None], *args: Any) -> None:
    """Start a thread that the interpreter waits for at its end.

    A thread is a daemon where the one that makes it is, as those of viser are; and one that is killed while it
    compiles aborts the process.
    """
    threading.Thread(target=run, args=args, name=name, daemon=False).start()


@contextmanager
def unless_ending() -> Iterator[None]:
    """Drop an error that comes of the interpreter's end: Python begins no work any more, and nobody is there to see."""
    try:
        yield
    except RuntimeError as error:
        if "cannot schedule new futures" not in str(error):
            raise


@contextmanager
def errors_shown(tell: Tell) -> Iterator[None]:
    """Show errors on the page: bad input with its reason; of failures of the studio the traceback is in the terminal.

    Files are called by their names alone: the page shows no other folder than its own.
    """
    try:
        with unless_ending():
            yield
    except InputError as error:
        file = error.file and Path(error.file).name
        tell(str(InputError(error.message, file=file, line=error.line, field=error.field)), True)
    except LostError as error:
        tell(str(error), True)
    except Exception:  # here a thread ends: no error may be lost, of whatever kind
        traceback.print_exc()
        tell("The studio has failed: see the error in its terminal.", True)


@contextmanager
def labelled(labels: Mapping[str, str]) -> Iterator[None]:
    """Name bad input by the label of its field on the page; `labels` by the first word of its name."""
    try:
        yield
    except InputError as error:
        first = (error.field or "").split(" ")[0]
        if first not in labels:
            raise
        raise InputError(error.message, file=error.file, line=error.line, field=labels[first]) from None


class Work:
    """Lays out a bar, a line and a button, which are shown while work is under way."""

    def __init__(self, gui: viser.GuiApi, tell: Tell):
        self._tell = tell
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._line = gui.add_html("", visible=False)
        self._button = gui.add_button("Cancel", visible=False)
        self._button.on_click(lambda _: self.cancel())
        self._end = threading.Event()  # of the work under way
        self._clock = WorkClock("")
        self._lock = threading.Lock()
        self._name, self._what, self._began = "", "", 0.0
        self._refused = False  # whether other work was refused meanwhile

    def begin(
        self,
        name: str,
        compute: Callable[[Progress], _T],
        done: Callable[[_T], None],
        cancelled: str = "",
        button: str = "Cancel",
    ) -> None:
        """Call done(compute(progress)) in a thread of its own. Raises InputError while something else is under way.

        The same again within a second is a double click: nothing is done.
        `compute` has to end soon once `progress` returns False: with the result so far, which is used all the same, or
        by CancelledError, for which `cancelled` is shown. The reason of another exception is shown. The message of a
        refusal is shown until the end. The `button` that makes it end is called so.
        """
        with self._lock:
            twice = self._name == name and time.perf_counter() - self._began < _DOUBLE
            if twice and not self._end.is_set():
                return
            if self._name:
                self._refused = True
                how = "still ending" if self._end.is_set() else "under way. Wait for its end, or cancel it"
                raise InputError(f"{self._name} is {how}.")
            self._name, self._began, self._end = name, time.perf_counter(), threading.Event()
            self._refused, self._clock, self._what = False, WorkClock(name), ""
        self._button.label = button
        self._show("", 0.0)
        self._tell("", False)  # an older message is of no interest now
        start_thread(_THREAD, self._run, compute, done, cancelled, self._end)

    def cancel(self) -> None:
        """Make the work under way end."""
        self._end.set()
        if self._name:
            self._write("ending")

    def close(self) -> None:
        """As cancel, for a tab that is closed."""
        self._end.set()

    def _run(
        self, compute: Callable[[Progress], _T], done: Callable[[_T], None], cancelled: str, end: threading.Event
    ) -> None:
        def progress(what: str, share: float) -> bool:
            if not end.is_set():
                self._show(what, share)
            return not end.is_set()

        with errors_shown(self._tell):
            try:
                with self._shown_meanwhile():
                    value = compute(progress)
            except CancelledError:
                self._tell(cancelled, False)
            else:
                done(value)

    @contextmanager
    def _shown_meanwhile(self) -> Iterator[None]:
        """Let the time go on in the line; hide bar, line and button at the end, and a message of a refusal."""
        ended = threading.Event()

        def count() -> None:
            while not ended.wait(_PULSE):
                self._write("ending" if self._end.is_set() else self._what)

        threading.Thread(target=count, name="studio-counting", daemon=True).start()
        try:
            yield
        finally:
            ended.set()
            with self._lock:
                for handle in (self._bar, self._line, self._button):
                    handle.visible = False
                self._name = ""
            if self._refused:
                self._tell("", False)

    def _show(self, what: str, share: float) -> None:
        self._what = what
        self._clock.update(what, share)
        self._bar.value = 100 * min(max(share, 0.0), 1.0)
        self._write(what)
        for handle in (self._bar, self._line, self._button):
            handle.visible = True

    def _write(self, what: str) -> None:
        """What is done, for how long it has been, and how long it is to take."""
        words = plain(f"{self._name}: {what}" if what else self._name)
        times = "" if self._end.is_set() else f'<div style="color:{GREY}">{self._clock.times}</div>'
        style = "font-size:13px;padding:0 12px;overflow-wrap:anywhere"
        self._line.content = f'<div style="{style}" id="studio-work">{words}{times}</div>'


class SolverThread:
    """One thread that calls `work(request)` with the newest request, and again whenever there is a newer one."""

    def __init__(self, work: Callable[[Any], None]):
        self._work, self._request, self._closed = work, None, False
        self._news = threading.Condition()
        start_thread("studio-solver", self._run)

    def submit(self, request: Any) -> None:
        """Put a request, which is not None, in place of the one that waits."""
        with self._news:
            self._request = request
            self._news.notify()

    def close(self) -> None:
        """Begin nothing more."""
        with self._news:
            self._closed = True
            self._news.notify()

    def _run(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._closed or self._request is not None)
                if self._closed:
                    return
                request, self._request = self._request, None
            self._work(request)


def wait_for_work(seconds: float) -> None:
    """Wait at most so long until the work ends: until then its files and processes exist."""
    until = time.perf_counter() + seconds
    for thread in threading.enumerate():
        if thread.name == _THREAD:
            thread.join(max(0.0, until - time.perf_counter()))


class Machines:
    """Those of one tab; `address` is of a cluster, see `nectosome.search.cluster`, None for this machine."""

    def __init__(self, address: str | None):
        self._address = address
        self._lock = threading.Lock()
        self._kept: tuple[str, TemporaryDirectory[str]] | None = None  # what was computed of a request
        self._closed = False

    def named(self, work: str) -> str:
        """What work is called on the page while it is computed here."""
        return work if self._address is None else f"{work} on the cluster"

    @contextmanager
    def executor(self) -> Iterator[Executor | None]:
        """Yield an executor of the cluster, which is looked for anew each time; None for this machine.

        Raises InputError where no cluster answers.
        """
        if self._address is None:
            yield None
            return
        with cluster(self._address, wait=_PATIENCE) as executor:
            yield executor

    @contextmanager
    def kept(self, request: str) -> Iterator[Path]:
        """Yield a folder for what is computed of a request; the last one where that was the same, and failed."""
        with self._lock:
            before, self._kept = self._kept, None
        if before is not None and before[0] != request:
            before[1].cleanup()
            before = None
        folder = TemporaryDirectory(prefix="nectosome-") if before is None else before[1]
        try:
            yield Path(folder.name)
        except BaseException as error:
            with self._lock:
                if not self._closed:
                    self._kept, folder = (request, folder), None
            if isinstance(error, LostError):
                why = str(error) if self._address else "a worker process died, perhaps for want of memory."
                raise LostError(f"{why} Begin it again: it goes on from what was computed.") from None
            raise
        finally:
            if folder is not None:
                folder.cleanup()

    def close(self) -> None:
        """Remove what is kept, for a tab that is closed."""
        with self._lock:
            kept, self._kept, self._closed = self._kept, None, True
        if kept is not None:
            kept[1].cleanup()
