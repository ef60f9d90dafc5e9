"""Runs one stored job to its end, or several at once to their middle; processes to be killed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.run import runner
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.runtime import open_evaluator, open_store, run_embedded
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.sim.case import Walk
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.outcome import Objective, Outcome
from gaitswarm.sim.robot import RobotSource

LEASE: Final = 0.3


def main(url: str, job_id: str, kind: str, connection: Connection) -> None:
    """Evaluate on `kind`; the state of the job's search is sent after every commit."""
    # The next process does not wait for long for the lease of one that was killed.
    vars(runner)["EMBEDDED_LEASE_SECONDS"] = 1.0
    store = open_store(url)
    # On Ray from the first walk on, however short the job is.
    evaluator = RayEvaluator(cpus=2) if kind == "ray" else open_evaluator("in-process", cpus=2)
    run_embedded(
        store,
        evaluator,
        job_id,
        on_iteration=lambda _: connection.send(str(store.job(job_id).state)),
    )
    evaluator.close()
    store.close()


def run_to_the_middle(url: str, middles: Mapping[str, int], connection: Connection) -> None:
    """Run jobs at once, each up to an iteration whose walks never end; send its id then."""
    evaluator = _Halting(middles, connection.send)
    Runner(open_store(url), evaluator, concurrency=len(middles), poll_seconds=0.01).start()
    threading.Event().wait()


@dataclass(frozen=True, slots=True)
class LongWalk:
    """A `LongCase`, a walk, which is noted in a file; after some designs it never ends."""

    walk: Walk
    log: Path
    most: int
    duration = 1000.0

    @property
    def name(self) -> str:
        return self.walk.name

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        return self.walk.robots

    @property
    def precision(self) -> Precision:
        return self.walk.precision

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return self.walk.objectives

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        with self.log.open("a+", encoding="utf-8") as file:
            file.seek(0)
            if len(file.readlines()) + len(designs) > self.most:
                threading.Event().wait()
            file.write(f"{self.name}\n" * len(designs))
        return self.walk.run(designs)

    def run_until(self, designs: NDArray[np.float64], _: Callable[[], bool]) -> Outcome:
        return self.run(designs)


class LongEvaluator(InProcessEvaluator):
    """Runs every walk as a `LongWalk`."""

    def __init__(self, log: Path, most: int = 1000) -> None:
        super().__init__(1)
        self._log, self._most = log, most

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        walks = [case for case in request.cases if isinstance(case, Walk)]
        cases = tuple(LongWalk(walk, self._log, self._most) for walk in walks)
        return super().evaluate(replace(request, cases=cases), should_stop)


def run_endlessly(url: str, most: int, log: Path) -> None:
    """Run the next job, whose iterations are journaled from their start, for some designs."""
    store = open_store(url)
    claim = store.claim("killed", lease_seconds=LEASE)
    assert claim is not None
    context = RunContext(store, LongEvaluator(log, most), lease_seconds=LEASE, journal_seconds=0.0)
    run_claim(claim, context)


class _Halting(InProcessEvaluator):
    """Runs walks, but those of an iteration of each job for ever."""

    def __init__(self, middles: Mapping[str, int], on_halt: Callable[[str], None]) -> None:
        super().__init__(2)
        self._middles, self._on_halt, self._one = middles, on_halt, threading.Lock()

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        outcomes = super().evaluate(request, should_stop)
        if request.iteration == self._middles[request.job_id]:
            with self._one:
                self._on_halt(request.job_id)
            threading.Event().wait()
        return outcomes
