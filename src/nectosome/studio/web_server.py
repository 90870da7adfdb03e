"""viser's web server behind the gate. What the studio changes of viser and websockets while they run is here.

viser gives no place for a look at requests, so for the moment in which it starts, `websockets.asyncio.server.serve` is
one of ours; `docs/develop/viser.patch` is what would make that needless. `uploads.py` replaces handlers of viser.
"""

import asyncio
import contextlib
import errno
import gzip
import logging
import secrets
import socket
import threading
import warnings
from collections.abc import Iterator
from functools import cache
from http import HTTPStatus
from typing import Any

import rich
import viser
import websockets.asyncio.server
from plotly.offline import get_plotlyjs
from viser import _messages as messages
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from nectosome.io.file_system import reason
from nectosome.units import InputError
from nectosome.view.markup import policy

from .browser_script import PLOTLY, with_scripts
from .gate import Gate, Reply
from .uploads import check_camera, limit_uploads, limit_values

_TRIES = 100  # ports
_HEADERS = {  # of everything that is answered
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
_NO_FRAME = "frame-ancestors 'none'"
_NOTHING = f"default-src 'none'; {_NO_FRAME}"  # what all but viser's page may do
_PAGE = '<!doctype html><html lang="en"><meta charset="utf-8"><title>nectosome studio</title><p>{}</p></html>\n'
_OLD = Reply(HTTPStatus.BAD_REQUEST, "This page is of another version: load it again.")


class _Server(viser.ViserServer):
    """viser's server without its way around the gate, and without its lines in the terminal."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Do nothing: it would open a tunnel to a public address, and any page may ask for it."""

    def disconnect_share_url(self) -> None:
        """Do nothing: there is no tunnel."""

    def stop(self) -> None:
        with _quiet():
            super().stop()


class _Connection(ServerConnection):
    """A page's websocket, which is closed by the first frame that is no message of viser."""

    async def recv(self, *args: Any, **options: Any) -> Any:
        while True:
            frame = await super().recv(*args, **options)
            try:
                message = messages.Message.deserialize(frame)  # type: ignore[arg-type]
                if isinstance(message, messages.ViewerCameraMessage):
                    check_camera(message)
            except Exception:  # whatever may come of what is no message
                _log.debug("a frame is no message", exc_info=True)
                await self.close(CloseCode.INVALID_DATA)
            else:
                return frame


def guarded_server(gate: Gate, port: int = 8080) -> viser.ViserServer:
    """Start viser at the gate's host so that every request passes the gate and uploads are limited.

    Takes the next free port where `port` is busy, any free one for 0: `get_port()` tells. Raises InputError where the
    host cannot be listened at, and RuntimeError for a viser that starts its server in another way than the known one.
    """
    # of what a page sent
    warnings.filterwarnings("ignore", r"\[viser\] (Dropping upload|[\s\S]* does not match annotation)")
    listening = _listen(gate.host, port)
    port = listening.getsockname()[1]
    with _quiet(), _serving(gate, listening) as guarded:
        # Served is `listening`. Another viser might use host and port: then it is open to this machine until it stops.
        server = _Server("127.0.0.1", port, verbose=False)
    try:
        if not guarded or server.get_port() != port:
            raise RuntimeError(f"viser {viser.__version__} starts its server in an unknown way: it is stopped again.")
        _watch(server)
    except BaseException:
        server.stop()
        listening.close()
        raise
    return server


def _watch(server: viser.ViserServer) -> None:
    """Limit what pages send, by the controls of all pages and by their own, before anything is done for a page.

    Values of its own controls are limited by its session, before it has any.
    """
    limit_uploads(server, server.gui)
    limit_values(server.gui, lambda *_: None)

    @server.on_client_connect
    async def _(client: viser.ClientHandle) -> None:  # async ones are called in order, before any other
        limit_uploads(server, client.gui)


_starting = threading.Lock()
_log = logging.getLogger("nectosome.studio")  # what no browser would send is no reason for a traceback
_log.addFilter(lambda record: record.getMessage() != "opening handshake failed")


@contextlib.contextmanager
def _serving(gate: Gate, listening: socket.socket) -> Iterator[list[bool]]:
    """Put the gate before what viser serves for as long as this lasts; yields what is filled when that was done."""
    real, guarded, port = websockets.asyncio.server.serve, [], listening.getsockname()[1]

    def serve(handler: Any, *where: Any, process_request: Any = None, **options: Any) -> Any:
        if handler.__module__ != "viser.infra._infra":  # someone else's server, in another thread
            return real(handler, *where, process_request=process_request, **options)

        def guard(connection: Any, request: Request) -> Response | None:
            refusal = gate.check(request.headers, request.path, port) or _old(request)
            return _answered(request, refusal, lambda: process_request(connection, request))

        guarded.append(True)
        asyncio.get_running_loop().set_exception_handler(_not_of_a_page)
        return real(
            handler, sock=listening, process_request=guard, create_connection=_Connection, logger=_log, **options
        )

    with _starting:
        websockets.asyncio.server.serve = serve
        try:
            yield guarded
        finally:
            websockets.asyncio.server.serve = real


def _answered(request: Request, refusal: Reply | None, viser_answers: Any) -> Response | None:
    """What is answered, with its headers; None for a websocket that may be opened."""
    allowed = _NOTHING
    if refusal is not None:
        answer = _response(refusal)
    elif request.path == PLOTLY:
        answer = _plotly()
    else:
        if "Accept-Encoding" in request.headers:  # the page is changed each time, which is quicker as it is
            del request.headers["Accept-Encoding"]
        answer = viser_answers()
        if answer is None:
            return None
        if answer.headers.get("Content-Type", "").startswith("text/html"):
            nonce = secrets.token_urlsafe(16)
            answer, allowed = with_scripts(answer, nonce), f"{policy(nonce)}; {_NO_FRAME}"
    answer.headers.update({**_HEADERS, "Content-Security-Policy": allowed})
    return answer


def _old(request: Request) -> Reply | None:
    """A refusal where a page of another viser, or what is none, asks for a websocket: viser would print that."""
    asked = request.headers.get_all("Sec-WebSocket-Protocol")
    return _OLD if "Upgrade" in request.headers and f"viser-v{viser.__version__}" not in asked else None


def _not_of_a_page(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report what fails in the server, unless that is what a page sent: a message with values that no page has."""
    task = context.get("future")
    work = task.get_coro() if isinstance(task, asyncio.Task) else None
    if getattr(work, "__name__", "") == "_handle_incoming_message":
        _log.debug("a message was not understood", exc_info=context.get("exception"))
    else:
        loop.default_exception_handler(context)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Let nothing be printed by `rich.print`, which viser uses."""
    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


def _listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens at the first free port from `port` on; viser would wait for ever where none can."""
    host = "127.0.0.1" if host == "localhost" else host  # whatever that name may lead to here
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for candidate in range(port, min(port + _TRIES, 65536)):
        try:
            return socket.create_server((host, candidate), family=family)
        except (OSError, ValueError, TypeError) as error:  # a host may be no name, or one with a null character
            if not isinstance(error, OSError) or error.errno != errno.EADDRINUSE:
                raise InputError(f'cannot listen at "{host}", port {candidate}: {reason(error)}.') from None
    raise InputError(f"no free port found from {port} on. Ports go from 1 to 65535; 0 takes any that is free.")


def _response(answer: Reply) -> Response:
    page = _PAGE.format(answer.sentence).encode()
    headers = Headers(answer.headers)
    headers.update({"Content-Type": "text/html; charset=utf-8", "Content-Length": str(len(page))})
    return Response(answer.status, answer.status.phrase, headers, page)


@cache
def _plotly() -> Response:
    """The program that draws plots."""
    program = gzip.compress(get_plotlyjs().encode(), mtime=0)
    headers = {"Content-Type": "text/javascript; charset=utf-8", "Content-Encoding": "gzip"}
    return Response(HTTPStatus.OK, "OK", Headers(headers | {"Content-Length": str(len(program))}), program)
