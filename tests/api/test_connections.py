"""Clients that connect too often, send too much or dawdle, by real sockets before a real server."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from gaitswarm.api.connections import ConnectionLimits
from gaitswarm.services.optimizer.jobs.job import Job
from tests.api.conftest import Serve
from tests.examples.servers import Server

REQUEST = b"GET /v1/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"

Connect = Callable[[Server], socket.socket]


@pytest.fixture
def connect() -> Iterator[Connect]:
    """Connections that end with the test."""
    with ExitStack() as stack:

        def make(server: Server) -> socket.socket:
            url = server.url.removeprefix("http://")
            host, _, port = url.partition(":")
            return stack.enter_context(socket.create_connection((host, int(port)), timeout=10.0))

        yield make


def answer(connection: socket.socket) -> tuple[int | None, dict[str, str]]:
    """Status and problem that a connection ends with; None where it just ends."""
    received = b""
    while part := connection.recv(65536):
        received += part
    if not received:
        return None, {}
    head, _, body = received.partition(b"\r\n\r\n")
    return int(head.split()[1]), json.loads(body)


def ask(connection: socket.socket) -> bool:
    """Send a request, and read whether it is answered."""
    connection.sendall(REQUEST)
    received = b""
    while not received.endswith(b'{"status":"ok"}') and (part := connection.recv(65536)):
        received += part
    return received.startswith(b"HTTP/1.1 200")


def trickle(connection: socket.socket, head: bytes, byte: bytes) -> None:
    """Send something, and then single bytes until nobody takes them any more."""
    connection.sendall(head)
    ends = time.monotonic() + 10.0
    connection.setblocking(False)
    try:
        while time.monotonic() < ends:
            try:
                connection.send(byte)
                # What has been sent back ends the connection.
                if connection.recv(1, socket.MSG_PEEK) is not None:
                    return
            except BlockingIOError:
                time.sleep(0.05)
    finally:
        connection.settimeout(10.0)


def test_a_head_that_trickles_in_ends_its_connection(serve: Serve, connect: Connect) -> None:
    connection = connect(serve(api_head_seconds=0.4))
    begun = time.monotonic()
    trickle(connection, b"GET /v1/jobs HTTP/1.1\r\nX-Slow: ", b"a")
    status, problem = answer(connection)
    assert (status, problem["type"]) == (408, "urn:gaitswarm:problem:too-slow")
    assert 0.3 < time.monotonic() - begun < 5.0


def test_a_body_that_trickles_in_ends_its_connection(serve: Serve, connect: Connect) -> None:
    connection = connect(serve(api_body_seconds=0.4))
    head = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n"
    trickle(connection, head, b" ")
    status, problem = answer(connection)
    assert (status, problem["instance"]) == (408, "/v1/jobs")
    assert "body" in problem["detail"]


def test_a_body_that_nobody_reads_ends_its_connection_too(serve: Serve, connect: Connect) -> None:
    connection = connect(serve(api_body_seconds=0.4, api_idle_seconds=600))
    connection.sendall(REQUEST.replace(b"\r\n\r\n", b"\r\nContent-Length: 1000\r\n\r\n"))
    received = b""
    while part := connection.recv(65536):
        received += part
    assert received.startswith(b"HTTP/1.1 200") and received.endswith(b'{"status":"ok"}')


def test_a_connection_that_never_asks_is_closed_without_a_word(
    serve: Serve, connect: Connect
) -> None:
    assert answer(connect(serve(api_head_seconds=0.3))) == (None, {})


def test_a_connection_that_asks_no_more_is_closed(serve: Serve, connect: Connect) -> None:
    connection = connect(serve(api_idle_seconds=1, api_head_seconds=0.2))
    for _ in range(2):
        assert ask(connection)
        # Longer than a head may take: between two requests another time counts.
        time.sleep(0.5)
    begun = time.monotonic()
    assert connection.recv(65536) == b""
    assert time.monotonic() - begun < 5.0


def test_an_open_stream_is_none_of_these(serve: Serve, connect: Connect, job: Job) -> None:
    short = {"api_head_seconds": 0.2, "api_body_seconds": 0.2, "api_idle_seconds": 1}
    connection = connect(serve(**short))
    path = f"/v1/jobs/{job.id}/events".encode()
    connection.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: localhost\r\n\r\n")
    assert connection.recv(65536).startswith(b"HTTP/1.1 200")
    for _ in range(4):
        connection.settimeout(0.5)
        try:
            assert connection.recv(65536) != b""
        except TimeoutError:
            continue


@pytest.mark.parametrize(
    "head",
    [
        b"X-Long: " + b"a" * 40_000 + b"\r\n",
        b"".join(b"X-%d: a\r\n" % number for number in range(200)),
        b"".join(b"X-%d: aaaaaaaa\r\n" % number for number in range(20_000)),
    ],
    ids=["long", "many", "very-many"],
)
def test_heads_are_bounded(serve: Serve, connect: Connect, head: bytes) -> None:
    connection = connect(serve())
    try:
        connection.sendall(b"GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n")
        connection.sendall(head + b"\r\n")
    except (BrokenPipeError, ConnectionResetError):
        pass
    status, problem = answer(connection)
    assert (status, problem["type"]) == (431, "urn:gaitswarm:problem:headers-too-large")


def test_what_is_no_request_is_told_so(serve: Serve, connect: Connect) -> None:
    connection = connect(serve())
    connection.sendall(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 a greeting of TLS\r\n\r\n")
    status, problem = answer(connection)
    assert (status, problem["type"]) == (400, "urn:gaitswarm:problem:malformed-request")


def test_more_connections_than_may_be_are_refused_until_one_ends(
    serve: Serve, connect: Connect
) -> None:
    server = serve(api_max_connections=3)
    opened = [connect(server) for _ in range(3)]
    for connection in opened:
        assert ask(connection)
    status, problem = answer(connect(server))
    assert (status, problem["type"]) == (503, "urn:gaitswarm:problem:unavailable")
    opened[0].close()
    _answered_within_seconds(server, connect)


def test_one_address_has_only_its_share_of_them(serve: Serve, connect: Connect) -> None:
    server = serve(api_max_client_connections=2, api_trusted_proxies="192.0.2.1")
    opened = [connect(server) for _ in range(2)]
    status, problem = answer(connect(server))
    assert (status, problem["type"]) == (429, "urn:gaitswarm:problem:too-many-requests")
    opened[0].close()
    _answered_within_seconds(server, connect)


def test_a_trusted_proxy_may_have_them_all(serve: Serve, connect: Connect) -> None:
    server = serve(api_max_client_connections=1)
    for connection in [connect(server) for _ in range(3)]:
        assert ask(connection)


def test_proxies_are_trusted_by_address_or_network() -> None:
    limits = ConnectionLimits(trusted_proxies=("192.0.2.1", "172.16.0.0/12", "2001:db8::/32"))
    assert all(map(limits.trusts, ("192.0.2.1", "172.20.1.2", "2001:db8::1")))
    assert not any(map(limits.trusts, ("192.0.2.2", "127.0.0.1", "::1", "a-name", "")))


def test_the_word_of_a_proxy_that_is_not_trusted_is_not_taken(serve: Serve) -> None:
    server = serve(api_trusted_proxies="192.0.2.1", api_request_rate=0.001, api_request_burst=1)
    headers = {"X-Forwarded-For": "203.0.113.9", "X-Forwarded-Proto": "https"}
    # It would be counted as that client's otherwise; this machine's own requests are not.
    statuses = {server.client.get("/v1/scenarios", headers=headers).status_code for _ in range(4)}
    assert statuses == {200}


def _answered_within_seconds(server: Server, connect: Connect) -> None:
    """The server notices the end of a connection a moment after its client."""
    ends = time.monotonic() + 5.0
    while time.monotonic() < ends:
        connection = connect(server)
        try:
            if ask(connection):
                return
        except (BrokenPipeError, ConnectionResetError):
            pass
        connection.close()
    pytest.fail("no connection was given back")


def test_an_answer_does_not_wait_for_the_client_to_acknowledge_its_head(
    serve: Serve, connect: Connect
) -> None:
    connection = connect(serve())
    seconds = []
    for _ in range(60):
        begun = time.perf_counter()
        assert ask(connection)
        seconds.append(time.perf_counter() - begun)
    # A client acknowledges the first packets of a connection at once, later ones after 40 ms.
    assert min(seconds[30:]) < 0.03
