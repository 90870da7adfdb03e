"""A limit on what pages send, held before it is in memory.

viser announces a file (name, size, number of parts), then keeps its parts until all are there, and asks no one. Its two
handlers are replaced by ones that look first. A part itself, as any message, is at most 50 MiB: viser tells its
websocket so, which refuses a longer one by its head.
"""

import asyncio
from typing import Any

import viser
from viser import _messages as messages

from nectosome.studio.folder import UPLOAD_LIMIT, too_large

_SAID = (0.5, 2.0, 5.0, 15.0)  # s after a refusal: its reason
_SMALLEST_PART = 1024  # [bytes] on average; viser's page sends parts of 512 KiB


def limit_uploads(server: viser.ViserServer) -> None:
    """Let the files that are on their way have `UPLOAD_LIMIT` bytes together, those of all pages.

    It has to come before any other `on_client_connect`, since an upload button of a page's own is not watched before.
    """
    _watch(server, server.gui)

    @server.on_client_connect
    async def _(client: viser.ClientHandle) -> None:  # async ones are called in order, before any other
        _watch(server, client.gui)


def _watch(server: viser.ViserServer, gui: viser.GuiApi) -> None:
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
