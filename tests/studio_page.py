"""What tests of the studio in a real browser share."""

import multiprocessing
import os
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

CHROMIUM = (
    os.environ.get("CHROMIUM")
    or shutil.which("chromium")
    or shutil.which("chromium-browser")
    or shutil.which("google-chrome")
)
FLAGS = ("--no-sandbox", "--enable-unsafe-swiftshader")
PATIENCE = 120_000  # ms
NEEDS_CHROMIUM = pytest.mark.skipif(
    CHROMIUM is None, reason="needs a Chromium: name it in CHROMIUM, or put it on the path"
)


@contextmanager
def chromium() -> Iterator[Any]:
    """A browser without a window, no quicker than a person: of changes within 50 ms viser sends the last one only."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as p:
        made = p.chromium.launch(executable_path=CHROMIUM, args=FLAGS, slow_mo=80)
        yield made
        made.close()


def count(page) -> int:
    return int(page.get_attribute("#studio-answer", "data-count"))


def answered(page, n: int) -> None:
    page.wait_for_function(f"+(document.querySelector('#studio-answer')?.dataset.count ?? 0) >= {n}")


def said(page, words: str) -> None:
    page.wait_for_function(f"document.querySelector('#studio-words')?.innerText.includes({words!r})")


def beside(page, label: str):
    """The field with a label."""
    return page.locator(f"input:visible:right-of(:text-is('{label}'))").first


def nothing_left() -> bool:
    """Whether work and its processes end, by themselves, within a minute."""
    until = time.monotonic() + 60
    while time.monotonic() < until:
        if not multiprocessing.active_children() and not any(t.name == "studio-work" for t in threading.enumerate()):
            return True
        time.sleep(0.1)
    return False
