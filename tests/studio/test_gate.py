"""Who may come in: the gate's answers, without a server."""

import pytest
from websockets.datastructures import Headers

from nectosome.studio.gate import Gate
from nectosome.units import InputError

LOCAL, REMOTE = Gate(), Gate("0.0.0.0", "right-token")
COOKIE = "nectosome-8080=right-token"


def status(gate, path="/", **headers):
    """What is answered at port 8080, None where viser answers; `_` in a header's name stands for `-`."""
    headers = {"Host": "localhost:8080", **headers}
    answer = gate.check(Headers({k.replace("_", "-"): v for k, v in headers.items() if v is not None}), path, 8080)
    return answer and answer.status


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:8080", "LocalHost:8080", "[::1]:8080"])
def test_this_machine_may_come_in_under_its_own_names(host):
    assert status(LOCAL, Host=host) is None
    assert status(LOCAL, Host=host, Upgrade="websocket", Origin=f"http://{host}") is None


@pytest.mark.parametrize(
    "host",
    [
        None,
        "",
        "evil.example:8080",
        "127.0.0.1:8081",
        "127.0.0.1",
        "localhost:8080.evil.example",
        "127.0.0.1:8080@evil",
    ],
)
def test_a_name_that_someone_gave_this_address_is_refused(host):
    assert status(LOCAL, Host=host) == 403
    assert status(LOCAL, Host=host, Upgrade="websocket", Origin=f"http://{host}") == 403


@pytest.mark.parametrize("gate", [LOCAL, REMOTE])
@pytest.mark.parametrize(
    "origin",
    [None, "null", "http://evil.example", "https://localhost:8080", "http://localhost:8081", "http://localhost:8080/"],
)
def test_a_websocket_of_another_page_or_of_no_page_is_refused(gate, origin):
    assert status(gate, Upgrade="websocket", Origin=origin, Cookie=COOKIE) == 403
    assert status(gate, Upgrade="WebSocket", Origin=origin, Cookie=COOKIE) == 403
    assert status(gate, Upgrade="websocket", Origin="http://localhost:8080", Cookie=COOKIE) is None


def test_a_page_of_another_origin_may_not_even_read():
    assert status(LOCAL, Origin="http://evil.example") == 403
    assert status(LOCAL, Origin="http://localhost:8080") is None


@pytest.mark.parametrize("name", ["Host", "Origin"])
def test_a_header_given_twice_counts_for_nothing(name):
    headers = Headers(Host="localhost:8080", Origin="http://localhost:8080", Upgrade="websocket")
    assert LOCAL.check(headers, "/", 8080) is None
    headers[name] = headers[name]  # adds another one
    assert LOCAL.check(headers, "/", 8080).status == 403


@pytest.mark.parametrize(
    "path", ["/?websocket=ws://evil.example", "/?playbackPath=http://evil.example/x", "/?x?y", "//evil?x"]
)
def test_the_page_is_not_served_with_orders_in_its_address(path):
    """viser's page connects to whatever server `?websocket=` names, and runs what that sends, in our origin."""
    answer = LOCAL.check(Headers(Host="localhost:8080"), path, 8080)
    assert ("Refresh", "0; url=/") in answer.headers and "evil" not in repr(answer)


@pytest.mark.parametrize(
    "query", ["", "?token=", "?token=wrong", "?token=right-toke", "?token=right-token%00", "?token=%ff"]
)
@pytest.mark.parametrize(
    "cookie", [None, "nectosome-8080=", "nectosome-8080=wrong", "nectosome-8081=right-token", "=;;=="]
)
def test_nobody_comes_in_from_elsewhere_without_the_token(query, cookie):
    assert status(REMOTE, "/" + query, Cookie=cookie) == 403
    assert status(REMOTE, "/" + query, Cookie=cookie, Upgrade="websocket", Origin="http://localhost:8080") == 403


def test_the_token_makes_a_cookie_which_opens_the_rest():
    answer = REMOTE.check(Headers(Host="there:8080"), "/?token=right-token", 8080)
    assert ("Set-Cookie", f"{COOKIE}; HttpOnly; SameSite=Strict; Path=/") in answer.headers
    assert ("Refresh", "0; url=/") in answer.headers and "right-token" not in answer.sentence
    assert status(REMOTE, Cookie=COOKIE) is None
    assert status(REMOTE, Cookie=f'other={{"a": "b"}}; {COOKIE}') is None  # of another server on this host


def test_a_websocket_needs_the_cookie_and_takes_no_token_in_its_address():
    socket = {"Upgrade": "websocket", "Origin": "http://localhost:8080"}
    assert status(REMOTE, "/?token=right-token", **socket) == 403
    assert status(REMOTE, "/", Cookie=COOKIE, **socket) is None


def test_a_token_is_made_where_others_can_reach():
    assert Gate.at("localhost").token is None and Gate.at("127.0.0.1").address(8080) == "http://127.0.0.1:8080/"
    first, second = Gate.at("192.0.2.1"), Gate.at("192.0.2.1")
    assert len(first.token) >= 43 and first.token != second.token  # 32 bytes
    assert first.address(8080) == f"http://192.0.2.1:8080/?token={first.token}"
    assert Gate("::1").address(8080) == "http://[::1]:8080/"
    for nothing in (None, ""):
        with pytest.raises(InputError, match="token"):
            Gate("192.0.2.1", nothing)


def test_an_empty_host_is_not_all_addresses():
    """As `--host "$HOST"` gives it where the variable is not set; a socket would listen everywhere."""
    with pytest.raises(InputError, match="--host is empty"):
        Gate.at("")


def test_a_token_can_be_asked_for_on_this_machine_too():
    gate = Gate("127.0.0.1", "right-token")
    assert status(gate) == 403 and status(gate, Cookie=COOKIE) is None
    assert status(gate, Cookie=COOKIE, Host="evil.example:8080") == 403
