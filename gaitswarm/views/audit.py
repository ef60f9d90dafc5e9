"""The audit log, as administrators see it."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from pydantic import Field

from gaitswarm.services.optimizer.jobs.audit import AuditAction, AuditEntry
from gaitswarm.views.base import View


class AuditEntryView(View):
    """One change: who did what to which job, when."""

    index: int = Field(description="The later, the greater.", examples=[42])
    at: datetime = Field(description="When, UTC.")
    actor: str = Field(
        description="Name of the token that asked for it; `local` for whoever asked without one, on"
        " the machine itself.",
        examples=["ci"],
    )
    action: AuditAction = Field(description="What they did.", examples=["cancel"])
    job_id: str | None = Field(
        description="To which job; null for what is about none. The job may be gone since.",
        examples=["k2q7zr5dm9xw"],
    )
    details: dict[str, Any] = Field(
        description="What else tells the change from others like it: `iterations` of an extension,"
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
