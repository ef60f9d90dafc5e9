"""Notifications: who is told that a job has ended, and how often that is tried. Pure."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, Protocol
from urllib.parse import urlsplit

from gaitswarm.services.optimizer.errors import InvalidRequest

MOST_ATTEMPTS: Final = 16
"""Some six hours, with the pauses below."""

_FIRST_PAUSE: Final = 5.0
_LONGEST_PAUSE: Final = 3600.0

_LONGEST_URL: Final = 2000


@dataclass(frozen=True, slots=True)
class Notification:
    """What is sent to whom about a job that has ended.

    Attributes:
        id: the same at every attempt, so that a receiver knows what it has had.
        job_id: of the job.
        url: where it is sent.
        document: what is sent, as JSON.
        created_at: when the job ended.
        attempts: how often it was sent so far.
        next_attempt_at: when it is sent next; None once it was delivered or given up.
        delivered_at: when it was delivered; None if it was not.
        error: why the last attempt failed, for people; None if it did not.
    """

    id: str
    job_id: str
    url: str
    document: dict[str, Any]
    created_at: datetime
    attempts: int = 0
    next_attempt_at: datetime | None = None
    delivered_at: datetime | None = None
    error: str | None = None


class Outbox(Protocol):
    """The port of the memory of notifications. Thread-safe; every method is one transaction.

    A job that ends leaves one in the transaction that ends it, if it was submitted with a URL.
    """

    def take(self, *, lease_seconds: float) -> Notification | None:
        """Take the notification that has been due for longest, for one attempt."""

    def settle(self, taken: Notification, error: str | None, *, final: bool = False) -> None:
        """Note what came of an attempt: it is delivered, due again later, or given up."""

    def about(self, job_id: str) -> tuple[Notification, ...]:
        """Read the notifications about a job."""


def pause_after(attempts: int) -> float | None:
    """How long to wait after an attempt that failed."""
    if attempts >= MOST_ATTEMPTS:
        return None
    return float(min(_FIRST_PAUSE * 2.0 ** (attempts - 1), _LONGEST_PAUSE))


def unusable_url(url: str) -> str | None:
    """Why nothing can be sent to a URL, whoever sends."""
    try:
        parts = urlsplit(url)
        name, _ = parts.hostname, parts.port
    except ValueError:
        return "not a URL"
    if (
        len(url) > _LONGEST_URL
        or not (url.isascii() and url.isprintable())
        or any(character in url for character in " \\")
        or parts.scheme not in ("http", "https")
        or not name
    ):
        return "must be a URL such as https://ci.example/hook"
    return "must have no user and password" if "@" in parts.netloc else None


def refused_url(url: str, hosts: Collection[str]) -> str | None:
    """Why nothing is sent to a URL.

    A server must not be made to send requests where only it can: to itself, or into its network.
    """
    if not hosts:
        return "notifications are off here; GAITSWARM_WEBHOOK_HOSTS of the server allows hosts"
    reason = unusable_url(url)
    if reason is not None:
        return reason
    parts = urlsplit(url)
    name, port = (parts.hostname or "").lower(), parts.port
    named = f"[{name}]" if ":" in name else name
    wanted = {named, f"{named}:{port or {'http': 80, 'https': 443}[parts.scheme]}"}
    if not wanted & {host.lower() for host in hosts}:
        return f"{name!r} is not among the hosts that GAITSWARM_WEBHOOK_HOSTS of the server allows"
    return None


def check_url(url: str, hosts: Collection[str], *, field: str) -> None:
    """Refuse a URL to which nothing is sent."""
    reason = refused_url(url, hosts)
    if reason is not None:
        raise InvalidRequest(reason, field=field)
