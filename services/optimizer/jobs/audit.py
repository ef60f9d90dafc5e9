"""What is kept of who did what: entries of the audit log."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Final

LOCAL: Final = "local"
"""Whoever asks without a token: on the command line, or a server that listens to its machine alone.
No token has this name."""


RETENTION: Final = "retention"
"""Whatever deletes jobs that ended long ago. No token has this name, either."""


class AuditAction(StrEnum):
    """What was done."""

    SUBMIT = "submit"
    FORK = "fork"
    PAUSE = "pause"
    RESUME = "resume"
    EXTEND = "extend"
    PRIORITIZE = "prioritize"
    CANCEL = "cancel"
    DELETE = "delete"
    KEEP = "keep"
    RELEASE = "release"
    LABEL = "label"
    ADD_RECORDING = "add_recording"
    CREATE_TOKEN = "create_token"  # noqa: S105
    REVOKE_TOKEN = "revoke_token"  # noqa: S105


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One change, written in the transaction that made it.

    Attributes:
        index: the later, the greater.
        at: when, UTC, by the database's clock.
        actor: name of the token that asked for it, or `LOCAL`.
        action: what was done.
        job_id: to which job; None for what is about no job. The job may be gone since.
        details: what else tells the change from others like it, such as the new budget.
    """

    index: int
    at: datetime
    actor: str
    action: AuditAction
    job_id: str | None = None
    details: dict[str, Any] = field(default_factory=dict)
