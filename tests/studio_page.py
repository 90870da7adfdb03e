"""What tests of the studio in a real browser share."""

import multiprocessing
import os
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import msgspec
import pytest
import viser
import zstandard
from viser import _messages as messages
from websockets.sync.client import connect
from websockets.typing import Subprotocol

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


class Visitor:
    """A tab of a studio without a browser: a websocket as viser's page opens it, which keeps what it is sent."""

    def __init__(self, studio: Any):
        where = studio.address.rstrip("/").removeprefix("http://")
        self.kinds, self.text = set[str](), ""  # of messages; all that was shown as HTML or markdown
        self._controls: dict[str, dict[str, Any]] = {}  # what is on the page, by its number
        self._socket = connect(
            f"ws://{where}",
            additional_headers={"Origin": f"http://{where}"},
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            max_size=None,
            proxy=None,
        )
        self.send(messages.ViewerCameraMessage((1, 0, 0, 0), (0, 0, 1), 1.0, 0.1, 10.0, 9, 16, (0, 0, 0), (0, 0, 1)))

    def __enter__(self) -> "Visitor":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self, message: messages.Message | bytes | str) -> None:
        """Send a message, or a frame as it is."""
        if isinstance(message, messages.Message):
            message = msgspec.msgpack.encode(message.as_serializable_dict())
        self._socket.send(message)

    def control(self, label: str) -> dict[str, Any]:
        """The newest control of a label, as viser's message says it."""
        return [one for one in self._controls.values() if one["props"].get("label") == label][-1]

    def press(self, label: str) -> None:
        """Press a button."""
        self.write(label, True)

    def write(self, label: str, value: Any) -> None:
        """Give a control a value."""
        self.send(messages.GuiUpdateMessage(self.control(label)["uuid"], {"value": value}))

    def trigger(self, label: str) -> None:
        """Use a command, as its key does."""
        self.send(messages.CommandTriggerMessage(self.control(label)["uuid"]))

    def wait(self, condition: Any, seconds: float = 40.0) -> None:
        """Take what is sent until a condition holds."""
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end
            with suppress(TimeoutError):
                self._take(self._socket.recv(timeout=0.1))

    def _take(self, frame: Any) -> None:
        packed = frame[16 : 16 + int.from_bytes(frame[8:16], "little")]
        for message in msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(packed))["messages"]:
            self.kinds.add(message["type"])
            if "props" in message and "uuid" in message:
                self._controls[message["uuid"]] = message
            elif message["type"] in ("GuiUpdateMessage", "CommandUpdateMessage") and message["uuid"] in self._controls:
                self._controls[message["uuid"]]["props"] |= message["updates"]
            elif message["type"] == "GuiRemoveMessage":
                self._controls.pop(message["uuid"], None)
            shown = message.get("props") or message.get("updates") or {}
            self.text += "".join(str(shown.get(name, "")) for name in ("content", "_markdown"))


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


def wait_until(page, expression: str) -> None:
    """Wait until an expression is true on the page; playwright's own way evaluates text there, which is forbidden."""
    end = time.monotonic() + PATIENCE / 1000
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(50)


def answered(page, n: int) -> None:
    wait_until(page, f"+(document.querySelector('#studio-answer')?.dataset.count ?? 0) >= {n}")


def said(page, words: str) -> None:
    wait_until(page, f"document.querySelector('#studio-words')?.innerText.includes({words!r})")


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
