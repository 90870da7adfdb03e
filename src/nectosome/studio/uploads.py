"""What pages send: files, with limits held before they are in memory and unpacked, and values of their controls.

viser announces a file (name, size, number of parts), then keeps its parts until all are there, and asks no one. Its two
handlers are replaced by ones that look first. A part itself, as any message, is at most 50 MiB: viser tells its
websocket so, which refuses a longer one by its head. Formats that compress can hide gigabytes in a few kilobytes.
"""

import asyncio
import math
import re
import struct
import tempfile
import unicodedata
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import accumulate
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO

import h5py
import numpy as np
import viser
from viser import _messages as messages

from nectosome.units import InputError, shorten

from .folder import is_device

UPLOAD_LIMIT = 64 * 1024 * 1024  # [bytes] of a file that a page sends, and of all that are on their way at once
UNPACKED_LIMIT = 1024 * 1024 * 1024  # [bytes]
_MAT_HEAD, _MAT_COMPRESSED = 128, 15  # [bytes] before the elements of a MATLAB file of version 5; a kind of them
_PIECE = 1024 * 1024  # [bytes] that are unpacked at a time
_SAID = (0.5, 2.0, 5.0, 15.0)  # s after a refusal: its reason
_SMALLEST_PART = 1024  # [bytes] on average; viser's page sends parts of 512 KiB


def limit_uploads(server: viser.ViserServer, gui: viser.GuiApi) -> None:
    """Let the files that are on their way have `UPLOAD_LIMIT` bytes together, those of all pages; `gui` is a page's."""
    start, keep = gui._handle_file_transfer_start, gui._handle_file_transfer_part
    transfers: dict[str, Any] = gui._current_file_upload_states  # those that are not complete

    def announced(client_id: Any, message: messages.FileTransferStartUpload) -> None:
        clients = server.get_clients()
        if message.source_component_uuid not in gui._gui_input_handle_from_uuid or client_id not in clients:
            # An announcement comes to the page's own controls and to those of all pages. Of a page that is not yet
            # among the clients viser would keep the parts for ever.
            return
        others = [server.gui, *(client.gui for client in clients.values())]
        under_way = sum(t["total_bytes"] for other in others for t in other._current_file_upload_states.values())
        fits = 0 <= message.size_bytes <= UPLOAD_LIMIT - under_way
        if fits and 0 <= message.part_count <= 1 + message.size_bytes // _SMALLEST_PART:
            start(client_id, message)
        else:
            _refuse(clients[client_id], message)

    def arrived(client_id: Any, message: messages.FileTransferPart) -> None:
        transfer = transfers.get(message.transfer_uuid)
        if transfer is None:
            return
        is_bytes = isinstance(message.content, bytes)  # viser takes what comes
        if is_bytes and transfer["transferred_bytes"] + len(message.content) <= transfer["total_bytes"]:
            keep(client_id, message)
        else:
            del transfers[message.transfer_uuid]

    interface = gui._websock_interface
    interface.unregister_handler(messages.FileTransferStartUpload, start)
    interface.unregister_handler(messages.FileTransferPart, keep)
    interface.register_handler(messages.FileTransferStartUpload, announced)
    interface.register_handler(messages.FileTransferPart, arrived)


def _refuse(client: viser.ClientHandle, message: messages.FileTransferStartUpload) -> None:
    """Say it in the page, where viser shows the upload, and let its button be used again."""
    connection = client._websock_connection
    # The page takes an upload for ended, and not for done, when it has more bytes than there are in all.
    connection.queue_message(messages.FileTransferPartAck(message.source_component_uuid, message.transfer_uuid, 0, -1))
    said = messages.NotificationUpdateMessage(
        uuid=f"upload-{message.transfer_uuid}",
        props=messages.NotificationProps(
            title="Not accepted",
            body=too_large(message.filename, message.size_bytes),
            loading=False,
            with_close_button=True,
            auto_close_seconds=None,
            color="red",
        ),
    )

    def say() -> None:
        if not connection.get_message_buffer().done:  # the page is still there
            connection.queue_message(said)

    # The page redraws its bar after the first message, and would redraw it over the second one; slow pages do it late.
    for later in _SAID:
        asyncio.get_running_loop().call_later(later, say)


@contextmanager
def received(name: str, content: bytes) -> Iterator[Path]:
    """Keep a file that a page sent, for as long as it is read, in a temporary folder of its own; yields its path.

    It goes by a harmless form of its own name, so that messages name it and readers see its suffix. It cannot be
    executed. Raises InputError where it is larger than `UPLOAD_LIMIT`, or becomes too large when it is unpacked.
    """
    if len(content) > UPLOAD_LIMIT:
        raise InputError(too_large(name, len(content)))
    with tempfile.TemporaryDirectory(prefix="nectosome-", ignore_cleanup_errors=True) as folder:
        path = Path(folder) / harmless(name)
        path.write_bytes(content)
        check_unpacked(path)
        yield path


def too_large(name: str, size: int) -> str:
    """Return what to say of a file of `size` bytes that is not accepted."""
    return (
        f'"{shorten(name)}" has {size / 2**20:.1f} MiB; at most {UPLOAD_LIMIT / 2**20:.0f} MiB are accepted at a time.'
    )


def harmless(name: str) -> str:
    """Return a file name that is good everywhere and as near to `name` as can be; what `name` has of folders is cut."""
    last = unicodedata.normalize("NFC", re.split(r"[/\\:]", name)[-1])
    plain = PurePosixPath("".join(c if c.isalnum() or c in "._- " else "_" for c in last).strip(". "))
    short = (plain.stem[:40] + plain.suffix[:12]).strip(". ")  # 4 bytes each at most, where 255 are allowed
    return f"_{short}" if not short or is_device(short) else short


