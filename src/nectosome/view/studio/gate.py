"""Who may come in: only this machine's own pages, or those that bring the token, and no page of somebody else."""

import secrets
import threading
from collections.abc import Mapping
from contextlib import redirect_stdout
from functools import partial
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from io import StringIO
from typing import Any, NamedTuple
from urllib.parse import parse_qs, urlsplit

import viser
import websockets.asyncio.server as web
from viser import _messages as messages  # what a client may ask for that is not for it
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from nectosome.io import InputError

LOCAL = ("127.0.0.1", "localhost", "::1")
MOST_UPLOADED = 64 * 2**20  # bytes of a file
_COOKIE = "nectosome_studio"
_HEADERS = {  # of all that is answered: no page shows ours in a frame, nobody keeps it, nobody is told its address
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class Verdict(NamedTuple):
    """What becomes of a request: `status` 0 lets it in; a redirection leads to / with the cookie."""

    status: int
    words: str = ""


class Gate:
    """Decides about requests to a server that listens at a host; other hosts than LOCAL ask for a token."""

    def __init__(self, host: str):
        self.token = "" if host in LOCAL else secrets.token_urlsafe(24)

    def check(self, headers: Mapping[str, str], path: str, port: int) -> Verdict:
        """Judge a request for a path by its headers, at the port where it came in.

        Without a token the request must name this machine, which keeps out pages that were given its address by a name
        of their own (DNS rebinding). A websocket must come from a page of this very server. With a token it must be in
        the cookie, or in the address of the first page. Nothing else may stand behind an address: viser's page takes
        from there which server it obeys.
        """
        host = headers.get("Host", "")
        if not self.token and host not in {f"{name}:{port}" for name in ("127.0.0.1", "localhost", "[::1]")}:
            return Verdict(HTTPStatus.FORBIDDEN, "The studio is open to this machine only, by its own address.")
        own = bool(host) and headers.get("Origin", "") in (f"http://{host}", f"https://{host}")
        if headers.get("Upgrade", "").lower() == "websocket" and not own:
            return Verdict(HTTPStatus.FORBIDDEN, "Another page may not use the studio.")
        parts = urlsplit(path)
        if self.token and parts.path == "/" and self._known(parse_qs(parts.query).get("token", [""])[0]):
            return Verdict(HTTPStatus.SEE_OTHER)
        if self.token and not self._known(_cookie(headers)):
            return Verdict(HTTPStatus.FORBIDDEN, "Open the whole address that the studio printed, with its token.")
        if parts.query:
            return Verdict(HTTPStatus.FORBIDDEN, "Open the address without what is behind its question mark.")
        return Verdict(0)

    def cookie(self) -> str:
        """Header with which a page comes in from then on."""
        return f"{_COOKIE}={self.token}; Path=/; HttpOnly; SameSite=Strict"

    def _known(self, token: str) -> bool:
        return secrets.compare_digest(token.encode(), self.token.encode())


def _cookie(headers: Mapping[str, str]) -> str:
    try:
        found = SimpleCookie(headers.get("Cookie", "")).get(_COOKIE)
    except CookieError:
        return ""
    return found.value if found else ""


def guarded_server(host: str, port: int) -> tuple[viser.ViserServer, str]:
    """Start viser behind a gate; return it with the address to open. The next free port is taken.

    viser has no place for a gate, so for the time of its start the function with which it serves is one that asks the
    gate first. Raises InputError where it cannot listen there, RuntimeError where this viser starts in another way.
    """
    gate, original, passed = Gate(host), web.serve, threading.Event()

    def asked(inner: Any, connection: web.ServerConnection, request: Request) -> Response | None:
        verdict = gate.check(_first(request.headers), request.path, connection.local_address[1])
        if verdict.status:
            return _refused(verdict, gate)
        answer = inner(connection, request)
        if answer is not None:
            answer.headers.update(_HEADERS)
        return answer

    def serve(*args: Any, process_request: Any, **options: Any) -> Any:
        passed.set()
        return original(*args, process_request=partial(asked, process_request), **options)

    _check_address(host, port)
    web.serve = serve
    try:
        with redirect_stdout(StringIO()):  # its banner, which names the address without the token
            server = viser.ViserServer(host=host, port=port, verbose=False)
    finally:
        web.serve = original
    if not passed.is_set():
        server.stop()
        raise RuntimeError(f"viser {viser.__version__} serves in a way that has no gate.")
    for kind in (messages.ShareUrlRequest, messages.ShareUrlDisconnect):  # nothing goes to servers of others
        server._websock_server.unregister_handler(kind)
    shown = "127.0.0.1" if host in LOCAL else host
    address = f"http://{shown}:{server.get_port()}/"
    return server, f"{address}?token={gate.token}" if gate.token else address


def stop(server: viser.ViserServer) -> None:
    """End a server without its last words."""
    with redirect_stdout(StringIO()):
        server.stop()


def limit_uploads(client: viser.ClientHandle) -> None:
    """Forget an upload before its first part where it is said to be larger than MOST_UPLOADED, or grows beyond."""
    gui = client.gui
    begin, go_on = gui._handle_file_transfer_start, gui._handle_file_transfer_part
    states = gui._current_file_upload_states

    def begun(client_id: Any, message: Any) -> None:
        if 0 <= message.size_bytes <= MOST_UPLOADED and len(states) < 2:
            begin(client_id, message)

    def part(client_id: Any, message: Any) -> None:
        state = states.get(message.transfer_uuid)
        if state is not None and state["transferred_bytes"] + len(message.content) > MOST_UPLOADED:
            states.pop(message.transfer_uuid, None)
            return
        go_on(client_id, message)

    connection = gui._websock_interface
    connection.unregister_handler(messages.FileTransferStartUpload, begin)
    connection.register_handler(messages.FileTransferStartUpload, begun)
    connection.unregister_handler(messages.FileTransferPart, go_on)
    connection.register_handler(messages.FileTransferPart, part)


def _first(headers: Headers) -> dict[str, str]:
    """Headers that come once, such as Host; of what comes twice none, so that nothing slips in behind the first."""
    return {name.title(): values[0] for name in headers for values in [headers.get_all(name)] if len(values) == 1}


def _refused(verdict: Verdict, gate: Gate) -> Response:
    headers = Headers(_HEADERS | {"Content-Type": "text/plain; charset=utf-8"})
    if verdict.status == HTTPStatus.SEE_OTHER:
        headers["Location"], headers["Set-Cookie"] = "/", gate.cookie()
    body = verdict.words.encode()
    headers["Content-Length"] = str(len(body))
    return Response(int(verdict.status), HTTPStatus(verdict.status).phrase, headers, body)


def _check_address(host: str, port: int) -> None:
    """viser tries one port after another where it cannot listen: of a wrong host it would try a thousand."""
    import socket

    try:
        with socket.create_server((host, 0), family=socket.AF_INET6 if ":" in host else socket.AF_INET):
            pass
    except OSError as error:
        why = error.strerror or str(error)
        raise InputError(f'"{host}" is no address of this machine to listen at: {why}.', field="--host") from None
