"""Simulations by formula: a fast, deterministic evaluator with given failures"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, with_record
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.case import Walk
from gaitswarm.sim.outcome import Outcome, Status
from gaitswarm.sim.provenance import Provenance

SPEC = JobSpec.model_validate(
    {
        "name": "formula",
        "controller": "pi",
        "scenarios": ["normal-fast", "slope-fast"],
        "optimizer": {"name": "pso", "particles": 4, "inertia_end": 0.7},
        "iterations": 6,
        "seed": 11,
    }
).resolved()


SINGLE = SPEC.model_copy(update={"precision": "single"})
"""The same job, searched in single precision."""

LEASE = 3.0
"""Of a job that is run here [s]: long enough that beats come in time on a busy machine."""

BRISK = 0.3
"""The same where a beat is waited for."""


HERE = JobProvenance(
    gaitswarm="1.0",
    optimizer_digest="search",
    simulation=Provenance(
        robot="szabadka2",
        robot_digest="robot",
        code_digest="code",
        libraries={"numpy": "2.0"},
        backend="native",
    ),
)


def job(spec: AnySpec = SPEC, state: JobState = JobState.RUNNING) -> Job:
    now = datetime(2026, 1, 1, tzinfo=UTC)
    return Job("a-job", spec, state, now, now, provenance=with_record((), 0, HERE))


def walk(request: EvaluationRequest) -> tuple[Outcome, ...]:
    """Objectives that depend on every variable and scenario; one design in seven falls."""
    outcomes = []
    for case in request.cases:
        assert isinstance(case, Walk)
        scenario = case.scenario
        scale = scenario.cycle_time + scenario.slope + np.arange(1.0, 1.0 + len(case.objectives))
        objectives = np.abs(request.designs.sum(axis=1, keepdims=True) - 0.7) * scale + 0.01
        statuses = np.full(len(request.designs), Status.OK, dtype=np.uint8)
        fallen = np.floor(request.designs[:, 0] * 1e6) % 7 == 0
        statuses[fallen] = Status.FELL
        objectives[fallen] = np.nan
        if case.precision == "single":
            objectives = objectives.astype(np.float32).astype(np.float64)
        outcomes.append(Outcome(objectives, statuses))
    return tuple(outcomes)


class FormulaEvaluator:
    """`Evaluator`. errors: raised by the first calls, one each; None lets a call succeed.

    hold: while set, evaluations wait until they are stopped or it is cleared.
    """

    slots = 1

    def __init__(self, errors: Iterable[Exception | None] = ()) -> None:
        self.errors = list(errors)
        self.calls = 0
        self.hold = threading.Event()
        self.entered = threading.Event()

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        self.calls += 1
        self.entered.set()
        error = self.errors.pop(0) if self.errors else None
        if error is not None:
            raise error
        while self.hold.is_set():
            if should_stop():
                raise EvaluationStopped
            threading.Event().wait(0.005)
        return walk(request)

    def close(self) -> None:
        pass


class TradeOff(FormulaEvaluator):
    """Walks that are the faster the greater the gains, whatever else that costs."""

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        outcomes = super().evaluate(request, should_stop)
        gains = request.designs.sum(axis=1, keepdims=True)
        for outcome in outcomes:
            outcome.objectives[:, 4:5] = 1.0 / (0.1 + gains)
        return outcomes


def queue(store: Store, spec: JobSpec = SPEC) -> str:
    job, _ = store.create_job(spec)
    return job.id


def run(
    store: Store,
    evaluator: FormulaEvaluator,
    stop: threading.Event | None = None,
    *,
    lease_seconds: float = LEASE,
    **given: object,
) -> Job:
    claim = store.claim("runner", lease_seconds=lease_seconds)
    assert claim is not None
    around = replace(RunContext(store, evaluator, lease_seconds=lease_seconds), **given)  # type: ignore[arg-type]
    return run_claim(claim, around, stop)