def check_unpacked(path: Path) -> None:
    """Raise InputError where what is in a file is larger than `UNPACKED_LIMIT`; damaged ones are left to their readers.

    HDF5 (netCDF, MATLAB 7.3) and ZIP (Excel, .npz) say how large they are, which holds for reading them too; what
    MATLAB 5 has compressed is unpacked piece by piece, and kept nowhere.
    """
    with path.open("rb") as file:
        head = file.read(_MAT_HEAD)
    readers = {b"\x89HDF": _hdf5, b"PK": _zip, b"MATLAB 5": _matlab}
    sizes = next((read(path) for magic, read in readers.items() if head.startswith(magic)), ())
    with suppress(OSError, zipfile.BadZipFile, zlib.error, struct.error, RuntimeError):
        for total in accumulate(sizes):
            if total > UNPACKED_LIMIT:
                limit = f"{UNPACKED_LIMIT / 2**30:.0f} GiB"
                raise InputError(f"holds more than {limit} when it is unpacked: too much for the page.", file=path.name)


def _hdf5(path: Path) -> Iterator[int]:
    sizes: list[int] = []

    def add(_: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            sizes.append((node.size or 0) * node.dtype.itemsize)

    with h5py.File(path) as file:
        file.visititems(add)
    yield from sizes


def _zip(path: Path) -> Iterator[int]:
    with zipfile.ZipFile(path) as file:
        yield from (item.file_size for item in file.infolist())


def _matlab(path: Path) -> Iterator[int]:
    with path.open("rb") as file:
        order = ">" if file.read(_MAT_HEAD)[126:] == b"MI" else "<"
        while tag := file.read(8):
            kind, size = struct.unpack(order + "II", tag)
            if kind == _MAT_COMPRESSED:
                yield from _inflated(file, size)
            else:
                file.seek(size, 1)


def _inflated(file: BinaryIO, size: int) -> Iterator[int]:
    stream, left = zlib.decompressobj(), size
    while left > 0 and (packed := file.read(min(left, _PIECE))):
        left -= len(packed)
        while packed:
            yield len(stream.decompress(packed, _PIECE))
            packed = stream.unconsumed_tail


_NUMBERS = {"wxyz": 4, "position": 3, "look_at": 3, "up_direction": 3}
_SCALARS = ("fov", "near", "far", "image_height", "image_width")


def check_camera(message: messages.ViewerCameraMessage) -> None:
    """Raise ValueError or TypeError unless a camera is made of finite numbers."""
    for name, count in (*_NUMBERS.items(), *((name, None) for name in _SCALARS)):
        numbers = np.asarray(getattr(message, name))
        fits = numbers.dtype.kind in "if" and numbers.shape == (() if count is None else (count,))
        if not (fits and np.isfinite(numbers).all()):
            raise ValueError(f"{name} of a camera")


def limit_values(gui: viser.GuiApi, tell: Callable[[str, bool], None]) -> None:
    """Let controls be given finite numbers within their ranges and what is among their options.

    A number beyond its range is told and refused: the control keeps its value. A page would put it to the end of the
    range by itself as its field is left; then the field is given the value that was kept. Anything else is left alone.
    """
    take, interface = gui._handle_gui_updates, gui._websock_interface
    refused = dict[str, float]()  # by control: the end to which its page will put what was refused

    async def checked(client_id: Any, message: messages.GuiUpdateMessage) -> None:
        control: Any = gui._gui_input_handle_from_uuid.get(message.uuid)
        if control is None or [*message.updates] != ["value"] or not _possible(control, message.updates["value"]):
            return
        value = message.updates["value"]
        end, put = _within(control, value), refused.pop(message.uuid, None)
        if value != end:
            refused[message.uuid] = end
            tell(_refusal(control, value), True)
        elif value == put:
            interface.queue_message(messages.GuiUpdateMessage(message.uuid, {"value": control.value}))
        else:
            if put is not None:
                tell("", False)
            await take(client_id, message)

    interface.unregister_handler(messages.GuiUpdateMessage, take)
    interface.register_handler(messages.GuiUpdateMessage, checked)


def _possible(control: Any, value: Any) -> bool:
    """Whether a control may have a value, whatever its range."""
    if isinstance(control, viser.GuiDropdownHandle | viser.GuiButtonGroupHandle):
        return value in control.options
    if isinstance(control, _RANGED) and not isinstance(value, int | float):
        return False
    return not isinstance(value, float) or math.isfinite(value)


_RANGED = viser.GuiSliderHandle | viser.GuiNumberHandle


def _within(control: Any, value: Any) -> Any:
    """The value that is nearest to one in the range of a control; the value itself where that has none."""
    if not isinstance(control, _RANGED):
        return value
    low, high = _ends(control)
    return min(max(value, low), high)


def _ends(control: Any) -> tuple[float, float]:
    return (-math.inf if control.min is None else control.min, math.inf if control.max is None else control.max)


def _refusal(control: Any, value: float) -> str:
    """What is said of a number beyond the range of its control, whose label may end with a unit."""
    name, _, unit = control.label.removesuffix(")").partition(" (")
    (low, high), unit = _ends(control), f" {unit}" if unit else ""
    allowed = f"from {low:g} to {high:g}" if math.isfinite(high) else f"{low:g} or more"
    return f"{name}: {value:g}{unit} is refused, {allowed}{unit} is allowed; {control.value:g}{unit} stays."
