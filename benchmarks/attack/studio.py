"""The studio: frames that are no messages, hostile values and uploads, from a page without a browser."""

import json
import random
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
from tests.cli.answers import contents, obeyed
from tests.small_robots import BALL
from tests.studio_page import Visitor
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed

from nectosome.studio.server import Studio

from .attempt import Attack, Outcome, changed, measured, streams
from .damage import ESCAPES, FOREIGN, LONG, MARKUP, TEXTS, damaged_bytes, damaged_text

_VALUES: tuple[Any, ...] = (
    *(float("nan"), float("inf"), -1e308, 2**63, -1, 0, None, True, "", [], {}, [[[]]], {"a": {}}, b"bytes", [1, 2, 3]),
    *(MARKUP + ESCAPES + LONG),
)
_NAMES = ("../../x.yaml", "/etc/passwd", "C:\\x.yaml", "con", "", ".", "a\0b.yaml", "x.exe", *MARKUP, *ESCAPES, *LONG)
_CAMERA = messages.ViewerCameraMessage((1, 0, 0, 0), (0, 0, 1), 1.0, 0.1, 10.0, 9, 16, (0, 0, 0), (0, 0, 1))
_MARKED = json.dumps("<script>parent.document.title=1</script>")


def studio(rng: random.Random, count: int) -> Iterator[Attack]:
    """Each attack has a tab of its own; a second one opens after it, as for the next visitor."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "ball.yaml").write_text(BALL)
        server = Studio(str(folder / "ball.yaml"), folder, "127.0.0.1", 18_800)
        try:
            with Visitor(server) as page:
                page.wait(lambda: any(tab.answer is not None for tab in server._sessions.values()), 300.0)
            for _ in range(count):
                about, frames = rng.choice((_frames, _messages, _values, _uploads))(random.Random(rng.random()))
                yield Attack(about, _attempt(server, folder, frames))
        finally:
            server.close()


Frames = Callable[[Any], list[messages.Message | bytes | str]]  # of a page's controls, by their names in messages


def _attempt(server: Studio, folder: Path, frames: Frames) -> Callable[[Path], Outcome]:
    def attempt(_: Path) -> Outcome:
        found, before = list[str](), contents(folder)
        with measured(found) as verdict, streams() as said:
            verdict.accepted = True  # both pages simulate a robot, whatever they send
            with suppress(ConnectionClosed), Visitor(server) as page:
                page.wait(lambda: server._sessions)
                controls = [*server._server.get_clients().values()]
                for frame in frames(controls[-1].gui._gui_input_handle_from_uuid if controls else {}):
                    page.send(frame)
                page.send(_CAMERA)
                with suppress(AssertionError):
                    page.wait(lambda: False, 0.2)
            with Visitor(server) as page:
                try:
                    page.wait(lambda: "GuiSliderMessage" in page.kinds, 30.0)
                except (AssertionError, ConnectionClosed):
                    found.append("the next page is not served")
            end = time.monotonic() + 10
            while server._sessions and time.monotonic() < end:
                time.sleep(0.01)
        found += ["a closed tab stays"] if server._sessions else []
        found += [f"says {text[-400:]!r}" for text in said if text.strip()]
        found += [f"a terminal would obey {orders}" for orders in [obeyed("".join(said))] if orders]
        return Outcome(False, found + changed(before, folder))

    return attempt


def _packed(message: messages.Message, **others: Any) -> bytes:
    """A message with other values of fields, also such that no page sends."""
    return msgspec.msgpack.encode(message.as_serializable_dict() | others)


def _frames(rng: random.Random) -> tuple[str, Frames]:
    """What is no message."""
    good = _packed(_CAMERA)
    frames: list[bytes | str] = [
        *(
            b"",
            "",
            "text",
            b"\xc1",
            b"\x91" * 20_000,
            b"\xdd\xff\xff\xff\xff",
            b"\xc6\xff\xff\xff\xffx",
            b"\xc7\x08\x05" + bytes(8),
        ),
        *(
            rng.randbytes(rng.choice((1, 30, 10_000))),
            damaged_bytes(good, rng)[1],
            damaged_bytes(good, rng)[1],
            bytes(2**20),
        ),
        *(
            msgspec.msgpack.encode(value)
            for value in ([], {}, 3, None, "x", {"type": 3}, {"type": "x" * 10_000}, [{"type": "x"}])
        ),
    ]
    frame = rng.choice(frames)
    return f"frame {frame[:20]!r}", lambda _: [frame]


def _messages(rng: random.Random) -> tuple[str, Frames]:
    """Messages with fields that are missing, of other types or unknown."""
    kinds = [
        _CAMERA,
        messages.GuiUpdateMessage("x", {"value": 1}),
        messages.FileTransferStartUpload("x", "t", "a.yaml", "", 1, 1),
        messages.FileTransferPart("x", "t", 0, b"x"),
    ]
    data = rng.choice(kinds).as_serializable_dict()
    key, how = rng.choice([*data]), rng.random()
    if how < 0.25:
        del data[key]
    elif how < 0.4:
        data[rng.choice(("__class__", "x" * 1000, "<b>"))] = 3
    else:
        data[key] = rng.choice(_VALUES)
    return f"message with {key} {str(data.get(key, 'missing'))[:30]!r}", lambda _: [msgspec.msgpack.encode(data)]


def _values(rng: random.Random) -> tuple[str, Frames]:
    """Every control of the page gets a hostile value, buttons none that presses them."""
    value, field = rng.choice(_VALUES), rng.choice(("value", "value", "disabled", "_markdown", "__class__", "x"))
    value = None if value is True else value

    def frames(controls: Any) -> list[messages.Message | bytes | str]:
        update, quiet = messages.GuiUpdateMessage("", {}), "Button"
        uuids = [uuid for uuid, one in controls.items() if quiet not in type(one).__name__]
        return [_packed(update, uuid=uuid, updates={field: value}) for uuid in uuids]

    return f"controls with {field} {str(value)[:30]!r}", frames


def _uploads(rng: random.Random) -> tuple[str, Frames]:
    """Hostile files, names, sizes and parts at every button that takes a file."""
    name = (
        rng.choice(_NAMES)
        if rng.random() < 0.5
        else f"a.{rng.choice(('yaml', 'csv', 'nc', 'mat', 'xlsx', 'npz', 'h5'))}"
    )
    marked = BALL.replace("name: ball", f"name: {_MARKED}").encode()
    content = rng.choice(
        (*FOREIGN, *(text.encode() for text in TEXTS), damaged_text(BALL, rng)[1], damaged_text(BALL, rng)[1], marked)
    )
    content = content[:200_000]
    size = rng.choice((len(content), len(content), len(content), len(content) + 100, -1, 0, 2**40, 3.5, "x"))
    parts = rng.choice((1, 1, 1, 0, -1, 10**9))

    def frames(controls: Any) -> list[messages.Message | bytes | str]:
        sent = list[messages.Message | bytes | str]()
        for k, (uuid, one) in enumerate(controls.items()):
            if "Upload" in type(one).__name__:
                announced = messages.FileTransferStartUpload(uuid, f"t{k}", name, "", 1, 1)
                sent.append(_packed(announced, part_count=parts, size_bytes=size))
                sent.append(messages.FileTransferPart(uuid, f"t{k}", 0, content))
        return sent

    return f"upload {name[:30]!r} of {size} in {parts}: {content[:20]!r}", frames
