"""A Ray cluster of several raylets on this machine, in a process of its own: it holds, adds, loses.

A process has one connection to Ray, and reads its token once; so the cluster, each runner and the
tests have a process each.
"""

from __future__ import annotations

import multiprocessing
import os
import secrets
import signal
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, ParamSpec, Self, TypeVar

from gaitswarm.services.worker.ray_evaluator import WORKER_ENVIRONMENT
from tests.examples.paths import ROOT

P = ParamSpec("P")
T = TypeVar("T")

_SMALL: dict[str, Any] = {
    "object_store_memory": 80 * 1024 * 1024,
    # A process of every node that walks have no use for.
    "include_log_monitor": False,
}

_cluster: Any = None
_nodes: dict[str, Any] = {}


class Process(AbstractContextManager["Process"]):
    """A Python process that runs functions one after the other."""

    def __init__(self) -> None:
        self._pool = ProcessPoolExecutor(
            1, mp_context=multiprocessing.get_context("spawn"), initializer=_end_with_parent
        )

    def run(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        return self.begin(function, *args, **kwargs)()

    def begin(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Callable[[], T]:
        """Let a function run; gives what waits for its result."""
        future = self._pool.submit(function, *args, **kwargs)
        return future.result

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown()


def _end_with_parent() -> None:
    """However the tests end, nothing of theirs goes on."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=wait, daemon=True).start()


def ray_environment(directory: Path) -> dict[str, str]:
    """For all processes of a cluster, as its manifests set it. directory: a short path."""
    return {
        **WORKER_ENVIRONMENT,
        "RAY_TMPDIR": str(directory),
        "PYTHONPATH": str(ROOT),
        "RAY_AUTH_MODE": "token",
        "RAY_AUTH_TOKEN": secrets.token_hex(16),
        "RAY_USAGE_STATS_ENABLED": "0",
        "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
        # So that the end of a node is noticed by Ray within a test's time.
        "RAY_health_check_period_ms": "1000",
        "RAY_health_check_timeout_ms": "1000",
        "RAY_health_check_failure_threshold": "2",
        "RAY_health_check_initial_delay_ms": "0",
    }


def start(port: int | None = None, cpus: int = 0) -> str:
    """Start a head; its address. port: where it listens, a free one by default."""
    global _cluster  # noqa: PLW0603 - the state of this process
    import ray.cluster_utils

    _cluster = ray.cluster_utils.Cluster()
    chosen = {} if port is None else {"gcs_server_port": port}
    _cluster.add_node(num_cpus=cpus, include_dashboard=False, no_monitor=True, **_SMALL, **chosen)
    return str(_cluster.address)


def add(cpus: int = 1, environment: Mapping[str, str] | None = None) -> str:
    """Add a node; its id."""
    before = dict(os.environ)
    os.environ.update(environment or {})
    try:
        node = _cluster.add_node(num_cpus=cpus, **_SMALL)
    finally:
        os.environ.clear()
        os.environ.update(before)
    _nodes[node.unique_id] = node
    return str(node.unique_id)


def lose(node_id: str) -> None:
    """Kill all processes of a node at once."""
    _cluster.remove_node(_nodes.pop(node_id), allow_graceful=False)


def nodes() -> list[str]:
    return list(_nodes)


def kill() -> None:
    """Kill all processes of the cluster at once."""
    _cluster.remove_node(_cluster.head_node, allow_graceful=False)


def stop() -> None:
    _cluster.shutdown()
