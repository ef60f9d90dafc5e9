"""The server as a process: where it listens, and how it ends."""

from __future__ import annotations

import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx2
import pytest

from gaitswarm.api.app import create_app
from gaitswarm.api.server import ApiServer
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.settings import Settings
from tests.api import server_process
from tests.api.conftest import Serve
from tests.examples.forked import ForkedCommand
from tests.examples.jobs import LONG_SPEC
from tests.examples.processes import eventually, loaded_by, output
from tests.examples.servers import ServerProcess


@pytest.fixture
def process(database: Path) -> Iterator[ForkedCommand]:
    with ForkedCommand(database, program=server_process.main, stderr=None) as process:
        yield process
        process.kill()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_process_within_seconds_in_spite_of_open_streams(
    process: ForkedCommand, job: Job, number: signal.Signals
) -> None:
    said = output(process.stdout)
    url = said.readline().strip()
    with httpx2.stream(
        "GET", f"{url}/v1/jobs/{job.id}/events", timeout=20.0, verify=False
    ) as answer:
        lines = answer.iter_lines()
        assert next(lines) == "event: state"
        began = time.monotonic()
        process.send_signal(number)
        list(lines)

    assert said.readline() == "closed\n"
    assert process.wait(timeout=30.0) == 0
    assert time.monotonic() - began < 15.0


def test_a_server_that_drains_answers_and_says_that_it_is_not_ready(serve: Serve, job: Job) -> None:
    drains, drained = threading.Event(), threading.Event()

    def drain(_: threading.Event) -> None:
        drains.set()
        drained.wait()

    server = serve(drain=drain)
    try:
        with server.client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
            lines = answer.iter_lines()
            assert next(lines) == "event: state"
            server.stop()
            assert drains.wait(20.0)
            unready = httpx2.get(f"{server.url}/v1/readyz", verify=False)
            assert unready.status_code == 503
            assert unready.json()["type"] == "urn:gaitswarm:problem:draining"
            assert unready.headers["Retry-After"]
            assert httpx2.get(f"{server.url}/v1/healthz", verify=False).status_code == 200
            assert httpx2.get(f"{server.url}/v1/jobs/{job.id}", verify=False).status_code == 200
            drained.set()
            assert "retry: 1000" in list(lines)
    finally:
        drained.set()


@pytest.mark.slow
def test_a_served_job_commits_its_iteration_under_way_before_the_server_ends(
    store: Store, database: Path
) -> None:
    server = ServerProcess(database, "--evaluator", "in-process", "--cpus", "1")
    try:
        job_id = server.submit(LONG_SPEC | {"optimizer": {"name": "pso", "particles": 60}})
        eventually(lambda: store.job(job_id).progress.iterations > 0)
        before = store.job(job_id).progress.iterations
        server.process.send_signal(signal.SIGTERM)
        eventually(lambda: server.client.get("/v1/readyz").status_code == 503)
        assert server.process.wait(timeout=60.0) == 0
    finally:
        server.close()
    ended = store.job(job_id)
    assert (ended.state, ended.progress.iterations) == (JobState.QUEUED, before + 1)


def test_the_url_of_a_free_port_is_known_before_the_first_request(service: JobService) -> None:
    app = create_app(service, settings=Settings())
    server = ApiServer(app, Settings(api_port=0))
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


def test_requests_beyond_the_connection_limit_get_503(serve: Serve) -> None:
    server = serve(api_max_connections=3)
    with ExitStack() as stack:
        clients = [
            stack.enter_context(httpx2.Client(base_url=server.url, verify=False)) for _ in range(3)
        ]
        assert [c.get("/v1/healthz").status_code for c in clients] == [200, 200, 503]
        clients[0].close()
        eventually(lambda: clients[1].get("/v1/healthz").status_code == 200)


def test_a_taken_port_is_an_error_at_once(service: JobService) -> None:
    app = create_app(service, settings=Settings())
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(OSError, match="in use"):
        ApiServer(app, Settings(api_port=taken.getsockname()[1]))


@pytest.mark.thorough("every module in a fresh process")
@pytest.mark.slow
def test_views_need_no_web_framework_and_the_api_neither_ray_nor_a_database_nor_scipy() -> None:
    statements = (
        "import gaitswarm.views.job, gaitswarm.services.optimizer.jobs.designs, sys\n"
        "assert not {'fastapi', 'starlette', 'uvicorn'} & set(sys.modules)\n"
        "import gaitswarm.api.app, gaitswarm.api.app"
    )
    assert loaded_by(statements, ["ray", "sqlalchemy", "alembic", "scipy"]) == set()
