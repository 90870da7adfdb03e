"""The studio's server behind its gate: what it serves, and what pages may send."""

import asyncio
import contextlib
import gc
import gzip
import http.client
import math
import re
import socket
import threading
import time

import msgspec
import pytest
import viser
import viser._viser
import websockets.asyncio.server
import zstandard
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from nectosome.studio import uploads
from nectosome.studio.browser_script import PLOTLY
from nectosome.studio.gate import Gate
from nectosome.studio.web_server import _serving, guarded_server
from nectosome.units import InputError

LOCAL, REMOTE = Gate(), Gate("0.0.0.0", "right-token")
COOKIE = "nectosome-8080=right-token"
CAMERA = messages.ViewerCameraMessage((1, 0, 0, 0), (0, 0, 1), 1.0, 0.1, 10.0, 9, 16, (0, 0, 0), (0, 0, 1))


def serving(gate, port=0):
    server = guarded_server(gate, port)
    return contextlib.closing(type("Stops", (), {"close": lambda _: server.stop()})()), server


@pytest.fixture(scope="module")
def server():
    stops, server = serving(LOCAL)
    with stops:
        yield server


@pytest.fixture(scope="module")
def closed():
    """One that asks for a token."""
    stops, server = serving(Gate("127.0.0.1", "right-token"))
    with stops:
        yield server


def get(server, path="/", **headers):
    """Status, headers and body; the path is sent as it is."""
    connection = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=5)
    try:
        connection.request("GET", path, headers=headers)
        response = connection.getresponse()
        return response.status, response.headers, response.read()
    finally:
        connection.close()


def page(server, version=f"viser-v{viser.__version__}", **headers):
    """A websocket as viser's page opens it."""
    where = f"127.0.0.1:{server.get_port()}"
    headers = {"Origin": f"http://{where}", **headers}
    return connect(
        f"ws://{where}",
        additional_headers={k: v for k, v in headers.items() if v is not None},
        subprotocols=[version],
        max_size=None,
        proxy=None,
    )


def send(connection, message):
    connection.send(msgspec.msgpack.encode(message.as_serializable_dict()))


def test_viser_is_served_and_says_nothing(capfd, caplog):
    stops, server = serving(LOCAL)
    with stops:
        socket.create_connection(("127.0.0.1", server.get_port())).close()  # browsers do so
        code, headers, body = get(server)
        assert code == 200 and b"viser" in body.lower()
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"] and headers["Cache-Control"] == "no-store"
        with page(server) as connection:
            connection.recv(timeout=5)
    assert not server._websock_server._server_thread.is_alive()
    assert capfd.readouterr() == ("", "") and not caplog.records


def test_a_page_may_run_its_own_scripts_only_and_ask_nobody_else(server):
    policies = [get(server)[1]["Content-Security-Policy"] for _ in range(2)]
    assert policies[0] != policies[1]  # each with a number of its own, which nothing on the page can know
    for policy in policies:
        rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
        assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == rules["frame-ancestors"] == "'none'"
        assert re.fullmatch(r"'nonce-[\w-]{22}' 'wasm-unsafe-eval'", rules["script-src"])
        assert "//" not in policy and "*" not in policy
    nonce = policies[1].partition("nonce-")[2].partition("'")[0]
    _, headers, body = get(server, **{"Accept-Encoding": "gzip"})
    scripts = re.findall(rb"<script[^>]{0,60}", body)
    assert len(scripts) == 3 and all(b'<script nonce="' in script for script in scripts)
    assert (nonce.encode() not in body and "Content-Encoding" not in headers) or headers[
        "Content-Encoding"
    ] == "identity"
    for path, headers in (("/nothing", {}), ("/", {"Host": "evil.example"}), (PLOTLY, {})):
        assert get(server, path, **headers)[1]["Content-Security-Policy"].startswith("default-src 'none'; frame-anc")


def test_the_program_that_draws_plots_is_served(server):
    code, headers, body = get(server, PLOTLY)
    assert code == 200 and headers["Content-Type"].startswith("text/javascript")
    assert b"window.Plotly = Plotly" in gzip.decompress(body)


