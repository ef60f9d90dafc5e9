"""Activity, audit log and notifications of a server"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any, Literal
from urllib.parse import urlsplit

from pydantic import Field

from gaitswarm.services.monitoring.activity import (
    IterationSpan,
    JobActivity,
    Message,
    TaskSpan,
    WorkerHealth,
)
from gaitswarm.services.optimizer.jobs.audit import AuditAction, AuditEntry
from gaitswarm.services.optimizer.jobs.notification import Notification
from gaitswarm.services.optimizer.views import View

Level = Literal["DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL"]

_LEVELS: tuple[Level, ...] = ("DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")


class IterationSpanView(View):
    """An iteration as it was evaluated."""

    iteration: int = Field(description="Index of the iteration, from 0.", examples=[3])
    begun_at: datetime = Field(description="When it was sent to the workers, UTC.")
    seconds: float | None = Field(
        description="From then to its end [s]; null while it is under way.", examples=[0.61]
    )
    designs: int = Field(description="Designs simulated for it [1].", examples=[25])
    error: str | None = Field(
        description="Why it has no result; null if it has one, or is under way.", examples=[None]
    )

    @classmethod
    def from_span(cls, span: IterationSpan) -> IterationSpanView:
        """Make a view of an iteration."""
        return cls(
            iteration=span.iteration,
            begun_at=_time(span.begun),
            seconds=span.seconds,
            designs=span.designs,
            error=span.error,
        )


class TaskSpanView(View):
    """A task: simulations of an iteration that a worker ran together."""

    iteration: int = Field(description="Index of the iteration, from 0.", examples=[3])
    worker: str = Field(
        description="Name of the worker's machine; empty if it did not answer.", examples=["node-1"]
    )
    begun_at: datetime = Field(description="When the worker received it, UTC.")
    seconds: float = Field(description="From then to its answer [s].", examples=[0.52])
    compute_seconds: float = Field(
        description="Of these, how long the worker computed [s].", examples=[0.5]
    )
    walks: int = Field(description="Number of the walks [1].", examples=[48])
    error: str | None = Field(
        description="Why there is no result; null if there is one.", examples=[None]
    )

    @classmethod
    def from_span(cls, span: TaskSpan) -> TaskSpanView:
        """Make a view of a task."""
        return cls(
            iteration=span.iteration,
            worker=span.worker,
            begun_at=_time(span.begun),
            seconds=span.seconds,
            compute_seconds=span.compute_seconds,
            walks=span.walks,
            error=span.error,
        )


class WorkerHealthView(View):
    """A machine that has run tasks of the job."""

    name: str = Field(
        description="Name of the machine; empty for tasks without an answer.",
        examples=["node-1"],
    )
    tasks: int = Field(description="Tasks that it has ended [1].", examples=[120])
    walks: int = Field(description="Walks of those that have a result [1].", examples=[5760])
    failures: int = Field(description="Of the tasks, those without a result [1].", examples=[0])
    compute_seconds: float = Field(description="Time that it has computed [s].", examples=[61.2])
    last_seen_at: datetime = Field(description="When it answered last, UTC.")
    error: str | None = Field(
        description="Of the last task without a result; null if all have one.", examples=[None]
    )

    @classmethod
    def from_health(cls, health: WorkerHealth) -> WorkerHealthView:
        """Make a view of a worker."""
        return cls(
            name=health.name,
            tasks=health.tasks,
            walks=health.walks,
            failures=health.failures,
            compute_seconds=health.compute_seconds,
            last_seen_at=_time(health.last_seen),
            error=health.error,
        )


class MessageView(View):
    """A line of the log."""

    at: datetime = Field(description="When it was written, UTC.")
    level: str = Field(description="Severity.", examples=["WARNING"])
    text: str = Field(description="Text of the message.", examples=["job k2q7zr5dm9xw waits"])
    iteration: int | None = Field(
        description="Iteration to which it belongs, from 0; null for none.", examples=[3]
    )

    @classmethod
    def from_message(cls, message: Message) -> MessageView:
        """Make a view of a message."""
        return cls(
            at=_time(message.at),
            level=message.level,
            text=message.text,
            iteration=message.iteration,
        )


class ActivityView(View):
    """Recent activity of a job in the process that answers."""

    id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    reason: str | None = Field(
        description="Why no activity is known; null if some is.", examples=[None]
    )
    workers: list[WorkerHealthView] = Field(description="Machines that have run its walks.")
    iterations: list[IterationSpanView] = Field(
        description="Iterations that were evaluated last, in the order in which they began."
    )
    tasks: list[TaskSpanView] = Field(
        description="The last tasks, in the order in which they ended."
    )
    messages: list[MessageView] = Field(description="Lines of the log, the oldest first.")

    @classmethod
    def from_activity(
        cls, job_id: str, known: JobActivity | None, level: Level, *, runs_jobs: bool
    ) -> ActivityView:
        """Make a view of a job's run."""
        found = known or JobActivity()
        grave = _LEVELS[_LEVELS.index(level) :]
        return cls(
            id=job_id,
            reason=None if known is not None else _why_nothing(runs_jobs=runs_jobs),
            workers=[WorkerHealthView.from_health(worker) for worker in found.workers],
            iterations=[IterationSpanView.from_span(span) for span in found.iterations],
            tasks=[TaskSpanView.from_span(span) for span in found.tasks],
            messages=[MessageView.from_message(m) for m in found.messages if m.level in grave],
        )


