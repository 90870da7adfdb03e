"""Who may come into the studio: nobody but this machine's own user, or whoever was given the token.

A page anywhere may make a browser ask 127.0.0.1 for something, so a request from this machine proves nothing:

- A name that someone else's server gave this address (DNS rebinding) shows in `Host`, which has to be ours.
- A page of another origin shows in `Origin`, which a browser always sends with a websocket, and which has to be `Host`.
- viser's page obeys its address: `?websocket=` makes it a page of another server, with our origin, and whatever that
  server tells it to run. So a page with anything behind `?` is not served; it is sent to the address without.
- A page that shows ours in a frame could have its buttons pressed: not allowed by header.

From elsewhere a token is needed, once in the address and then in a cookie.
"""

import contextlib
import errno
import logging
import secrets
import socket
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs

import rich
import viser
import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from nectosome.io.file_system import reason
from nectosome.studio.browser_script import with_script
from nectosome.studio.uploads import limit_uploads
from nectosome.units import InputError

_LOCAL = ("127.0.0.1", "localhost", "::1")
_TRIES = 100  # ports
_HEADERS = {  # of everything that is answered
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
_PAGE = '<!doctype html><html lang="en"><meta charset="utf-8"><title>nectosome studio</title><p>{}</p></html>\n'


@dataclass(frozen=True)
class Reply:
    """What is answered in the place of viser: a status, a sentence (HTML), more headers."""

    status: HTTPStatus
    sentence: str
    headers: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Gate:
    """Decides on requests to a server that listens at `host`.

    With a `token` it has to be shown; away from this machine there is always one. Raises InputError without.
    """

    host: str = "127.0.0.1"
    token: str | None = None

    def __post_init__(self):
        if not self.token and self.host not in _LOCAL:
            raise InputError(f'"{self.host}" can be reached from elsewhere: a token is needed.')

    @classmethod
    def at(cls, host: str) -> "Gate":
        """Return the gate for a host, with a fresh token where one is needed."""
        return cls(host, None if host in _LOCAL else secrets.token_urlsafe(32))

    def address(self, port: int) -> str:
        """Return the address to open in a browser, with the token."""
        name = socket.gethostname() if self.host in ("", "0.0.0.0", "::") else self.host
        return f"http://{f'[{name}]' if ':' in name else name}:{port}/" + (f"?token={self.token}" if self.token else "")

    def check(self, headers: Headers, path: str, port: int) -> Reply | None:
        """Return None for a request that may go on to viser, else what to answer.

        `path` is as in the request, with its query; `port` is the one that the server listens at.
        """
        host, origin = _one(headers, "Host"), _one(headers, "Origin")
        if self.host in _LOCAL:
            at = "" if port == 80 else f":{port}"
            if host is None or host.lower() not in (f"127.0.0.1{at}", f"localhost{at}", f"[::1]{at}"):
                return Reply(HTTPStatus.FORBIDDEN, f"Open http://localhost{at}/: the studio has no other name.")
        # What has no origin is no script of a page; a websocket from a browser always has one.
        is_socket = "Upgrade" in headers
        if ("Origin" in headers or is_socket) and (host is None or origin != f"http://{host}"):
            return Reply(
                HTTPStatus.FORBIDDEN, "This was asked for by another page, or by none. The studio serves its own."
            )
        query = path.partition("?")[2]
        if self.token:
            cookie = f"nectosome-{port}"  # cookies are of a host, for all its ports
            if not is_socket and _same(parse_qs(query).get("token", [""])[0], self.token):
                return _onwards(("Set-Cookie", f"{cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"))
            if not any(_same(value, self.token) for value in _cookies(headers, cookie)):
                return Reply(
                    HTTPStatus.FORBIDDEN,
                    "The studio needs its token: open the whole address that <code>nectosome studio</code> printed, "
                    "with <code>?token=</code> and what follows. It is a new one each time the studio is started.",
                )
        return _onwards() if query and not is_socket else None


class _Server(viser.ViserServer):
    """viser's server without its way around the gate, and without its lines in the terminal."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Do nothing: it would open a tunnel to a public address, and any page may ask for it."""

    def disconnect_share_url(self) -> None:
        """Do nothing: there is no tunnel."""

    def stop(self) -> None:
        with _quiet():
            super().stop()


def guarded_server(gate: Gate, port: int = 8080) -> viser.ViserServer:
    """Start viser at the gate's host so that every request passes the gate and uploads are limited.

    Takes the next free port where `port` is busy, any free one for 0: `get_port()` tells. Raises InputError where the
    host cannot be listened at, and RuntimeError for a viser that starts its server in another way than the known one.
    """
    listening = _listen(gate.host, port)
    port = listening.getsockname()[1]
    with _quiet(), _serving(gate, listening) as guarded:
        # Served is `listening`. Another viser might use host and port: then it is open to this machine until it stops.
        server = _Server("127.0.0.1", port, verbose=False)
    try:
        if not guarded or server.get_port() != port:
            raise RuntimeError(f"viser {viser.__version__} starts its server in an unknown way: it is stopped again.")
        limit_uploads(server)
    except BaseException:
        server.stop()
        listening.close()
        raise
    return server


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
            refusal = gate.check(request.headers, request.path, port)
            answer = process_request(connection, request) if refusal is None else _response(refusal)
            if answer is None:
                return None
            if refusal is None and answer.headers.get("Content-Type", "").startswith("text/html"):
                answer = with_script(answer)
            answer.headers.update(_HEADERS)
            return answer

        guarded.append(True)
        return real(handler, sock=listening, process_request=guard, logger=_log, **options)

    with _starting:
        websockets.asyncio.server.serve = serve
        try:
            yield guarded
        finally:
            websockets.asyncio.server.serve = real


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
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise InputError(f'cannot listen at "{host}", port {candidate}: {reason(error)}.') from None
    raise InputError(f"no free port found from {port} on. Ports go from 1 to 65535; 0 takes any that is free.")


def _response(answer: Reply) -> Response:
    page = _PAGE.format(answer.sentence).encode()
    headers = Headers(answer.headers)
    headers.update({"Content-Type": "text/html; charset=utf-8", "Content-Length": str(len(page))})
    return Response(answer.status, answer.status.phrase, headers, page)


def _onwards(*headers: tuple[str, str]) -> Reply:
    """Return a page that leads on to the address without a query.

    A redirection by status would belong to the page with the link, and a strict cookie would not be sent along.
    """
    return Reply(HTTPStatus.OK, '<a href="/">To the studio</a>', (*headers, ("Refresh", "0; url=/")))


def _one(headers: Headers, name: str) -> str | None:
    """Return a header that is there once; None where it is missing or there are several."""
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else None


def _cookies(headers: Headers, name: str) -> list[str]:
    """Return the values under a name; others' cookies on the same host may be of any form."""
    pairs = [pair.strip().partition("=") for line in headers.get_all("Cookie") for pair in line.split(";")]
    return [value for key, _, value in pairs if key == name]


def _same(given: str, token: str) -> bool:
    """Compare in a time that does not tell how much was right."""
    return secrets.compare_digest(given.encode("utf-8", "surrogatepass"), token.encode())
