"""A runner on a cluster, in a process of its own."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from gaitswarm.services.worker.cluster import nodes, pump, ray_nodes
from gaitswarm.services.worker.cluster.shares import REPORT_SECONDS
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.sim.case import Walk
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Objective, Outcome
from gaitswarm.sim.robot import RobotSource
from tests.examples.processes import eventually
from tests.worker.requests import bits, never

Bits = list[tuple[bytes, bytes]]

_evaluator: RayEvaluator
_log = StringIO()


@dataclass(frozen=True, slots=True)
class InPlaceOfWalk:
    """A case that needs what a walk needs."""

    walk: Walk

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        return self.walk.robots

    @property
    def precision(self) -> Precision:
        return self.walk.precision

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return self.walk.objectives


@dataclass(frozen=True, slots=True)
class Sleep(InPlaceOfWalk):
    """It takes a minute and comes to nothing."""

    name = "sleep"
    duration = 1000.0

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        until = time.monotonic() + 60.0
        while time.monotonic() < until:
            time.sleep(0.01)  # at most so long a cancellation waits, as between steps of a search
        raise AssertionError("it was not cancelled")


@dataclass(frozen=True, slots=True)
class Slow(InPlaceOfWalk):
    """A walk that begins after a while, in which others may compute."""

    name = "slow"
    duration = 1000.0

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        time.sleep(0.2)
        return self.walk.run(designs)


@dataclass(frozen=True, slots=True)
class Deadly(InPlaceOfWalk):
    """It ends its process, and leaves the id of its node in a file."""

    deaths: Path
    name = "deadly"
    duration = 1.0

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        import ray

        with self.deaths.open("a") as file:
            file.write(f"{ray.get_runtime_context().get_node_id()}\n")
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError(designs)


def connect(address: str, patience: float = nodes.PATIENCE_SECONDS) -> None:
    """patience: seconds to wait for a node."""
    global _evaluator  # noqa: PLW0603 - the state of this process
    for module in (ray_nodes, pump):
        vars(module)["PATIENCE_SECONDS"] = patience
    # Ray lets workers import from where a driver was started, here a checkout.
    os.chdir("/")
    logging.getLogger("gaitswarm.services").addHandler(logging.StreamHandler(_log))
    _evaluator = RayEvaluator(address)
    _evaluator.wait_until_open(never)


def connect_from_elsewhere(address: str) -> None:
    """As from a machine that is no node of the cluster."""
    with patch("gaitswarm.services.worker.ray_session.comes_here", lambda _host, _port: False):
        connect(address)


def nodes_of_cluster() -> list[int]:
    """CPUs of each node that is alive."""
    import ray

    return [int(n["Resources"].get("CPU", 0)) for n in ray.nodes() if n["Alive"]]  # type: ignore[no-untyped-call]


def evaluate(request: EvaluationRequest) -> Bits:
    return bits(_evaluator.evaluate(request, never))


def why_not(request: EvaluationRequest) -> str:
    """What is said of a request that cannot be walked now."""
    try:
        evaluate(request)
    except EvaluatorUnavailable as error:
        return str(error)
    return "it was walked"


def begin_and_stop(request: EvaluationRequest, seconds: float) -> str:
    """Let a request go after some seconds."""
    stop = threading.Event()
    threading.Timer(seconds, stop.set).start()
    try:
        _evaluator.evaluate(request, stop.is_set)
    except EvaluationStopped:
        return "stopped"
    return "not stopped"


def ready_nodes(request: EvaluationRequest) -> int:
    """Nodes that are prepared for a request."""
    link: Any = vars(_evaluator)["_link"]
    known: Iterable[nodes.Node] = vars(link.nodes.result())["_nodes"].values()
    return sum(nodes.Wanted.by(request) in node.prepared for node in known)


def slots() -> int:
    return _evaluator.slots


def least_slots(request: EvaluationRequest, expected: int) -> int:
    """The fewest slots that this runner had while it walked, for half a minute at most.

    Once these are as expected, it walks on until each runner has reported once more.
    """
    fewest = sys.maxsize
    until = time.monotonic() + 30.0

    def look() -> bool:
        nonlocal fewest, until
        before, fewest = fewest, min(fewest, _evaluator.slots)
        if fewest <= expected < before:
            until = time.monotonic() + 2.0 * REPORT_SECONDS
        return time.monotonic() > until

    with suppress(EvaluationStopped):
        _evaluator.evaluate(request, look)
    return fewest


def demand_shown(request: EvaluationRequest | None, expected: int) -> int:
    """Slots that an autoscaler sees to be wanted, once they are as expected or half a minute later.

    request: what is walked meanwhile.
    """
    import ray
    from ray.autoscaler.v2.sdk import get_cluster_resource_state

    worker: Any = ray._private.worker.global_worker  # noqa: SLF001
    until = time.monotonic() + 30.0
    seen = 0

    def look() -> bool:
        nonlocal seen
        pending = get_cluster_resource_state(worker.gcs_client).pending_resource_requests
        seen = sum(asked.count for asked in pending)
        return seen == expected or time.monotonic() > until

    if request is None:
        eventually(look)
    else:
        with suppress(EvaluationStopped):
            _evaluator.evaluate(request, look)
    return seen


def logged() -> str:
    return _log.getvalue()


def disconnect() -> None:
    _evaluator.close()