def _why_nothing(*, runs_jobs: bool) -> str:
    if not runs_jobs:
        return "this server runs no jobs; see the log of the process that runs this one"
    return (
        "this server has not run the job since it started: another process runs it, or it has not"
        " started, or it ended before"
    )


def _time(seconds: float) -> datetime:
    return datetime.fromtimestamp(seconds, UTC)


class AuditEntryView(View):
    """One entry of the audit log."""

    index: int = Field(description="Index, increasing with time.", examples=[42])
    at: datetime = Field(description="When, UTC.")
    actor: str = Field(
        description="Name of the token that was used; `local` for a client without one, on"
        " the machine itself.",
        examples=["ci"],
    )
    action: AuditAction = Field(description="The action.", examples=["cancel"])
    job_id: str | None = Field(
        description="The job; null if the action is about none. It may have been deleted since.",
        examples=["k2q7zr5dm9xw"],
    )
    details: dict[str, Any] = Field(
        description="Details: `iterations` of an extension,"
        " `parent` of a fork, `name` and `scope` of a token.",
        examples=[{"iterations": 50}],
    )

    @classmethod
    def from_entry(cls, entry: AuditEntry) -> AuditEntryView:
        """Make the view of an entry."""
        return cls(
            index=entry.index,
            at=entry.at,
            actor=entry.actor,
            action=entry.action,
            job_id=entry.job_id,
            details=entry.details,
        )


class NotificationView(View):
    """A notification of a job's end."""

    id: str = Field(
        description="The same at every attempt; the header `webhook-id`.",
        examples=["msg_6a09e667f3bcc908b2fb1366"],
    )
    host: str = Field(
        description="Host of the receiver; paths may be secrets.", examples=["ci.example"]
    )
    event: str = Field(
        description="Event: `job.succeeded`, `job.failed` or `job.cancelled`.",
        examples=["job.succeeded"],
    )
    state: Literal["waiting", "delivered", "given up"] = Field(
        description="Delivery state; failed deliveries are retried for some hours."
    )
    attempts: int = Field(description="How often it was sent [1].", examples=[1])
    created_at: datetime = Field(description="When the job ended, UTC.")
    next_attempt_at: datetime | None = Field(
        description="Next attempt, UTC; null once it was delivered or given up."
    )
    delivered_at: datetime | None = Field(description="When it was delivered, UTC.")
    error: str | None = Field(
        description="Why the last attempt failed.", examples=["the receiver answered 500"]
    )

    @classmethod
    def from_notification(cls, found: Notification) -> NotificationView:
        """Make the view of a notification."""
        waits = found.next_attempt_at is not None
        return cls(
            id=found.id,
            host=urlsplit(found.url).hostname or "",
            event=found.document["type"],
            state="delivered" if found.delivered_at else "waiting" if waits else "given up",
            attempts=found.attempts,
            created_at=found.created_at,
            next_attempt_at=found.next_attempt_at,
            delivered_at=found.delivered_at,
            error=found.error,
        )
