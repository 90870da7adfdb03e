"""Who comes in to the studio: its own page on this machine, or with the token; nobody else, and no other page."""

import http.client

import pytest
from websockets.exceptions import InvalidHandshake
from websockets.sync.client import connect

from nectosome.io import InputError
from nectosome.view.studio.gate import Gate, guarded_server

PORT = 8080
PAGE = {"Host": f"127.0.0.1:{PORT}"}
SOCKET = {**PAGE, "Upgrade": "websocket", "Origin": f"http://127.0.0.1:{PORT}"}


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "[::1]"])
def test_this_machine_comes_in_by_its_own_names(host):
    named = f"{host}:{PORT}"
    assert Gate("127.0.0.1").check({"Host": named}, "/", PORT).status == 0
    own = {"Host": named, "Upgrade": "WebSocket", "Origin": f"http://{named}"}
    assert Gate("127.0.0.1").check(own, "/", PORT).status == 0


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Host": "evil.example:8080"},
        {"Host": "127.0.0.1"},
        {"Host": "127.0.0.1:9999"},
        {**SOCKET, "Origin": "http://evil.example"},
        {**SOCKET, "Origin": "null"},
        {**SOCKET, "Origin": "http://127.0.0.1:9999"},
        {**PAGE, "Upgrade": "websocket"},
        {**SOCKET, "Host": "evil.example:8080", "Origin": "http://evil.example:8080"},
    ],
)
def test_other_names_and_other_pages_do_not(headers):
    assert Gate("127.0.0.1").check(headers, "/", PORT).status == 403


def test_no_address_makes_the_page_obey_another_server():
    for path in ("/?websocket=ws://evil.example", "/index.html?websocket=ws://evil.example", "/?x"):
        assert Gate("127.0.0.1").check(PAGE, path, PORT).status == 403


def test_elsewhere_the_token_is_asked_for():
    gate = Gate("0.0.0.0")
    host = {"Host": "rig.lab:8080"}
    own = {**host, "Upgrade": "websocket", "Origin": "http://rig.lab:8080"}
    with_cookie = {"Cookie": gate.cookie().partition(";")[0]}
    assert len(gate.token) >= 32
    assert Gate("0.0.0.0").token != gate.token
    assert gate.check(host, f"/?token={gate.token}", PORT).status == 303
    assert gate.check(host | with_cookie, "/", PORT).status == 0
    assert gate.check(host | with_cookie, f"/?token={gate.token}", PORT).status == 303
    assert gate.check(host | with_cookie, "/?websocket=ws://evil.example", PORT).status == 403
    assert gate.check(own | with_cookie, "/", PORT).status == 0
    refused = [
        (host, "/"),
        (host, "/?token="),
        (host, f"/?token={gate.token[:-1]}"),
        (host, f"/index.js?token={gate.token}"),
        (host | {"Cookie": "nectosome_studio="}, "/"),
        (host | {"Cookie": "nectosome_studio=wrong; ="}, "/"),
        (own, f"/?token={gate.token}x"),
        (own | with_cookie | {"Origin": "http://evil.example"}, "/"),
    ]
    for headers, path in refused:
        assert gate.check(headers, path, PORT).status == 403, (headers, path)


@pytest.fixture(scope="module")
def local():
    server, address = guarded_server("127.0.0.1", 18_080)
    yield server.get_port(), address
    server.stop()


def get(port, path, **headers):
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    link.putrequest("GET", path, skip_host=True)
    for name, value in ({"Host": f"127.0.0.1:{port}"} | headers).items():
        link.putheader(name, value)
    link.endheaders()
    answer = link.getresponse()
    return answer.status, answer.read(), dict(answer.getheaders())


def test_a_server_on_this_machine_serves_its_page_and_nothing_beside_it(local):
    port, address = local
    assert address == f"http://127.0.0.1:{port}/"
    status, body, _ = get(port, "/")
    assert status == 200
    assert b"<html" in body.lower()
    assert "frame-ancestors 'none'" in get(port, "/")[2]["Content-Security-Policy"]
    for path in (
        "/../../../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%5c..%5cpyproject.toml",
        "/assets/../../_viser.py",
    ):
        assert get(port, path)[0] == 404
    status, body, _ = get(port, "/", Host="evil.example")
    assert status == 403
    assert b"<html" not in body.lower()


def test_only_its_own_page_gets_a_websocket(local):
    import viser

    port, _ = local
    kind = f"viser-v{viser.__version__}"
    with connect(
        f"ws://127.0.0.1:{port}", origin=f"http://127.0.0.1:{port}", subprotocols=[kind], open_timeout=20
    ) as link:
        assert link.recv(timeout=20)
    for origin in (None, "http://evil.example", "null"):
        with pytest.raises(InvalidHandshake):
            connect(f"ws://127.0.0.1:{port}", origin=origin, subprotocols=[kind], open_timeout=20)


def test_a_busy_port_leads_to_the_next_one_which_is_told(local):
    port, _ = local
    server, address = guarded_server("127.0.0.1", port)
    try:
        assert server.get_port() != port
        assert address == f"http://127.0.0.1:{server.get_port()}/"
        assert get(server.get_port(), "/")[0] == 200
    finally:
        server.stop()


def test_a_server_for_others_lets_in_by_token_then_by_cookie():
    server, address = guarded_server("0.0.0.0", 18_180)
    try:
        port, path = server.get_port(), address.partition(f":{server.get_port()}")[2]
        assert get(port, "/")[0] == 403
        status, body, headers = get(port, path)
        assert (status, body, headers["Location"]) == (303, b"", "/")
        assert "HttpOnly" in headers["Set-Cookie"]
        assert "SameSite=Strict" in headers["Set-Cookie"]
        assert get(port, "/", Cookie=headers["Set-Cookie"].partition(";")[0])[0] == 200
    finally:
        server.stop()


def test_a_host_that_is_not_this_machine_is_refused_at_once():
    with pytest.raises(InputError, match="no address of this machine"):
        guarded_server("203.0.113.7", 8080)


def test_the_gate_stays_out_of_other_servers():
    import websockets.asyncio.server as web

    before = web.serve
    server, _ = guarded_server("127.0.0.1", 18_280)
    server.stop()
    assert web.serve is before
