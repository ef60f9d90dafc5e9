"""A server is started while its cluster is away, which then comes, is killed and comes back."""

from __future__ import annotations

import shutil
import signal
import socket
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final

import pytest

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.runtime import run_embedded
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from tests.examples.forked import ForkedCommand
from tests.examples.jobs import LONG_SPEC, SMALL_SPEC
from tests.examples.processes import eventually, line_with
from tests.examples.servers import ServerProcess
from tests.worker import cluster_host
from tests.worker.cluster_host import Process

KILLED: Final = LONG_SPEC | {"iterations": 2}
"""Long enough that a head is killed in the midst of its last iteration."""

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """For all processes of the test."""
    directory = Path(tempfile.mkdtemp(prefix="gsc-"))
    for name, value in cluster_host.ray_environment(directory).items():
        monkeypatch.setenv(name, value)
    yield
    shutil.rmtree(directory, ignore_errors=True)


@pytest.fixture
def host(environment: None) -> Iterator[Process]:
    """Holds one cluster after the other."""
    with Process() as process:
        yield process


@contextmanager
def cluster(host: Process, port: int) -> Iterator[None]:
    """A head with a CPU that listens at a port; at the end it is killed."""
    host.run(cluster_host.start, port=port, cpus=1)
    try:
        yield
    finally:
        host.run(cluster_host.kill)


def workers(server: ServerProcess) -> tuple[str, str]:
    """What the server says of its workers: status and detail."""
    answer = server.client.get("/v1/readyz")
    assert answer.status_code == 200
    (found,) = [part for part in answer.json()["components"] if part["name"] == "workers"]
    return found["status"], found["detail"]


def head_alone(spec: dict[str, Any], folder: Path) -> str | None:
    """The last digest of a job that runs in this process, where nothing goes wrong."""
    with (
        closing(open_store(str(folder / "alone.db"))) as store,
        closing(InProcessEvaluator(1)) as evaluator,
    ):
        job, _ = store.create_job(JobSpec.model_validate(spec))
        return run_embedded(store, evaluator, job.id).progress.head


@pytest.mark.thorough(
    "test_a_runner_that_waits_for_its_cluster_ends_when_it_is_stopped",
)
def test_a_server_waits_for_its_cluster_and_a_job_whose_head_is_killed_has_the_same_bits(
    host: Process, database: Path, tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as reserved:
        port = reserved.getsockname()[1]
    server = ServerProcess(database, "--evaluator", "ray", "--ray-address", f"127.0.0.1:{port}")
    try:
        missing = f"retrying: no Ray cluster listens at '127.0.0.1:{port}'; is it up?"
        eventually(lambda: workers(server) == ("degraded", missing))
        first = server.submit(SMALL_SPEC)
        eventually(lambda: "no Ray cluster listens" in (server.job(first)["waiting"] or ""))
        with cluster(host, port):
            ended = server.wait_for(first, "succeeded", seconds=240.0)
            assert ended["waiting"] is None
            assert workers(server) == ("ok", "")
            second = server.submit(KILLED)
            eventually(lambda: server.job(second)["iterations"] >= 1)
        # It was killed in the midst of an iteration: there is hardly any time between two.
        eventually(lambda: server.job(second)["waiting"] is not None)
        assert server.job(second)["iterations"] < KILLED["iterations"]
        # While it is tried again, it may be there.
        eventually(lambda: workers(server)[0] == "degraded")
        with cluster(host, port):
            again = server.wait_for(second, "succeeded", seconds=240.0)
        assert again["head"] == head_alone(KILLED, tmp_path)
    finally:
        server.close()


def test_a_runner_that_waits_for_its_cluster_ends_when_it_is_stopped(
    environment: None, database: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as reserved:
        address = f"127.0.0.1:{reserved.getsockname()[1]}"
    runner = ForkedCommand(
        *("runner", "--db", database, "--evaluator", "ray", "--ray-address", address)
    )
    line_with(runner.stderr, "ready: 0 slots")
    line_with(runner.stderr, f"jobs wait for workers: .* no Ray cluster .*'{address}'")
    runner.send_signal(signal.SIGTERM)
    assert runner.wait(timeout=60.0) == 0
    runner.communicate()
