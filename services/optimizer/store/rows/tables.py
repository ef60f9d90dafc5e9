"""Tables of the store, the same on SQLite and PostgreSQL.

What is queried has a column; the rest is JSON. JSON documents that may outlive this code carry
their own schema version (`JobSpec.schema_version`, the optimizer's state); plain arrays belong
to the schema revision of the database.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any, Final

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Column,
    DateTime,
    Dialect,
    Double,
    ForeignKeyConstraint,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    PrimaryKeyConstraint,
    Table,
    Text,
    UniqueConstraint,
    text,
)
from sqlalchemy.sql.operators import OperatorType
from sqlalchemy.types import TypeDecorator, TypeEngine


class UtcDateTime(TypeDecorator[datetime]):
    """An aware time, UTC on the way out; SQLite, which knows no zones, holds it as naive UTC."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """An aware time to what the database holds.

        Args:
            value: The time, aware; None for none.
            dialect: Of the database.

        Returns:
            The same in UTC, naive for SQLite.

        Raises:
            ValueError: The time has no zone.
        """
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"a stored time needs its time zone, {value} has none")
        value = value.astimezone(UTC)
        return value.replace(tzinfo=None) if dialect.name == "sqlite" else value

    def process_result_value(
        self,
        value: datetime | None,
        dialect: Dialect,  # noqa: ARG002 (the signature is SQLAlchemy's)
    ) -> datetime | None:
        """What the database holds to an aware time in UTC.

        Args:
            value: As it was stored.
            dialect: Of the database.

        Returns:
            The time.
        """
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class UnparsedText(str):
    """The text of a JSON document that is none."""

    __slots__ = ()


class Document(TypeDecorator[Any]):
    """A JSON document; one that is damaged comes as its text.

    Raising instead would keep all other rows of the same query from whoever asks for them.
    """

    impl = JSON
    cache_ok = True

    def coerce_compared_value(self, op: OperatorType | None, value: Any) -> TypeEngine[Any]:
        """Let paths into the document be names, as JSON does.

        Args:
            op: An operator on the column.
            value: Its other operand.

        Returns:
            The type of that operand.
        """
        return self.impl_instance.coerce_compared_value(op, value)

    def result_processor(self, dialect: Dialect, coltype: object) -> Callable[[Any], Any] | None:
        """The parser of what the database holds.

        Args:
            dialect: Of the database.
            coltype: The driver's type of the column.

        Returns:
            A function of what the driver gives.
        """
        parse = super().result_processor(dialect, coltype)

        def parse_if_possible(text: Any) -> Any:
            try:
                return text if parse is None else parse(text)
            except (ValueError, RecursionError):
                return UnparsedText(text)

        return parse_if_possible


metadata: Final = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)

_DELETED: Final = text("deleted_at IS NOT NULL")

jobs: Final = Table(
    "jobs",
    metadata,
    Column("id", Text, nullable=False),
    Column("state", Text, nullable=False),
    Column("spec", Document, nullable=False),
    Column("idempotency_key", Text),
    Column("created_at", UtcDateTime, nullable=False),
    Column("updated_at", UtcDateTime, nullable=False),
    Column("started_at", UtcDateTime),
    Column("finished_at", UtcDateTime),
    Column("error", Text),
    # The token only ever grows; the owner is NULL whenever nobody holds the job.
    Column("lease_owner", Text),
    Column("lease_token", BigInteger, nullable=False),
    Column("lease_expires_at", UtcDateTime),
    # Committed iterations, which is also the index of the outstanding one.
    Column("iterations", Integer, nullable=False),
    Column("evaluations", BigInteger, nullable=False),
    Column("best_fitness", Double),
    Column("best_iteration", Integer),
    Column("best_particle", Integer),
    Column("compute_seconds", Double, nullable=False),
    # Iterations to run, where the job was extended; the spec stays what was submitted.
    Column("budget", Integer),
    # Of the request that the idempotency key came with; NULL without a key.
    Column("request_digest", Text),
    # `ProvenanceRecords`.
    Column("provenance", Document(none_as_null=True)),
    # From a resumption that accepts changes to the next claim; NULL is false.
    Column("accepts_changes", Boolean),
    # Of `evaluations`, those that needed no walk; NULL is none.
    Column("evaluations_saved", BigInteger),
    # Of a fork; no foreign key, for a fork outlives its parent. `Lineage` is the rest of it.
    Column("parent_id", Text),
    Column("lineage", Document(none_as_null=True)),
    # Name of the token that it was submitted with; NULL for none.
    Column("owner", Text),
    # Claims in a row that ended without a word, which tells a crash; NULL is none.
    Column("crashes", Integer),
    # What a running job waits for, as whoever runs it says; NULL for nothing.
    Column("waiting", Text),
    # That a design took in the last iterations, these the more the later; NULL before the first.
    Column("recent_seconds", Double),
    # Digest of its last committed iteration; NULL before the first.
    Column("head", Text),
    # Where its end is told; NULL for nowhere.
    Column("notify_url", Text),
    # Of a job that is no longer there for anybody, until all of its rows are removed.
    Column("deleted_at", UtcDateTime),
    # Whether it stays, however long ago it ended; NULL is false.
    Column("kept", Boolean),
    # Of all walks of all designs of its budget [s]; NULL where nobody has asked.
    Column("simulated_seconds", Double),
    # The higher, the sooner it is claimed.
    Column("priority", Integer, nullable=False, server_default="0"),
    # What people have written on it, `Labels`; NULL for nothing.
    Column("labels", Document(none_as_null=True)),
    # Whether it is out of the way in lists; NULL is false.
    Column("archived", Boolean),
    # What its best is measured against, `Reference`; NULL while nobody has found that out.
    Column("reference", Document(none_as_null=True)),
    # Its name, and all that a search looks through, as `search_columns` folds them; PostgreSQL
    # sorts by code points, as SQLite does.
    Column("sort_name", Text().with_variant(Text(collation="C"), "postgresql")),
    Column("search_text", Text),
    PrimaryKeyConstraint("id"),
    UniqueConstraint("idempotency_key"),
    Index(None, "created_at", "id"),
    Index(None, "state", "created_at", "id"),
    Index(None, "parent_id"),
    # Of deleted jobs alone: SQLite would take it to find all others, and then sort these.
    Index(None, "deleted_at", sqlite_where=_DELETED, postgresql_where=_DELETED),
    Index(None, "best_fitness", "id"),
    # All that jobs are found and sorted by. SQLite reads a row from its beginning on, and before
    # most of this comes the spec, with robots in it. A server has large documents elsewhere.
    Index(
        "ix_jobs_entries",
        "id",
        "created_at",
        "best_fitness",
        "evaluations",
        "state",
        "iterations",
        "priority",
        "compute_seconds",
        "reference",
        "lineage",
        "archived",
        "parent_id",
        "deleted_at",
        "sort_name",
        "search_text",
        sqlite_where=text("deleted_at IS NULL"),
    ).ddl_if(dialect="sqlite"),
)

EXISTING: Final = jobs.c.deleted_at.is_(None)
"""Condition on jobs that are there for their users."""

iterations: Final = Table(
    "iterations",
    metadata,
    Column("job_id", Text, nullable=False),
    Column("iteration", Integer, nullable=False),
    # The ask, stored before it is sent out: (particles, d) positions and the optimizer's dump; {}
    # once a later iteration is committed.
    Column("positions", Document, nullable=False),
    Column("optimizer_state", Document, nullable=False),
    Column("asked_at", UtcDateTime, nullable=False),
    # NULL from here on until the iteration is committed; then only fitness values may be NULL.
    Column("committed_at", UtcDateTime),
    Column("best", Double),
    Column("mean", Double),
    Column("median", Double),
    Column("worst", Double),
    Column("best_so_far", Double),
    Column("failed", Integer),
    Column("evaluate_seconds", Double),
    # Of positions and state, from the ask on; and of the iteration, chained to that of the one
    # before; NULL until it is committed.
    Column("ask_digest", Text),
    Column("digest", Text),
    PrimaryKeyConstraint("job_id", "iteration"),
    ForeignKeyConstraint(["job_id"], ["jobs.id"]),
)

evaluations: Final = Table(
    "evaluations",
    metadata,
    Column("job_id", Text, nullable=False),
    Column("iteration", Integer, nullable=False),
    Column("particle", Integer, nullable=False),
    # (v,) numbers; [K][m] numbers, null for none; (K,) labels; NULL fitness for +inf.
    Column("design", JSON, nullable=False),
    Column("objectives", JSON, nullable=False),
    Column("statuses", JSON, nullable=False),
    Column("fitness", Double),
    # Of what it was walked for; NULL for what was taken from another row.
    Column("walk_key", LargeBinary),
    PrimaryKeyConstraint("job_id", "iteration", "particle"),
    ForeignKeyConstraint(["job_id", "iteration"], ["iterations.job_id", "iterations.iteration"]),
    Index(None, "walk_key"),
)

# Designs of a search in single precision, evaluated anew in double; columns as in `evaluations`.
reevaluations: Final = Table(
    "reevaluations",
    metadata,
    Column("job_id", Text, nullable=False),
    Column("iteration", Integer, nullable=False),
    Column("particle", Integer, nullable=False),
    Column("objectives", JSON, nullable=False),
    Column("statuses", JSON, nullable=False),
    Column("fitness", Double),
    PrimaryKeyConstraint("job_id", "iteration", "particle"),
    ForeignKeyConstraint(
        ["job_id", "iteration", "particle"],
        ["evaluations.job_id", "evaluations.iteration", "evaluations.particle"],
    ),
)

recordings: Final = Table(
    "recordings",
    metadata,
    # Of the content: a recording never changes.
    Column("id", Text, nullable=False),
    Column("document", Document, nullable=False),
    Column("created_at", UtcDateTime, nullable=False),
    PrimaryKeyConstraint("id"),
)

tokens: Final = Table(
    "tokens",
    metadata,
    Column("name", Text, nullable=False),
    Column("scope", Text, nullable=False),
    # Of the secret, which is stored nowhere.
    Column("digest", Text, nullable=False),
    Column("created_at", UtcDateTime, nullable=False),
    Column("revoked_at", UtcDateTime),
    PrimaryKeyConstraint("name"),
    UniqueConstraint("digest"),
)

audit: Final = Table(
    "audit",
    metadata,
    Column("id", BigInteger().with_variant(Integer, "sqlite"), autoincrement=True),
    Column("at", UtcDateTime, nullable=False),
    # Name of a token, or "local".
    Column("actor", Text, nullable=False),
    Column("action", Text, nullable=False),
    # No foreign key: what was done to a job is known longer than the job.
    Column("job_id", Text),
    Column("details", JSON, nullable=False),
    PrimaryKeyConstraint("id"),
    Index(None, "job_id", "id"),
    # A number is never given twice, whatever is removed.
    sqlite_autoincrement=True,
)

notifications: Final = Table(
    "notifications",
    metadata,
    Column("id", Text, nullable=False),
    # No foreign key: one that is under way outlives its job.
    Column("job_id", Text, nullable=False),
    Column("url", Text, nullable=False),
    Column("document", JSON, nullable=False),
    Column("created_at", UtcDateTime, nullable=False),
    Column("attempts", Integer, nullable=False),
    # NULL once it was delivered or given up.
    Column("next_attempt_at", UtcDateTime),
    Column("delivered_at", UtcDateTime),
    Column("error", Text),
    PrimaryKeyConstraint("id"),
    Index(None, "next_attempt_at"),
    Index(None, "job_id"),
)
