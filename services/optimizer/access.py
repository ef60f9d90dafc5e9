"""Access tokens and their scopes, and masking of passwords in URLs"""

from __future__ import annotations

import hashlib
import re
import secrets
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Final
from urllib.parse import unquote_plus

_PREFIX: Final = "gaitswarm_"
"""Lets people and secret scanners recognize a token."""

_BYTES: Final = 32
"""Of randomness in a secret: it cannot be guessed, so a fast hash is enough to store it."""


class Scope(StrEnum):
    """Permissions of a token; each includes those before it."""

    READ = "read"
    """Read everything, and run queries that change nothing."""
    SUBMIT = "submit"
    """Submit jobs, and control those submitted with the same token."""
    ADMIN = "admin"
    """Control every job."""

    def allows(self, needed: Scope) -> bool:
        """Return whether this scope includes another."""
        order = tuple(Scope)
        return order.index(self) >= order.index(needed)


@dataclass(frozen=True, slots=True)
class Token:
    """A token as stored, without its secret."""

    name: str  # chosen by its creator; the owner of jobs submitted with it
    scope: Scope
    created_at: datetime  # UTC
    revoked_at: datetime | None = None  # UTC; None while the token is valid

    def may_command(self, owner: str | None) -> bool:
        """Return whether the token may control jobs of an owner."""
        return self.scope is Scope.ADMIN or (self.scope.allows(Scope.SUBMIT) and owner == self.name)


def new_secret() -> str:
    return _PREFIX + secrets.token_urlsafe(_BYTES)


def secret_digest(secret: str) -> str:
    """Return the digest under which a secret is stored."""
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()


HARMLESS: Final = frozenset(
    {
        *("user", "host", "hostaddr", "port", "dbname", "service", "application_name"),
        *("sslmode", "connect_timeout", "target_session_attrs"),
    }
)
"""Query parameters of a database URL that are shown; others may contain a secret or its path."""

_HIDDEN: Final = "***"

_HOST: Final = r"(?:\[[\w.:%]+\]|[\w.%-]*)(?::\d+)?"

_ADDRESS: Final = re.compile(rf"{_HOST}(?:,{_HOST})*(?:/[^:@]*)?")


def masked_url(url: str) -> str:
    scheme, separator, rest = url.partition("://")
    if not separator or scheme.startswith("sqlite"):
        return url
    head, _, query = rest.partition("?")
    user_info, at, address = head.rpartition("@")
    # An @ after the ? may belong to a password that contains a ?.
    if "@" in query or not _ADDRESS.fullmatch(address):
        return f"{scheme}://{_HIDDEN}"
    user, colon, _ = user_info.partition(":")
    if at and scheme in ("http", "https"):
        user = _HIDDEN  # A token may be given as the user.
    hidden = f":{_HIDDEN}" if colon else ""
    shown = [part for part in query.split("&") if _name(part) in HARMLESS]
    if query and len(shown) < query.count("&") + 1:
        shown.append(_HIDDEN)
    return f"{scheme}://{user}{hidden}{at}{address}{'?' if query else ''}{'&'.join(shown)}"


def _name(parameter: str) -> str:
    name, equals, _ = parameter.partition("=")
    return unquote_plus(name) if equals else ""
