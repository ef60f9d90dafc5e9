"""Activity, audit log and notifications of a server"""

from __future__ import annotations

from datetime import datetime
from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field

from gaitswarm.services.monitoring.activity import (
    IterationSpanView,
    JobActivity,
    MessageView,
    TaskSpanView,
    WorkerHealthView,
)
from gaitswarm.services.optimizer.jobs.notification import Notification
from gaitswarm.services.optimizer.views import JobName, View, fields_of

Level = Literal["DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL"]

_LEVELS: tuple[Level, ...] = ("DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")


class ActivityView(View):
    """Recent activity of a job in the process that answers."""

    id: JobName
    reason: str | None = Field(description="Why no activity is known; null if some is.")
    workers: list[WorkerHealthView] = Field(description="Machines that have run its simulations.")
    iterations: list[IterationSpanView] = Field(description="The last iterations, as they began.")
    tasks: list[TaskSpanView] = Field(description="The last tasks, as they ended.")
    messages: list[MessageView] = Field(description="Lines of the log, the oldest first.")

    @classmethod
    def from_activity(
        cls, job_id: str, known: JobActivity | None, level: Level, *, runs_jobs: bool
    ) -> ActivityView:
        """Make a view of a job's run, with messages of at least a level."""
        reason = None
        if not runs_jobs:
            reason = "this server runs no jobs; see the log of the process that runs this one"
        elif known is None:
            reason = (
                "this server has not run the job since it started: another process runs it, or it"
                " has not started, or it ended before"
            )
        activity = known or JobActivity()
        severe = _LEVELS[_LEVELS.index(level) :]
        return cls(
            id=job_id,
            reason=reason if known is None else None,
            workers=list(activity.workers.values()),
            iterations=list(activity.iterations),
            tasks=list(activity.tasks),
            messages=[message for message in activity.messages if message.level in severe],
        )


class NotificationView(View):
    """A notification of a job's end."""

    id: str = Field(examples=["msg_6a09e667f3bcc908b2fb1366"])
    """The same at every attempt; the header `webhook-id`."""
    host: str = Field(examples=["ci.example"])
    """Host of the receiver; paths may be secrets."""
    event: str = Field(examples=["job.succeeded"])
    """`job.succeeded`, `job.failed` or `job.cancelled`."""
    state: Literal["waiting", "delivered", "given up"]
    """Delivery state; failed deliveries are retried for some hours."""
    attempts: int = Field(description="How often it was sent [1].", examples=[1])
    created_at: datetime = Field(description="When the job ended, UTC.")
    next_attempt_at: datetime | None
    """Next attempt, UTC; null once it was delivered or given up."""
    delivered_at: datetime | None = Field(description="When it was delivered, UTC.")
    error: str | None = Field(examples=["the receiver answered 500"])
    """Why the last attempt failed."""

    @classmethod
    def from_notification(cls, notification: Notification) -> NotificationView:
        waits = notification.next_attempt_at is not None
        return cls(
            **fields_of(cls, notification),
            host=urlsplit(notification.url).hostname or "",
            event=notification.document["type"],
            state="delivered" if notification.delivered_at else "waiting" if waits else "given up",
        )
