"""Who may ask for what: tokens, and what their scopes allow."""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Final, Protocol

_PREFIX: Final = "gaitswarm_"
"""Of secrets, so that people and scanners of repositories know one when they see it."""

_BYTES: Final = 32
"""Of randomness in a secret: nobody guesses it, so that a fast hash is enough to keep it."""


class Scope(StrEnum):
    """What a token allows; each allows what those before it do."""

    READ = "read"
    """To look at everything, and to ask questions that change nothing."""
    SUBMIT = "submit"
    """To submit jobs, and to command those that were submitted with the same token."""
    ADMIN = "admin"
    """To command every job."""

    def allows(self, needed: Scope) -> bool:
        """Whether a token of this scope may do what needs another one."""
        order = tuple(Scope)
        return order.index(self) >= order.index(needed)


@dataclass(frozen=True, slots=True)
class Token:
    """A token as it is stored: everything but its secret.

    Attributes:
        name: chosen by whoever made it; the owner of what is submitted with it.
        scope: what it allows.
        created_at: when it was made, UTC.
        revoked_at: when it was revoked, UTC; None while it is valid.
    """

    name: str
    scope: Scope
    created_at: datetime
    revoked_at: datetime | None = None

    def may_command(self, owner: str | None) -> bool:
        """Whether jobs of an owner may be paused, resumed, extended or cancelled with it."""
        return self.scope is Scope.ADMIN or (self.scope.allows(Scope.SUBMIT) and owner == self.name)


def new_secret() -> str:
    """Make the secret of a new token."""
    return _PREFIX + secrets.token_urlsafe(_BYTES)


def secret_digest(secret: str) -> str:
    """What is stored of a secret."""
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()


class Tokens(Protocol):
    """The port of the memory of tokens. Thread-safe; every method is one transaction."""

    def create(self, name: str, scope: Scope) -> tuple[Token, str]:
        """Make a token."""

    def create_first(self) -> str | None:
        """Make a token `first` that allows everything, if there has never been any token."""

    def all(self) -> tuple[Token, ...]:
        """Read all tokens."""

    def revoke(self, name: str) -> Token:
        """Let a token allow nothing from now on. Repeated, it changes nothing."""

    def find(self, secret: str) -> Token | None:
        """Find the valid token of a secret."""
