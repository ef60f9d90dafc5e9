"""A runner on a cluster, in a process of its own."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from typing import Any
from unittest.mock import patch

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, ProvenanceChanged
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.runtime import run_embedded
from gaitswarm.services.worker import ray_evaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from tests.examples.processes import eventually
from tests.worker.requests import bits, never

Bits = list[tuple[bytes, bytes]]

_evaluator: RayEvaluator


def connect(address: str) -> None:
    """Requests fail after a second without a CPU."""
    global _evaluator  # noqa: PLW0603 - the state of this process
    vars(ray_evaluator).update(EMPTY_SECONDS=1.0, PULSE_SECONDS=0.3)
    # Ray lets workers import from where a driver was started, here a checkout.
    os.chdir("/")
    _evaluator = RayEvaluator(address)
    _evaluator.wait_until_open(never)


def connect_from_elsewhere(address: str) -> None:
    """As from a machine that is no node of the cluster."""
    with patch("gaitswarm.services.worker.ray_evaluator.comes_here", lambda _host, _port: False):
        connect(address)


def wait_for_slots(count: int) -> None:
    eventually(lambda: _evaluator.slots == count)


def nodes_of_cluster() -> list[int]:
    """CPUs of each node that is alive."""
    import ray

    return [int(n["Resources"].get("CPU", 0)) for n in ray.nodes() if n["Alive"]]  # type: ignore[no-untyped-call]


def evaluate(request: EvaluationRequest) -> Bits:
    return bits(_evaluator.evaluate(request, never))


def reason_against(request: EvaluationRequest) -> str:
    """Why a request cannot be evaluated now."""
    try:
        evaluate(request)
    except (EvaluatorUnavailable, ProvenanceChanged) as error:
        return f"{type(error).__name__}: {error}"
    return "it was evaluated"


def run_job(database: str, job_id: str) -> str:
    """Run a job of a database to its end; its state."""
    store = open_store(database)
    try:
        return str(run_embedded(store, _evaluator, job_id).state)
    finally:
        store.close()


def demand_seen(request: EvaluationRequest) -> int:
    """CPUs that an autoscaler sees to be missing while a request is evaluated; 0 after 30 s."""
    import ray
    from ray.autoscaler.v2.sdk import get_cluster_resource_state

    worker: Any = ray._private.worker.global_worker  # noqa: SLF001
    until = time.monotonic() + 30.0
    seen = 0

    def look() -> bool:
        nonlocal seen
        pending = get_cluster_resource_state(worker.gcs_client).pending_resource_requests
        seen = sum(requested.count for requested in pending)
        return seen > 0 or time.monotonic() > until

    with suppress(EvaluationStopped):
        _evaluator.evaluate(request, look)
    return seen


def disconnect() -> None:
    _evaluator.close()
