"""Logs of real processes: what messages belong to, and that outages are no tracebacks."""

from __future__ import annotations

import io
import json
import logging
import os
import re
import sqlite3
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx2
import pytest
from starlette.requests import Request
from starlette.responses import StreamingResponse

from gaitswarm.cli.commands.serve import JsonFormatter
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.log_context import log_context, log_fields
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.examples.forked import ForkedCommand
from tests.examples.jobs import SMALL_SPEC
from tests.examples.processes import eventually
from tests.examples.servers import Server
from tests.optimizer.formula import HERE, SPEC, FormulaEvaluator

Entry = dict[str, Any]


def logged(database: Path, visit: Callable[[httpx2.Client], None], **settings: str) -> list[str]:
    """Lines that `gaitswarm serve` wrote to standard error while it was visited."""
    options = ("--db", str(database), "--port", "0", "--evaluator", "in-process", "--cpus", "1")
    path = database.with_suffix(".log")
    with path.open("w", encoding="utf-8") as log:
        process = ForkedCommand("serve", *options, environment=settings, stdout=None, stderr=log)
    try:
        eventually(lambda: "serves http" in path.read_text(encoding="utf-8"))
        url = path.read_text(encoding="utf-8").partition("serves ")[2].split()[0]
        with httpx2.Client(base_url=url, timeout=60.0, verify=False) as client:
            visit(client)
    finally:
        process.terminate()
        process.wait(timeout=60.0)
    return path.read_text(encoding="utf-8").splitlines()


def run_a_job(client: httpx2.Client) -> None:
    job = client.post("/v1/jobs", json=SMALL_SPEC).json()["id"]
    client.get(f"/v1/jobs/{job}/events", timeout=120.0)


def lose_the_database(path: Path, client: httpx2.Client) -> None:
    """Overwrite a database in use with garbage, and ask until an answer is missing.

    What the server has read stays good to it until something is committed: that is done last.
    """
    with closing(sqlite3.connect(path, timeout=30.0, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        other.execute("CREATE TABLE lost (found)")
        for file in (path, path.with_name(f"{path.name}-wal")):
            if file.exists() and file.stat().st_size:
                with file.open("r+b") as raw:
                    raw.write(os.urandom(file.stat().st_size))
        other.execute("COMMIT")

    def is_away() -> bool:
        answer = client.get("/v1/jobs", headers={"X-Request-ID": "my-request.1"})
        assert answer.headers["X-Request-ID"] == "my-request.1"
        return answer.status_code == 503

    eventually(is_away)


@pytest.mark.slow
def test_in_json_every_line_is_an_object_with_its_context(database: Path) -> None:
    def visit(client: httpx2.Client) -> None:
        run_a_job(client)
        lose_the_database(database, client)

    lines = logged(database, visit, GAITSWARM_LOG_FORMAT="json")
    entries: list[Entry] = [json.loads(line) for line in lines]
    for entry in entries:
        assert {"time", "level", "logger", "message"} <= set(entry)
        assert "traceback" not in entry
    (ended,) = [e for e in entries if "succeeded after 2 iterations" in e["message"]]
    assert ended["job"] in ended["message"] and ended["level"] == "info"
    away = [e for e in entries if e["message"].startswith("GET '/v1/jobs': ")]
    assert away and {e["request"] for e in away} == {"my-request.1"}
    assert {e["level"] for e in away} == {"error"}
    assert "Traceback" not in "".join(lines)


@pytest.mark.slow
def test_on_the_console_an_outage_is_a_line_and_no_traceback(database: Path) -> None:
    def visit(client: httpx2.Client) -> None:
        lose_the_database(database, client)

    lines = logged(database, visit)
    assert any(" ERROR GET '/v1/jobs': database " in line for line in lines), lines
    assert "Traceback" not in "".join(lines)


@pytest.fixture
def written() -> Iterator[Callable[[], list[Entry]]]:
    """What this process logs in the test, as JSON."""
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(JsonFormatter())
    root = logging.getLogger()
    root.addHandler(handler)
    yield lambda: [json.loads(line) for line in stream.getvalue().splitlines()]
    root.removeHandler(handler)


def test_a_bug_in_an_evaluation_is_one_line_with_job_iteration_and_traceback(
    store: Store, written: Callable[[], list[Entry]]
) -> None:
    job, _ = store.create_job(SPEC)
    claim = store.claim("runner", lease_seconds=30.0)
    assert claim is not None
    evaluator = FormulaEvaluator([None, ZeroDivisionError("of the test")])
    run_claim(claim, RunContext(store, evaluator, provenance=lambda _: HERE))
    (bug,) = [entry for entry in written() if "traceback" in entry]
    assert (bug["job"], bug["iteration"], bug["level"]) == (job.id, 1, "error")
    assert bug["traceback"].endswith("ZeroDivisionError: of the test")
    assert log_fields() == {}


def test_a_context_ends_with_its_block() -> None:
    with log_context(job="a", iteration=None):
        with log_context(iteration=3):
            assert log_fields() == {"job": "a", "iteration": 3}
        assert log_fields() == {"job": "a"}
    assert log_fields() == {}


def test_an_aborted_response_is_one_line(store: Store, written: Callable[[], list[Entry]]) -> None:
    async def pieces() -> AsyncIterator[bytes]:
        yield b"the first piece"
        raise StoreUnavailable("the database is away")

    async def cut(_request: Request) -> StreamingResponse:
        return StreamingResponse(pieces())

    server = Server(JobService(store))
    server.app.add_route("/cut", cut)
    try:
        with pytest.raises(httpx2.RemoteProtocolError):
            server.client.get("/cut", headers={"X-Request-ID": "cut"})
    finally:
        server.close()
    (entry,) = [e for e in written() if e["logger"] == "gaitswarm.api"]
    assert (
        entry["request"] == "cut" and "response aborted: the database is away" in entry["message"]
    )
    assert not any("traceback" in e for e in written())


def test_invalid_request_ids_are_replaced(lasting_server: Server) -> None:
    for bad in ("a b", "x" * 129, 'a"b', "é"):
        answer = lasting_server.client.get("/v1/healthz", headers={b"X-Request-ID": bad.encode()})
        assert re.fullmatch("[0-9a-f]{32}", answer.headers["X-Request-ID"])