@pytest.mark.parametrize(
    "path",
    ["/../../etc/passwd", "/%2e%2e%2f%2e%2e%2fetc/passwd", "/..\\..\\etc\\passwd", "//etc/passwd", "/etc/passwd%00"],
)
def test_nothing_but_the_page_is_served(server, path):
    code, _, body = get(server, path)
    assert code >= 400 and b"root:" not in body


def test_refusals_come_through(server):
    assert get(server, Host="evil.example")[0] == 403
    assert get(server, Origin="http://evil.example")[0] == 403
    _, headers, body = get(server, "/?websocket=ws://evil.example")
    assert headers["Refresh"] == "0; url=/" and b"evil" not in body and b"viser" not in body.lower()
    for bad in ({"Origin": None}, {"Origin": "http://evil.example"}, {"Host": "evil.example"}):
        with pytest.raises(InvalidStatus, match="403"):
            page(server, **bad)
    with page(server) as connection:
        assert connection.recv(timeout=5)


def test_the_way_in_with_a_token(closed):
    for path in ("/", "/?token=wrong", "/index.html"):
        code, headers, body = get(closed, path)
        assert code == 403 and b"?token=" in body and b"right-token" not in body and "Set-Cookie" not in headers
    with pytest.raises(InvalidStatus, match="403"):
        page(closed)
    code, headers, body = get(closed, "/?token=right-token")
    assert code == 200 and b"right-token" not in body and b"viser" not in body.lower()
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert get(closed, Cookie=cookie)[0] == 200
    with pytest.raises(InvalidStatus, match="403"):
        page(closed, Cookie=cookie, Origin="http://evil.example")
    with page(closed, Cookie=cookie) as connection:
        assert connection.recv(timeout=5)


def test_a_busy_port_is_passed_over_and_the_gate_knows(server):
    stops, other = serving(LOCAL, server.get_port())
    with stops:
        assert other.get_port() > server.get_port()
        assert get(other)[0] == 200
        assert get(other, Host=f"localhost:{server.get_port()}")[0] == 403


def test_a_host_that_is_not_here_is_told():
    with pytest.raises(InputError, match=r"192\.0\.2\.1"):
        guarded_server(Gate.at("192.0.2.1"), 0)
    for host in ("a\0b", "n" * 300, "é" * 70):
        with pytest.raises(InputError, match="cannot listen at"):
            guarded_server(Gate.at(host), 0)
    with pytest.raises(InputError, match="65535"):
        guarded_server(LOCAL, 65536)


def test_a_viser_that_starts_otherwise_is_stopped(monkeypatch):
    real = websockets.asyncio.server.serve
    started = []

    class Otherwise(viser.infra.WebsockServer):
        def start(self):
            started.append(self)
            websockets.asyncio.server.serve = real  # as if it had its own name for it
            super().start()

    monkeypatch.setattr(viser.infra, "WebsockServer", Otherwise)
    with pytest.raises(RuntimeError, match="unknown way"):
        guarded_server(LOCAL, 0)
    assert websockets.asyncio.server.serve is real
    started[0]._server_thread.join(5)
    assert not started[0]._server_thread.is_alive()


def test_servers_of_others_are_left_alone():
    async def start(listening):
        with _serving(LOCAL, listening) as guarded:
            async with websockets.asyncio.server.serve(lambda connection: None, "127.0.0.1", 0) as other:
                return guarded, other.sockets[0].getsockname()

    with socket.create_server(("127.0.0.1", 0)) as listening:
        guarded, name = asyncio.run(start(listening))
        assert not guarded and name != listening.getsockname()


# --- what pages send ---


@pytest.fixture
def button(server):
    """An upload button, with the files that came in by it."""
    handle = server.gui.add_upload_button("Open")
    handle.files, handle.came = [], threading.Event()

    @handle.on_upload
    def _(event):
        handle.files.append(event.target.value)
        handle.came.set()

    yield handle
    handle.remove()


def announce(button, size, parts, name="a.yaml", transfer="t"):
    return messages.FileTransferStartUpload(button._impl.uuid, transfer, name, "", parts, size)


def part(button, index, content, transfer="t"):
    return messages.FileTransferPart(button._impl.uuid, transfer, index, content)


