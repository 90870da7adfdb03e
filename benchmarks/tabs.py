"""The studio over a day: memory of its process while tabs are opened, a slider is moved in each, and they are closed.

Tabs are websockets as viser's page opens them, without a browser. The first 50 compile the robot's equations, once more
for speed when they ran often, and do not count. Then come `tabs`, one after the other, and a last one in which a slider
is moved `moves` times, each time when the last is answered: an hour of one a second. Memory is what the process has of
the machine's after a tab has closed. Fails where it ends more than 20 MB above where it began, after those first 50:
`python -m benchmarks.tabs [tabs] [moves]`, 500 and 3600 without numbers.
"""

import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import jax
from tests.studio.test_page import ARM
from tests.studio_page import Visitor
from viser import _messages as messages

from nectosome.core.programs.remember import resident
from nectosome.studio.server import Studio, _forget_closed_tabs

TABS, MOVES, WARM, MOST = 500, 3600, 50, 20.0  # tabs, moves in the last, tabs before, MB
PATIENCE = 300.0  # s for an answer


def main() -> None:
    """Print the memory every tenth of the way."""
    tabs, moves = (int(sys.argv[k]) if len(sys.argv) > k else usual for k, usual in ((1, TABS), (2, MOVES)))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "arm.yaml").write_text(ARM)
        studio = Studio(str(Path(folder) / "arm.yaml"), Path(folder), "127.0.0.1", 18_700)
        try:
            sys.exit(grown(studio, tabs, moves) > MOST)
        finally:
            studio.close()


def grown(studio: Studio, tabs: int, moves: int) -> float:
    """Memory [MB] that `tabs` tabs and `moves` moves left."""
    start, began = 0.0, time.perf_counter()

    def told(what: str) -> float:
        _forget_closed_tabs()  # as each that closes does; its last threads may have ended since
        now = resident() / 2**20 - start
        counts = f"{threading.active_count()} threads, {len(jax.live_arrays())} arrays"
        print(f"{what:>10}, {time.perf_counter() - began:5.0f} s: {now:+7.1f} MB, {counts}", flush=True)
        return now

    for _ in range(WARM):
        visit(studio)
    start = told(f"{WARM} first")
    for k in range(1, tabs + 1):
        visit(studio)
        if k % max(tabs // 10, 1) == 0:
            told(f"{k} tabs")
    visit(studio, moves, told)
    return told("closed")


def visit(studio: Studio, moves: int = 1, told: Callable[[str], object] = lambda _: None) -> None:
    """Open a tab, wait for its answer, move its slider, close it; tells of every tenth of the moves."""
    with Visitor(studio) as page:
        page.wait(lambda: any(tab.answer is not None for tab in studio._sessions.values()), PATIENCE)
        (tab,) = studio._sessions.values()
        slider = tab._sliders[1]
        for k in range(1, moves + 1):
            shown, page.text = tab.answer, ""
            value = slider.min + (0.3 + 0.1 * (k % 5)) * (slider.max - slider.min)
            page.send(messages.GuiUpdateMessage(slider._impl.uuid, {"value": value}))
            page.wait(lambda shown=shown: tab.answer is not shown, PATIENCE)
            if k % max(moves // 10, 1) == 0:
                told(f"{k} moves")
    while studio._sessions:
        time.sleep(0.01)


if __name__ == "__main__":
    main()
