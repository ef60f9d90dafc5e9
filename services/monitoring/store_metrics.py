"""Metrics of the store: durations and errors of operations, commits, failures and leases"""

from __future__ import annotations

import threading
from typing import Final

import numpy as np

from gaitswarm.services.monitoring.metrics import Metrics, failure_cause
from gaitswarm.services.optimizer.errors import LeaseLost, StoreUnavailable
from gaitswarm.services.optimizer.jobs.estimate import duration
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.store import Observer
from gaitswarm.sim.outcome import Status

_REMEMBERED_LOSSES: Final = 256
"""Lost leases remembered, so that each is counted once."""


class StoreMetrics(Observer):
    """Measures what this process does with a store."""

    def __init__(self, metrics: Metrics) -> None:
        self._metrics = metrics
        self._lost: dict[tuple[str, int], None] = {}
        self._lock = threading.Lock()

    def transaction(self, operation: str, seconds: float, error: BaseException | None) -> None:
        self._metrics.database_seconds.labels(operation).observe(seconds)
        if isinstance(error, StoreUnavailable):
            self._metrics.database_errors.labels(operation).inc()

    def claimed(self, claim: Claim) -> None:
        if claim.taken_from is not None:
            self._metrics.lease_takeovers.inc()

    def committed(self, claim: Claim, done: CompletedIteration, state: JobState) -> None:
        spec = claim.job.spec
        self._metrics.iterations.labels(spec.kind).inc()
        self._metrics.iteration_seconds.observe(done.evaluate_seconds)
        walked = np.array([key is not None for key in done.keys] or [True] * len(done.fitness))
        statuses = np.concatenate([outcome.statuses[walked] for outcome in done.outcomes])
        designs = int(walked.sum())
        if done.reevaluation is not None:
            statuses = np.concatenate([statuses, np.ravel(done.reevaluation.statuses)])
            designs += 1
        values, counts = np.unique(statuses, return_counts=True)
        for value, count in zip(values.tolist(), counts.tolist(), strict=True):
            self._metrics.walks.labels(Status(value).label).inc(count)
        seconds = duration(spec, spec.cases(claim.recordings))
        self._metrics.simulated_seconds.inc(designs * seconds)
        if state.terminal:
            self._metrics.jobs_ended.labels(state, spec.kind).inc()

    def released(self, claim: Claim, state: JobState, error: str | None) -> None:
        if state is JobState.FAILED:
            self._metrics.jobs_ended.labels(state, claim.job.spec.kind).inc()
            self._metrics.job_failures.labels(failure_cause(error)).inc()

    def lost(self, claim: Claim, error: LeaseLost) -> None:
        lease = (claim.job.id, claim.token)
        with self._lock:
            if not error.taken_over or lease in self._lost:
                return
            self._lost[lease] = None
            if len(self._lost) > _REMEMBERED_LOSSES:
                del self._lost[next(iter(self._lost))]
        self._metrics.lease_losses.inc()

    def cancelled(self, job: Job) -> None:
        kind = job.spec.kind if job.readable else "unknown"
        self._metrics.jobs_ended.labels(job.state, kind).inc()
