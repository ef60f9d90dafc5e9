"""Tokens in SQL: names, scopes and digests of secrets."""

from __future__ import annotations

import re
from typing import Final

from sqlalchemy import Connection, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer.access import Scope, Token, new_secret, secret_digest
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.audit import LOCAL, RETENTION, AuditAction
from gaitswarm.services.optimizer.store.connections.engine import Clock, Database
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row
from gaitswarm.services.optimizer.store.rows.tables import tokens
from gaitswarm.services.optimizer.store.statements.audit import note_change

_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")

_FIRST: Final = "first"


class SqlTokens:
    """`Tokens` in a database of jobs.

    Args:
        database: its owner's to close.
        clock: tells the time of all that is stored.
    """

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock

    def create(self, name: str, scope: Scope) -> tuple[Token, str]:
        """Make a token; see `Tokens`.

        Args:
            name: of no other token.
            scope: what it is to allow.

        Returns:
            The token and its secret.

        Raises:
            InvalidRequest: the name cannot be one, or is taken.
        """
        if not _NAME.fullmatch(name):
            raise InvalidRequest("must be 1 to 64 letters, digits, '_', '.' and '-'", field="name")
        if name in (LOCAL, RETENTION):
            raise InvalidRequest(
                f"{name!r} is what the audit log calls who has no token; choose another",
                field="name",
            )
        try:
            with self._database.transaction(write=True) as connection:
                return self._insert(connection, name, scope)
        except IntegrityError:
            raise InvalidRequest(
                f"there is a token {name!r} already; names of revoked tokens stay taken, so that"
                " the owner of a job stays who it was",
                field="name",
            ) from None

    def create_first(self) -> str | None:
        """Make a token that allows everything, if there has never been any token.

        Returns:
            Its secret; None if there was a token before.
        """
        try:
            with self._database.transaction(write=True) as connection:
                if connection.execute(select(func.count()).select_from(tokens)).scalar_one():
                    return None
                return self._insert(connection, _FIRST, Scope.ADMIN)[1]
        except IntegrityError:
            # Another server that starts on the same database has made it.
            return None

    def all(self) -> tuple[Token, ...]:
        """Read all tokens, the oldest first.

        Returns:
            Valid and revoked ones.
        """
        query = select(tokens).order_by(tokens.c.created_at, tokens.c.name)
        with self._database.transaction(write=False) as connection:
            return tuple(map(_token, connection.execute(query).mappings()))

    def revoke(self, name: str) -> Token:
        """Let a token allow nothing from now on.

        Args:
            name: of the token.

        Returns:
            The token as it is then.

        Raises:
            NotFound: there is none of that name.
        """
        with self._database.transaction(write=True) as connection:
            valid = (tokens.c.name == name, tokens.c.revoked_at.is_(None))
            now = self._clock(connection)
            done = connection.execute(update(tokens).where(*valid).values(revoked_at=now))
            if done.rowcount:
                note_change(connection, now, LOCAL, AuditAction.REVOKE_TOKEN, name=name)
            query = select(tokens).where(tokens.c.name == name)
            row = connection.execute(query).mappings().first()
        if row is None:
            raise NotFound(f"there is no token {name!r}")
        return _token(row)

    def find(self, secret: str) -> Token | None:
        """Find the valid token of a secret.

        Args:
            secret: as whoever asks gave it.

        Returns:
            The token; None where there is none, or it was revoked.
        """
        query = select(tokens).where(
            tokens.c.digest == secret_digest(secret), tokens.c.revoked_at.is_(None)
        )
        with self._database.transaction(write=False) as connection:
            row = connection.execute(query).mappings().first()
        return None if row is None else _token(row)

    def _insert(self, connection: Connection, name: str, scope: Scope) -> tuple[Token, str]:
        secret, now = new_secret(), self._clock(connection)
        connection.execute(
            insert(tokens).values(
                name=name, scope=scope, digest=secret_digest(secret), created_at=now
            )
        )
        note_change(connection, now, LOCAL, AuditAction.CREATE_TOKEN, name=name, scope=scope)
        return Token(name, scope, now), secret


def _token(row: Row) -> Token:
    return Token(row["name"], Scope(row["scope"]), row["created_at"], row["revoked_at"])