def wait(condition, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@contextlib.contextmanager
def client(server):
    """A page that has shown itself, so that viser counts it among its clients."""
    with page(server) as connection:
        send(connection, CAMERA)
        wait(server.get_clients)
        yield connection
    wait(lambda: not server.get_clients())


def heard(connection, kind, **fields):
    """The next message of a kind, with such fields, that the page is sent."""
    while True:
        raw = connection.recv(timeout=5)
        inner = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + int.from_bytes(raw[8:16], "little")])
        for message in msgspec.msgpack.decode(inner)["messages"]:
            if message["type"] == kind and fields.items() <= message.items():
                return message


def settled(server, connection):
    """Everything sent before has been dealt with: messages of a page are handled in order."""
    before = server.get_clients().popitem()[1].camera.update_timestamp
    send(connection, CAMERA)
    wait(lambda: server.get_clients().popitem()[1].camera.update_timestamp > before)


def test_a_file_comes_in(server, button):
    with client(server) as connection:
        send(connection, announce(button, 1500, 2))
        send(connection, part(button, 0, b"a" * 1000))
        send(connection, part(button, 1, b"b" * 500))
        assert button.came.wait(5)
    assert [(file.name, file.content) for file in button.files] == [("a.yaml", b"a" * 1000 + b"b" * 500)]


def test_what_is_too_large_is_refused_before_it_comes_and_the_page_is_told(server, button, monkeypatch):
    monkeypatch.setattr(uploads, "UPLOAD_LIMIT", 1000)
    with client(server) as connection:
        kept = server.gui._current_file_upload_states
        for size, parts in ((1001, 1), (-1, 1), (10, 3), (10, -1)):
            send(connection, announce(button, size, parts))
            send(connection, part(button, 0, b"abc"))
            settled(server, connection)
            assert not kept
        send(connection, announce(button, 600, 1, transfer="one"))
        send(connection, announce(button, 600, 1, transfer="two"))  # together they are too large
        settled(server, connection)
        assert list(kept) == ["one"]
        assert heard(connection, "FileTransferPartAck", transfer_uuid="t", total_bytes=-1)["transferred_bytes"] == 0
        said = heard(connection, "NotificationUpdateMessage", uuid="upload-t")
        assert "a.yaml" in said["props"]["body"] and "are accepted at a time" in said["props"]["body"]
    assert not button.files and not kept  # the page is gone, and what it had begun


@pytest.mark.parametrize("content", [b"abcdef", "abcde", [[0] * 100]])
def test_more_than_was_announced_is_not_kept(server, button, content):
    with client(server) as connection:
        send(connection, announce(button, 5, 1))
        message = part(button, 0, b"").as_serializable_dict() | {"content": content}
        connection.send(msgspec.msgpack.encode(message))
        settled(server, connection)
        assert not server.gui._current_file_upload_states
    assert not button.files


def test_a_button_of_a_page_s_own_is_watched_too(server, monkeypatch):
    monkeypatch.setattr(uploads, "UPLOAD_LIMIT", 1000)
    with client(server) as connection:
        gui = server.get_clients().popitem()[1].gui
        handle = gui.add_upload_button("Mine")
        send(connection, announce(handle, 1001, 1))
        settled(server, connection)
        assert not gui._current_file_upload_states
        send(connection, announce(handle, 1000, 1))
        settled(server, connection)
        assert len(gui._current_file_upload_states) == 1


def test_a_page_that_has_not_shown_itself_sends_no_file(server, button):
    """viser would keep its parts for ever."""
    with page(server) as connection:
        send(connection, announce(button, 1500, 2))
        send(connection, part(button, 0, b"abc"))
        send(connection, CAMERA)
        wait(server.get_clients)
        assert not server.gui._current_file_upload_states
    wait(lambda: not server.get_clients())


def test_a_message_above_50_mib_is_refused_by_its_head(server):
    with client(server) as connection, pytest.raises(ConnectionClosed) as closed:
        connection.socket.sendall(b"\x82\xff" + (50 * 1024 * 1024 + 1).to_bytes(8) + b"mask")  # binary, and its length
        while True:
            connection.recv(timeout=5)
    assert closed.value.rcvd.code == 1009  # too big


