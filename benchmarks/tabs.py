"""The studio over a day: memory of its process while tabs are opened, a slider is moved in each, and they are closed.

Tabs are websockets as viser's page opens them, without a browser. The first ones compile and warm up and do not count.
Fails where it ends more than 20 MB above where it began: `python -m benchmarks.tabs [tabs]`, 500 without a number.
"""

import gc
import sys
import tempfile
import time
from pathlib import Path

from tests.studio.test_page import ARM
from tests.studio_page import Visitor
from viser import _messages as messages

from nectosome.core.memory import resident
from nectosome.studio.server import Studio

TABS, WARM, MOVES, MOST = 500, 60, 5, 20.0  # tabs, before these, moves in each, MB


def main() -> None:
    """Print the memory every tenth of the way."""
    tabs = int(sys.argv[1]) if len(sys.argv) > 1 else TABS
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "arm.yaml").write_text(ARM)
        studio = Studio(str(Path(folder) / "arm.yaml"), Path(folder), "127.0.0.1", 18_700)
        try:
            sys.exit(grown(studio, tabs) > MOST)
        finally:
            studio.close()


def grown(studio: Studio, tabs: int) -> float:
    """Memory [MB] that `tabs` tabs left."""
    for _ in range(WARM):
        visit(studio)
    start, began = resident() / 2**20, time.perf_counter()
    print(f"{WARM} tabs to warm up: {start:.1f} MB, {len(gc.get_objects())} objects", flush=True)
    for k in range(1, tabs + 1):
        visit(studio)
        if k % max(tabs // 10, 1) == 0:
            spent, now = time.perf_counter() - began, resident() / 2**20
            print(f"{k:5d} tabs, {k * MOVES} moves, {spent:.0f} s: {now - start:+.1f} MB", flush=True)
    return resident() / 2**20 - start


def visit(studio: Studio) -> None:
    """Open a tab, wait for its answer, move its slider, close it."""
    with Visitor(studio) as page:
        page.wait(lambda: any(tab.answer is not None for tab in studio._sessions.values()), 300.0)
        (tab,) = studio._sessions.values()
        for k in range(MOVES):
            slider, shown = tab._sliders[1], tab.answer
            value = slider.min + (0.3 + 0.1 * k) * (slider.max - slider.min)
            page.send(messages.GuiUpdateMessage(slider._impl.uuid, {"value": value}))
            page.wait(lambda shown=shown: tab.answer is not shown, 300.0)
    while studio._sessions:
        time.sleep(0.01)


if __name__ == "__main__":
    main()
