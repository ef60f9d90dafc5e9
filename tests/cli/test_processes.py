"""The command line as processes: signals and a server."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.services.runtime import open_store
from tests.cli.conftest import Gaitswarm, WriteJson
from tests.examples.forked import ForkedCommand
from tests.examples.jobs import SMALL_SPEC
from tests.examples.processes import eventually, line_with

pytestmark = pytest.mark.slow

SERVE = ("serve", "--port", "0", "--evaluator", "in-process")


@pytest.fixture
def server(db: Path) -> Iterator[str]:
    process = ForkedCommand(*SERVE, "--db", db)
    url = line_with(process.stderr, r"(http://[\d.:]+) and runs queued jobs").group(1)
    yield url
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 0


def test_a_job_submitted_to_a_server_is_run_by_it(
    gaitswarm: Gaitswarm, small_spec: Path, server: str
) -> None:
    where = ("--server", server)
    job_id = gaitswarm("submit", "--spec", small_spec, *where).out.strip()
    watched = gaitswarm("watch", job_id, *where)
    assert watched.code == 0, watched.err
    job = gaitswarm("status", job_id, *where, "--json").json
    assert job["state"] == "succeeded"
    assert gaitswarm("best", job_id, *where, "--json").json == job["best"]


def test_the_jobs_of_a_server_that_is_killed_are_free_after_the_lease_of_its_settings(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAITSWARM_LEASE_SECONDS", "3")
    spec = write_json(SMALL_SPEC | {"iterations": 1_000_000})
    job_id = gaitswarm("submit", "--spec", spec, "--db", db).out.strip()
    server = ForkedCommand(*SERVE, "--db", db)
    with closing(open_store(str(db))) as store:
        eventually(lambda: store.job(job_id).progress.iterations > 0)
        server.kill()
        server.communicate()
        killed = time.monotonic()
        eventually(lambda: store.claim("another", lease_seconds=3.0, job_id=job_id) is not None)
        assert time.monotonic() - killed < 15.0


def test_an_optimization_stopped_by_ctrl_c_resumes_to_the_same_result(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path, tmp_path: Path
) -> None:
    spec = write_json(SMALL_SPEC | {"iterations": 40})
    options = ("--spec", spec, "--evaluator", "in-process", "--json")
    process = ForkedCommand("optimize", *options, "--db", db)
    job_id = line_with(process.stderr, r"^job (\w+) in").group(1)
    line_with(process.stderr, r"^\d+/40 iterations")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    assert f"gaitswarm optimize --resume {job_id} --db {db}" in err
    stopped = gaitswarm("status", job_id, "--db", db, "--json").json
    assert stopped["state"] == "queued"
    assert 0 < stopped["iterations"] < 40

    resumed = gaitswarm("optimize", "--resume", job_id, "--db", db, *options[2:])
    assert resumed.code == 0, resumed.err
    other = tmp_path / "other.db"
    straight = gaitswarm("optimize", *options, "--db", other).json
    assert _bits(gaitswarm, job_id, db) == _bits(gaitswarm, straight["id"], other)


def _bits(gaitswarm: Gaitswarm, job_id: str, db: Path) -> Any:
    history = gaitswarm("history", job_id, "--db", db, "--json").json
    return [iteration["evaluations"] for iteration in history["iterations"]]


@pytest.mark.variants("optimize-2-*", "runner-*")
@pytest.mark.parametrize(
    ("command", "stop", "code"),
    [
        ("optimize", signal.SIGINT, 130),
        ("optimize", signal.SIGTERM, 130),
        ("runner", signal.SIGTERM, 0),
    ],
)
def test_a_stop_is_heard_while_a_cluster_is_connected_that_never_answers(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, command: str, stop: signal.Signals, code: int
) -> None:
    spec = ("--spec", small_spec) if command == "optimize" else ()
    with socket.create_server(("127.0.0.1", 0)) as cluster:
        address = f"127.0.0.1:{cluster.getsockname()[1]}"
        process = ForkedCommand(command, *spec, "--db", db, "--ray-address", address)
        cluster.settimeout(60.0)
        with cluster.accept()[0]:
            process.send_signal(stop)
            _, err = process.communicate(timeout=20)
    assert process.returncode == code
    assert "Traceback" not in err
    if command == "optimize":
        assert "to resume, run" in err
        (job,) = gaitswarm("list", "--db", db, "--json").json
        assert (job["state"], job["iterations"]) == ("queued", 0)


def test_an_optimization_fails_if_its_database_is_overwritten(
    gaitswarm: Gaitswarm, write_json: WriteJson, db: Path
) -> None:
    spec = write_json(SMALL_SPEC | {"iterations": 40})
    assert gaitswarm("submit", "--spec", spec, "--db", db).code == 0
    process = ForkedCommand("optimize", "--spec", spec, "--db", db, "--evaluator", "in-process")
    line_with(process.stderr, r"^\d+/40 iterations")
    db.write_bytes(os.urandom(db.stat().st_size))
    out, err = process.communicate(timeout=120)
    assert (process.returncode, out) == (5, "")
    assert f"gaitswarm: database {db}" in err
