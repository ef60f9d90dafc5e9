"""Store wrapper that measures operations and counts commits, failures and leases"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import wraps
from typing import Any, Final, cast

import numpy as np

from gaitswarm.services.monitoring.metrics import Metrics, failure_cause
from gaitswarm.services.optimizer.errors import LeaseLost, StoreUnavailable
from gaitswarm.services.optimizer.jobs.estimate import duration
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobState
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.sim.outcome import Status

_REMEMBERED_LOSSES: Final = 256
"""Lost leases remembered, so that each is counted once."""


def measured(store: Store, metrics: Metrics) -> Store:
    """Wrap a store so that its operations are measured."""
    return cast(Store, _MeasuredStore(store, metrics))


class _Measured:
    """An object whose method calls are timed."""

    def __init__(self, inner: Any, metrics: Metrics, prefix: str = "") -> None:
        self._inner = inner
        self._metrics = metrics
        self._prefix = prefix

    def __getattr__(self, name: str) -> Any:
        member = getattr(self._inner, name)
        return self._timed(name, member) if callable(member) else member

    def _timed(self, name: str, method: Callable[..., Any]) -> Callable[..., Any]:
        operation = f"{self._prefix}{name}"

        @wraps(method)
        def timed(*args: Any, **kwargs: Any) -> Any:
            begun = time.perf_counter()
            try:
                return method(*args, **kwargs)
            except StoreUnavailable:
                self._metrics.database_errors.labels(operation).inc()
                raise
            finally:
                elapsed = time.perf_counter() - begun
                self._metrics.database_seconds.labels(operation).observe(elapsed)

        return timed


class _MeasuredStore(_Measured):
    """Also counts the results of operations by runners and users."""

    def __init__(self, store: Store, metrics: Metrics) -> None:
        super().__init__(store, metrics)
        self._lost: dict[tuple[str, int], None] = {}
        self._losing = threading.Lock()

    @property
    def tokens(self) -> Any:
        return _Measured(self._inner.tokens, self._metrics, "token_")

    @property
    def outbox(self) -> Any:
        return _Measured(self._inner.outbox, self._metrics, "notification_")

    def claim(self, *args: Any, **kwargs: Any) -> Claim | None:
        claim: Claim | None = self._timed("claim", self._inner.claim)(*args, **kwargs)
        if claim is not None and claim.taken_from is not None:
            self._metrics.lease_takeovers.inc()
        return claim

    def renew(self, claim: Claim, *args: Any, **kwargs: Any) -> Any:
        return self._held("renew", claim, *args, **kwargs)

    def record_provenance(self, claim: Claim, *args: Any, **kwargs: Any) -> Any:
        return self._held("record_provenance", claim, *args, **kwargs)

    def begin(self, claim: Claim, *args: Any, **kwargs: Any) -> Any:
        return self._held("begin", claim, *args, **kwargs)

    def commit(self, claim: Claim, done: CompletedIteration, *args: Any, **kwargs: Any) -> JobState:
        state: JobState = self._held("commit", claim, done, *args, **kwargs)
        self._count_iteration(claim, done)
        if state.terminal:
            self._metrics.jobs_ended.labels(state, claim.job.spec.kind).inc()
        return state

    def release(self, claim: Claim, state: JobState, *args: Any, **kwargs: Any) -> None:
        self._held("release", claim, state, *args, **kwargs)
        if state is JobState.FAILED:
            self._metrics.jobs_ended.labels(state, claim.job.spec.kind).inc()
            self._metrics.job_failures.labels(failure_cause(kwargs.get("error"))).inc()

    def command(self, job_id: str, command: Command, *args: Any, **kwargs: Any) -> Job:
        job: Job = self._timed("command", self._inner.command)(job_id, command, *args, **kwargs)
        if job.state is JobState.CANCELLED:
            kind = job.spec.kind if job.readable else "unknown"
            self._metrics.jobs_ended.labels(job.state, kind).inc()
        return job

    def _held(self, name: str, claim: Claim, *args: Any, **kwargs: Any) -> Any:
        """Time an operation under a claim, which may have been lost."""
        try:
            return self._timed(name, getattr(self._inner, name))(claim, *args, **kwargs)
        except LeaseLost as error:
            if error.taken_over:
                self._count_loss(claim)
            raise

    def _count_loss(self, claim: Claim) -> None:
        """Count a lost lease once, however many operations detect it."""
        lease = (claim.job.id, claim.token)
        with self._losing:
            if lease in self._lost:
                return
            self._lost[lease] = None
            if len(self._lost) > _REMEMBERED_LOSSES:
                del self._lost[next(iter(self._lost))]
        self._metrics.lease_losses.inc()

    def _count_iteration(self, claim: Claim, done: CompletedIteration) -> None:
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
