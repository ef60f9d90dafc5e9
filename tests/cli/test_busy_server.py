"""Retries of commands on a busy server."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from tests.cli.conftest import Gaitswarm

pytestmark = pytest.mark.slow


@contextmanager
def server(busy: int) -> Iterator[tuple[str, list[str]]]:
    """Answers 503 so often, then an empty list; its URL, and the requests that it got."""
    asked: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def answer(self) -> None:
            length = int(self.headers.get("Content-Length") or 0)
            self.rfile.read(length)
            asked.append(f"{self.command} {self.headers.get('Idempotency-Key')}")
            body = b'{"items": [], "next": null}'
            self.send_response(503 if len(asked) <= busy else 200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        do_GET = do_POST = answer  # noqa: N815 - the names that http.server calls

        def log_message(self, *_: object) -> None:
            """Nothing."""

    listening = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=listening.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{listening.server_port}", asked
    finally:
        listening.shutdown()
        thread.join()
        listening.server_close()


def test_a_command_that_reads_asks_up_to_three_times(gaitswarm: Gaitswarm) -> None:
    for busy, code in ((2, 0), (3, 5)):
        with server(busy) as (url, asked):
            assert gaitswarm("list", "--server", url).code == code
        assert len(asked) == 3


def test_submit_asks_again_with_the_same_key(gaitswarm: Gaitswarm, small_spec: Path) -> None:
    with server(9) as (url, asked):
        assert gaitswarm("submit", "--spec", small_spec, "--server", url).code == 5
    assert len(asked) == 3
    assert len(set(asked)) == 1
    assert not asked[0].endswith(" None")


def test_a_command_that_changes_something_is_sent_once(gaitswarm: Gaitswarm) -> None:
    with server(9) as (url, asked):
        assert gaitswarm("pause", "k2q7zr5dm9xw", "--server", url).code == 5
    assert asked == ["POST None"]
