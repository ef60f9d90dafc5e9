"""What came of telling others that a job has ended."""

from __future__ import annotations

from datetime import datetime
from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field

from gaitswarm.services.optimizer.jobs.notification import Notification
from gaitswarm.views.base import View


class NotificationView(View):
    """A notification of a job's end."""

    id: str = Field(
        description="The same at every attempt; the header `webhook-id`.",
        examples=["msg_6a09e667f3bcc908b2fb1366"],
    )
    host: str = Field(
        description="Where it is sent; paths may be secrets.", examples=["ci.example"]
    )
    event: str = Field(
        description="What it tells: `job.succeeded`, `job.failed` or `job.cancelled`.",
        examples=["job.succeeded"],
    )
    state: Literal["waiting", "delivered", "given up"] = Field(
        description="Whether it was taken; one that was not is sent again, for some hours."
    )
    attempts: int = Field(description="How often it was sent [1].", examples=[1])
    created_at: datetime = Field(description="When the job ended, UTC.")
    next_attempt_at: datetime | None = Field(
        description="When it is sent next, UTC; null once it was delivered or given up."
    )
    delivered_at: datetime | None = Field(description="When it was taken, UTC.")
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
