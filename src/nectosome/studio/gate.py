"""Who may come into the studio: nobody but this machine's own user, or whoever was given the token.

A page anywhere may make a browser ask 127.0.0.1 for something, so a request from this machine proves nothing:

- A name that someone else's server gave this address (DNS rebinding) shows in `Host`, which has to be ours.
- A page of another origin shows in `Origin`, which a browser always sends with a websocket, and which has to be `Host`.
- viser's page obeys its address: `?websocket=` makes it a page of another server, with our origin, and whatever that
  server tells it to run. So a page with anything behind `?` is not served; it is sent to the address without.
- A page that shows ours in a frame could have its buttons pressed: not allowed by header.

From elsewhere a token is needed, once in the address and then in a cookie.
"""

import secrets
import socket
from dataclasses import dataclass
from http import HTTPStatus
from urllib.parse import parse_qs

from websockets.datastructures import Headers

from nectosome.units import InputError

_LOCAL = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True)
class Reply:
    """What is answered in the place of viser: a status, a sentence (HTML), more headers."""

    status: HTTPStatus
    sentence: str
    headers: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Gate:
    """Decides on requests to a server that listens at `host`.

    With a `token` it has to be shown; away from this machine there is always one. Raises InputError without, and for
    an empty host, which would be all addresses.
    """

    host: str = "127.0.0.1"
    token: str | None = None

    def __post_init__(self):
        if not self.host:
            raise InputError("--host is empty. Give an address, as in 127.0.0.1, or 0.0.0.0 for all of this machine.")
        if not self.token and self.host not in _LOCAL:
            raise InputError(f'"{self.host}" can be reached from elsewhere: a token is needed.')

    @classmethod
    def at(cls, host: str) -> "Gate":
        """Return the gate for a host, with a fresh token where one is needed."""
        return cls(host, None if host in _LOCAL else secrets.token_urlsafe(32))

    def address(self, port: int) -> str:
        """Return the address to open in a browser, with the token."""
        name = socket.gethostname() if self.host in ("0.0.0.0", "::") else self.host
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