def test_no_page_can_open_a_tunnel(server, monkeypatch):
    opened = []
    monkeypatch.setattr(viser._viser, "ViserTunnel", lambda *args: opened.append(args))
    with client(server) as connection:
        send(connection, messages.ShareUrlRequest())
        send(connection, messages.ShareUrlDisconnect())
        settled(server, connection)
        wait(lambda: server._thread_executor._work_queue.empty())
    assert server.request_share_url() is None and not opened


# --- what is no message of a page ---

FRAMES = (
    b"",
    b"\x00",
    b"\xc1" * 50,
    "text",
    msgspec.msgpack.encode([1, 2]),
    msgspec.msgpack.encode({"type": 5}),
    msgspec.msgpack.encode({"type": "NoSuchMessage"}),
    msgspec.msgpack.encode({"type": "GuiUpdateMessage"}),
    msgspec.msgpack.encode({"type": "ViewerCameraMessage", "more": 1}),
    b"\x81" * 200_000,  # nested
)


CAMERAS = (
    {"position": "x"},
    {"look_at": [0, 0]},
    {"wxyz": None},
    {"fov": math.nan},
    {"near": []},
)


def values(slider, choice):
    """Messages that no page sends: with values that are none of theirs."""
    for control, updates in (
        (slider, {"value": "much"}),
        (slider, {"value": [1]}),
        (slider, {"value": math.nan}),
        (slider, {"value": 0.1, "update_cb": 1}),
        (slider, {"none such": 1}),
        (slider, []),
        (slider, 5),
        (choice, {"value": "e"}),
        (choice, {"value": {"a": 1}}),
    ):
        yield {"type": "GuiUpdateMessage", "uuid": control._impl.uuid, "updates": updates}
    yield {"type": "GuiUpdateMessage", "uuid": {"a": 1}, "updates": {"value": 1}}
    yield {"type": "FileTransferPart", "source_component_uuid": 1, "transfer_uuid": [], "part_index": "x", "content": 2}
    yield {"type": "GuiFormSubmitMessage", "uuid": []}


def test_what_is_no_message_ends_its_page_and_prints_nothing(server, capfd, caplog):
    cameras = (msgspec.msgpack.encode(CAMERA.as_serializable_dict() | changes) for changes in CAMERAS)
    for frame in (*FRAMES, *cameras):
        with client(server) as connection, pytest.raises(ConnectionClosed) as closed:
            connection.send(frame)
            while True:
                connection.recv(timeout=5)
        assert closed.value.rcvd.code == 1007, frame
    gc.collect()  # a task that failed speaks up when it is collected
    assert capfd.readouterr() == ("", "") and not caplog.records
    with client(server):
        assert len(server.get_clients()) == 1  # others are served


def test_values_that_no_page_has_print_nothing(server, capfd, caplog):
    slider = server.gui.add_slider("a", 0, 1, 0.1, 0.5)
    choice, changed = server.gui.add_dropdown("b", ("c", "d")), []
    for control in (slider, choice):
        control.on_update(changed.append)
    for message in values(slider, choice):
        with client(server) as connection:
            connection.send(msgspec.msgpack.encode(message))
            with contextlib.suppress(KeyError, ConnectionClosed):  # it was closed, as by what is no message
                settled(server, connection)
    gc.collect()
    assert capfd.readouterr() == ("", "") and not caplog.records
    assert not changed and (slider.value, choice.value) == (0.5, "c")
    with client(server) as connection:  # while what a page may send is taken
        send(connection, messages.GuiUpdateMessage(slider._impl.uuid, {"value": 1}))
        send(connection, messages.GuiUpdateMessage(choice._impl.uuid, {"value": "d"}))
        wait(lambda: (slider.value, choice.value) == (1.0, "d"))
    slider.remove()
    choice.remove()


def test_failures_of_the_server_itself_are_told(server, caplog):
    """What is hushed is what pages send, nothing else."""

    async def fail():
        raise RuntimeError("our own")

    loop = server._websock_server._background_event_loop
    loop.call_soon_threadsafe(lambda: loop.create_task(fail()))
    wait(lambda: gc.collect() >= 0 and any("our own" in str(record.exc_info) for record in caplog.records))


def test_a_page_of_another_viser_is_told_to_load_again(server, capfd):
    for version in ("viser-v0.0.1", "viser-v", "other"):
        with pytest.raises(InvalidStatus, match="400"):
            page(server, version)
    assert capfd.readouterr() == ("", "")
