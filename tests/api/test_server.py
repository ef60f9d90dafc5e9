"""The server as a process: where it listens, and how it ends."""

from __future__ import annotations

import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from api.app import create_app
from api.server import ApiServer
from gaitswarm.settings import Settings
from services.optimizer.jobs.job import Job
from services.optimizer.service import JobService
from tests.examples.processes import loaded_by, output, start_python

PROGRAM = """
import sys
from api.app import create_app
from api.server import ApiServer
from gaitswarm.settings import Settings
from services.optimizer.service import JobService
from services.optimizer.store.sql_store import open_store

store = open_store(sys.argv[1])
settings = Settings(api_event_poll_seconds=60.0)
app = create_app(JobService(store), settings=settings)
server = ApiServer(app, host="127.0.0.1", port=0, shutdown_seconds=60)
print(server.url, flush=True)
server.run()
store.close()
print("closed", flush=True)
"""


@pytest.fixture
def process(database: Path) -> Iterator[subprocess.Popen[str]]:
    with start_python("-c", PROGRAM, database, stderr=None) as process:
        yield process
        process.kill()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_process_within_seconds_in_spite_of_open_streams(
    process: subprocess.Popen[str], job: Job, number: signal.Signals
) -> None:
    said = output(process.stdout)
    url = said.readline().strip()
    with httpx2.stream("GET", f"{url}/v1/jobs/{job.id}/events", timeout=20.0) as answer:
        lines = answer.iter_lines()
        assert next(lines) == "event: state"
        began = time.monotonic()
        process.send_signal(number)
        list(lines)

    assert said.readline() == "closed\n"
    assert process.wait(timeout=30.0) == 0
    assert time.monotonic() - began < 15.0


def test_the_url_of_a_free_port_is_known_before_the_first_request(service: JobService) -> None:
    app = create_app(service, settings=Settings())
    server = ApiServer(app, host="127.0.0.1", port=0)
    host, _, port = server.url.removeprefix("http://").partition(":")
    thread = threading.Thread(target=server.run)

    # The connection waits in the listening socket until the server runs.
    with socket.create_connection((host, int(port)), timeout=10.0) as connection:
        connection.sendall(b"GET /v1/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        thread.start()
        answer = connection.recv(64)
    server.stop()
    thread.join(timeout=10.0)
    assert answer.startswith(b"HTTP/1.1 200")
    assert not thread.is_alive()


def test_a_taken_port_is_an_error_at_once(service: JobService) -> None:
    app = create_app(service, settings=Settings())
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(OSError, match="in use"):
        ApiServer(app, host="127.0.0.1", port=taken.getsockname()[1])


@pytest.mark.slow
def test_the_api_brings_in_neither_ray_nor_a_database() -> None:
    statements = "import api.app, api.server, gaitswarm.requests.walk"
    assert loaded_by(statements, ["ray", "sqlalchemy", "alembic"]) == set()
