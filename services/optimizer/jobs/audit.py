"""Entries of the audit log"""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Final

LOCAL: Final = "local"
"""Actor without a token: the command line, or a server bound to loopback. No token has this name.
"""

RETENTION: Final = "retention"
"""Actor that deletes expired jobs. No token has this name."""


class AuditAction(StrEnum):
    """Audited action."""

    SUBMIT = "submit"
    FORK = "fork"
    PAUSE = "pause"
    RESUME = "resume"
    EXTEND = "extend"
    PRIORITIZE = "prioritize"
    CANCEL = "cancel"
    DELETE = "delete"
    RESTORE = "restore"
    KEEP = "keep"
    RELEASE = "release"
    LABEL = "label"
    ADD_RECORDING = "add_recording"
    CREATE_TOKEN = "create_token"  # noqa: S105
    REVOKE_TOKEN = "revoke_token"  # noqa: S105


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One change, written in the transaction that made it."""

    index: int  # ascending with time
    at: datetime  # UTC, by the database's clock
    actor: str  # name of the token, or `LOCAL`, or `RETENTION`
    action: AuditAction
    job_id: str | None = None  # None for an action on no job; the job may have been deleted since
    details: dict[str, Any] = field(default_factory=dict)  # further content, such as the new budget
