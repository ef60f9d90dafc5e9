"""Access tokens and their scopes"""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Final

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
