"""Entries of the audit log"""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum
from typing import Any, Final

from pydantic import Field

from gaitswarm.services.optimizer.views import View

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


class AuditEntryView(View):
    """One entry of the audit log."""

    index: int = Field(description="Index, increasing with time.", examples=[42])
    at: datetime = Field(description="When, UTC.")
    actor: str = Field(examples=["ci"])
    """Name of the token; `local` for a client on the machine without one."""
    action: AuditAction = Field(description="The action.", examples=["cancel"])
    job_id: str | None = Field(examples=["k2q7zr5dm9xw"])
    """The job, which may have been deleted since; null for none."""
    details: dict[str, Any] = Field(examples=[{"iterations": 50}])
    """Further content, such as the new budget."""
