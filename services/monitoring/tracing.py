"""OpenTelemetry spans of jobs, iterations and tasks

Imported only if spans are sent, as it requires the extra `telemetry`.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import SpanProcessor, TracerProvider
from opentelemetry.trace import Span, Status, StatusCode, set_span_in_context

from gaitswarm.services.optimizer.errors import LeaseLost
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, OnTask, TaskReport


def exporting_tracing() -> Tracing:
    """Create tracing that exports by OTLP over HTTP, configured by OpenTelemetry's variables."""
    from opentelemetry.exporter.otlp.proto.http.trace_exporter import (  # noqa: PLC0415
        OTLPSpanExporter,
    )
    from opentelemetry.sdk.trace.export import BatchSpanProcessor  # noqa: PLC0415

    return Tracing(BatchSpanProcessor(OTLPSpanExporter()))


class Tracing:
    """Spans of the jobs run by this process, which it observes at the store. Thread-safe.

    A job's span is from its claim to its release or end; an iteration's from its evaluation to its
    commit; a task's from dispatch to answer.
    """

    def __init__(self, processor: SpanProcessor) -> None:
        name = os.environ.get("OTEL_SERVICE_NAME", "gaitswarm")
        resource = Resource.create({"service.name": name})
        self._provider = TracerProvider(resource=resource, shutdown_on_exit=False)
        self._provider.add_span_processor(processor)
        self._tracer = self._provider.get_tracer("gaitswarm")
        self._lock = threading.Lock()
        self._jobs: dict[str, Span] = {}
        self._iterations: dict[str, tuple[int, Span]] = {}

    @contextmanager
    def observed(self, request: EvaluationRequest) -> Iterator[OnTask | None]:
        """Make spans of an evaluation and its tasks."""
        span = self.iteration(request)
        yield None if span is None else partial(self.task, span)

    def close(self) -> None:
        """Export pending spans. Idempotent."""
        self._provider.shutdown()

    def transaction(self, operation: str, seconds: float, error: BaseException | None) -> None:
        """Make no span of it."""

    def cancelled(self, job: Job) -> None:
        """Make no span of a job that has none."""

    def claimed(self, claim: Claim) -> None:
        job = claim.job
        attributes: dict[str, str | int] = {
            "gaitswarm.job.id": job.id,
            "gaitswarm.job.kind": job.spec.kind,
            "gaitswarm.job.iterations": job.spec.iterations,
            "gaitswarm.runner": claim.runner,
        }
        with self._lock:
            self._jobs[job.id] = self._tracer.start_span("job", attributes=attributes)

    def released(self, claim: Claim, state: JobState, error: str | None) -> None:
        self._end_job(claim.job.id, state, error)

    def lost(self, claim: Claim, error: LeaseLost) -> None:
        self._end_job(claim.job.id, "lost", str(error))

    def _end_job(self, job_id: str, state: str, error: str | None = None) -> None:
        """End the span of a job's run, and of an iteration in progress."""
        with self._lock:
            job = self._jobs.pop(job_id, None)
            _, iteration = self._iterations.pop(job_id, (0, None))
        for span in (iteration, job):
            if span is not None:
                if error is not None:
                    span.set_status(Status(StatusCode.ERROR, error))
                span.set_attribute("gaitswarm.job.state", state)
                span.end()

    def iteration(self, request: EvaluationRequest) -> Span | None:
        """Return the span of an iteration, started by its first evaluation."""
        with self._lock:
            job = self._jobs.get(request.job_id)
            if job is None:
                return None
            index, span = self._iterations.get(request.job_id, (-1, None))
            if span is None or index != request.iteration:
                span = self._tracer.start_span(
                    "iteration",
                    context=set_span_in_context(job),
                    attributes={
                        "gaitswarm.job.id": request.job_id,
                        "gaitswarm.iteration": request.iteration,
                        "gaitswarm.designs": len(request.designs),
                    },
                )
                self._iterations[request.job_id] = (request.iteration, span)
            return span

    def committed(self, claim: Claim, done: CompletedIteration, state: JobState) -> None:
        with self._lock:
            _, span = self._iterations.pop(claim.job.id, (0, None))
        if span is not None:
            span.set_attribute("gaitswarm.designs.saved", done.saved)
            span.end()
        if state not in (JobState.RUNNING, JobState.PAUSING):
            self._end_job(claim.job.id, state)

    def task(self, parent: Span, report: TaskReport) -> None:
        """Record the span of a finished task."""
        ended = time.time_ns()
        span = self._tracer.start_span(
            "task",
            context=set_span_in_context(parent),
            start_time=ended - round(report.seconds * 1e9),
            attributes={
                "gaitswarm.task.walks": report.walks,
                "gaitswarm.task.compute_seconds": report.compute_seconds,
                "host.name": report.host,
            },
        )
        if report.error is not None:
            span.set_status(Status(StatusCode.ERROR, report.error))
        span.end(ended)
