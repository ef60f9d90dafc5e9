"""A node of a Ray cluster ends when its raylet does, so that it is started again."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.faults.deployment import free_port
from benchmarks.faults.supervisor import descendants, title
from tests.examples.processes import eventually, line_with, python, start_python
from tests.worker import cluster_host


@pytest.fixture
def folder() -> Iterator[Path]:
    """Of Ray's files: a short path."""
    path = Path(tempfile.mkdtemp(prefix="grn-"))
    yield path
    shutil.rmtree(path, ignore_errors=True)


def is_alive(port: int) -> bool:
    """As a probe of liveness finds it."""
    return python("-m", "gaitswarm.services.worker.ray_node", "--check", str(port)).returncode == 0


@pytest.mark.thorough("a node that is started again by what supervises it")
@pytest.mark.slow
@pytest.mark.timeout(180)
def test_a_node_whose_raylet_ends_by_itself_ends_with_an_error_and_all_its_processes(
    folder: Path,
) -> None:
    port = free_port()
    node = start_python(
        *("-m", "gaitswarm.services.worker.ray_node", "--head", f"--port={port}", "--num-cpus=0"),
        *("--include-dashboard=false", "--include-log-monitor=false"),
        f"--object-store-memory={80 << 20}",
        environment=cluster_host.ray_environment(folder),
        start_new_session=True,
    )

    def agents() -> list[int]:
        return [pid for pid in descendants(node.pid) if "RuntimeEnvAgent" in title(pid)]

    try:
        line_with(node.stdout, "Ray runtime started")
        eventually(lambda: bool(agents()))
        below = descendants(node.pid)
        assert is_alive(port)
        os.kill(agents()[0], signal.SIGKILL)
        _, said = node.communicate(timeout=90)
        assert node.returncode == 1
        assert "the raylet has ended" in said
        assert not is_alive(port)
        eventually(lambda: not any("ray" in title(pid) for pid in below))
    finally:
        for pid in (*descendants(node.pid), node.pid):
            if node.poll() is None:
                os.kill(pid, signal.SIGKILL)
