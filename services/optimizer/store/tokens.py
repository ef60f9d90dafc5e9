"""Tokens, the audit log, and quotas"""

from __future__ import annotations

import re
from datetime import datetime
from typing import Any, Final

from sqlalchemy import Connection, delete, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer.access import Scope, Token, new_secret, secret_digest
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.audit import LOCAL, RETENTION, AuditAction, AuditEntryView
from gaitswarm.services.optimizer.jobs.job import ENDED, Quota
from gaitswarm.services.optimizer.jobs.listing import Page, checked_limit
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.tables import Row, audit, jobs, tokens

_NAME: Final = re.compile(r"[A-Za-z0-9_.-]{1,64}")


class Tokens(Aggregate):
    """Access tokens."""

    def create(self, name: str, scope: Scope) -> tuple[Token, str]:
        """Create a token and its secret. Raises InvalidRequest for an invalid or taken name."""
        if not _NAME.fullmatch(name):
            raise InvalidRequest("must be 1 to 64 letters, digits, '_', '.' and '-'", field="name")
        if name in (LOCAL, RETENTION):
            raise InvalidRequest(
                f"{name!r} is what the audit log calls who has no token; choose another",
                field="name",
            )
        try:
            with self._database.write("token_create") as connection:
                return self._insert(connection, name, scope)
        except IntegrityError:
            raise InvalidRequest(
                f"there is a token {name!r} already; names of revoked tokens stay taken, so that"
                " the owner of a job stays who it was",
                field="name",
            ) from None

    def create_first(self) -> str | None:
        """Create an admin token `first` and return its secret, unless there ever was a token."""
        try:
            with self._database.write("token_create_first") as connection:
                if connection.execute(select(func.count()).select_from(tokens)).scalar_one():
                    return None
                return self._insert(connection, "first", Scope.ADMIN)[1]
        except IntegrityError:
            # Another server that starts on the same database has created it.
            return None

    def all(self) -> tuple[Token, ...]:
        """Return valid and revoked tokens, oldest first."""
        query = select(tokens).order_by(tokens.c.created_at, tokens.c.name)
        with self._database.read("token_all") as connection:
            return tuple(map(_token, connection.execute(query).mappings()))

    def revoke(self, name: str) -> Token:
        """Revoke a token. Idempotent. Raises NotFound."""
        with self._database.write("token_revoke") as connection:
            now = self._clock(connection)
            valid = update(tokens).where(tokens.c.name == name, tokens.c.revoked_at.is_(None))
            if connection.execute(valid.values(revoked_at=now)).rowcount:
                note_change(connection, now, LOCAL, AuditAction.REVOKE_TOKEN, name=name)
            query = select(tokens).where(tokens.c.name == name)
            row = connection.execute(query).mappings().first()
        if row is None:
            raise NotFound(f"there is no token {name!r}")
        return _token(row)

    def find(self, secret: str) -> Token | None:
        """Return the valid token of a secret; None if there is none."""
        digest = tokens.c.digest == secret_digest(secret)
        query = select(tokens).where(digest, tokens.c.revoked_at.is_(None))
        with self._database.read("token_find") as connection:
            row = connection.execute(query).mappings().first()
        return None if row is None else _token(row)

    def _insert(self, connection: Connection, name: str, scope: Scope) -> tuple[Token, str]:
        secret, now = new_secret(), self._clock(connection)
        values = {"name": name, "scope": scope, "digest": secret_digest(secret), "created_at": now}
        connection.execute(insert(tokens).values(values))
        note_change(connection, now, LOCAL, AuditAction.CREATE_TOKEN, name=name, scope=scope)
        return Token(name, scope, now), secret


def _token(row: Row) -> Token:
    return Token(row["name"], Scope(row["scope"]), row["created_at"], row["revoked_at"])


class Audit(Aggregate):
    """The audit log. Transactions that make users' changes add its entries; runners' do not."""

    def audit(
        self, *, job_id: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[AuditEntryView]:
        """Return a page of the audit log, newest first; of a job, which may be deleted, or all."""
        limit = checked_limit(limit)
        others = (column for column in audit.c if column is not audit.c.id)
        query = select(audit.c.id.label("index"), *others).order_by(audit.c.id.desc())
        if job_id is not None:
            query = query.where(audit.c.job_id == job_id)
        if after is not None:
            if not re.fullmatch(r"[0-9]{1,18}", after, re.ASCII):
                raise InvalidRequest(
                    "not a cursor of the audit log; pass the `next` of the page before",
                    field="after",
                )
            query = query.where(audit.c.id < int(after))
        with self._database.read("audit") as connection:
            rows = connection.execute(query.limit(limit + 1)).mappings().all()
        entries = [AuditEntryView(**row) for row in rows]
        return Page.of(entries, limit, lambda last: str(last.index))

    def forget_audit_before(self, moment: datetime) -> int:
        """Remove entries added before an aware time, and return their number."""
        with self._database.write("forget_audit_before") as connection:
            return connection.execute(delete(audit).where(audit.c.at < moment)).rowcount


def note_change(
    connection: Connection,
    now: datetime,
    actor: str,
    action: AuditAction,
    job_id: str | None = None,
    **details: Any,
) -> None:
    """Add an audit entry in the transaction of the change. The details are JSON without secrets."""
    entry = {"at": now, "actor": actor, "action": action, "job_id": job_id, "details": details}
    connection.execute(insert(audit), entry)


def check_quota(
    connection: Connection,
    owner: str | None,
    quota: Quota | None,
    *,
    new_jobs: int,
    new_seconds: float,
) -> None:
    """Raise QuotaExceeded for more unfinished jobs or simulated time [s] than an owner may have."""
    if quota is None:
        return
    if connection.dialect.name == "postgresql":
        # Two requests at once must not both take the last place.
        turn = func.hashtext(f"quota of {owner}")
        connection.execute(select(func.pg_advisory_xact_lock(turn)))
    total = func.coalesce(func.sum(jobs.c.simulated_seconds), 0.0)
    query = select(func.count(), total).where(
        jobs.c.state.not_in(ENDED),
        jobs.c.owner.is_(None) if owner is None else jobs.c.owner == owner,
    )
    count, seconds = connection.execute(query).one()
    quota.check(count, seconds, new_jobs=new_jobs, new_seconds=new_seconds)
