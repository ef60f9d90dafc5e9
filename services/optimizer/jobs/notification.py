"""Notifications about jobs that have ended: recipients and retries. Pure functions"""

from __future__ import annotations

from collections.abc import Collection
from datetime import datetime
from typing import Any, Final, NamedTuple
from urllib.parse import urlsplit

from gaitswarm.services.optimizer.errors import InvalidRequest

MOST_ATTEMPTS: Final = 16
"""About six hours with the pauses below."""

_FIRST_PAUSE: Final = 5.0
LONGEST_PAUSE: Final = 3600.0

_LONGEST_URL: Final = 2000


class Notification(NamedTuple):
    """A message about a job that has ended."""

    id: str  # the same for every attempt, so that receivers can detect repetitions
    job_id: str
    url: str
    document: dict[str, Any]  # sent as JSON
    created_at: datetime
    attempts: int = 0
    next_attempt_at: datetime | None = None  # None once delivered or given up
    delivered_at: datetime | None = None  # None unless delivered
    error: str | None = None  # cause of the last failed attempt; None after a success


def pause_after(attempts: int) -> float | None:
    """Return the pause after a failed attempt [s]; None to give up."""
    if attempts >= MOST_ATTEMPTS:
        return None
    return float(min(_FIRST_PAUSE * 2.0 ** (attempts - 1), LONGEST_PAUSE))


def unusable_url(url: str) -> str | None:
    """Return why no sender can use a URL; None if it can be used."""
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
    """Return why a server sends nothing to a URL, as into its own network; None if it does."""
    if not hosts:
        return "notifications are disabled; set the server's GAITSWARM_WEBHOOK_HOSTS"
    reason = unusable_url(url)
    if reason is not None:
        return reason
    parts = urlsplit(url)
    name, port = (parts.hostname or "").lower(), parts.port
    named = f"[{name}]" if ":" in name else name
    candidates = {named, f"{named}:{port or {'http': 80, 'https': 443}[parts.scheme]}"}
    if not candidates & {host.lower() for host in hosts}:
        return f"{name!r} is not among the hosts in the server's GAITSWARM_WEBHOOK_HOSTS"
    return None


def check_url(url: str, hosts: Collection[str], *, field: str) -> None:
    """Raise InvalidRequest for a URL to which nothing is sent."""
    reason = refused_url(url, hosts)
    if reason is not None:
        raise InvalidRequest(reason, field=field)
