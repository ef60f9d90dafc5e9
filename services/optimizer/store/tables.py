"""Tables, the same on SQLite and PostgreSQL

Columns are what is queried; the rest is JSON. A document that may outlive this code carries its own
schema version (`JobSpec.schema_version`, the optimizer's state); arrays belong to the revision of
the database.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
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

Row = Mapping[Any, Any]
"""Columns of a row by name."""


class UtcDateTime(TypeDecorator[datetime]):
    """An aware time, read as UTC. SQLite, which has no time zones, stores naive UTC."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"a stored time needs its time zone, {value} has none")
        value = value.astimezone(UTC)
        return value.replace(tzinfo=None) if dialect.name == "sqlite" else value

    def process_result_value(
        self,
        value: datetime | None,
        dialect: Dialect,  # noqa: ARG002
    ) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class UnparsedText(str):
    """A stored text that is not JSON."""

    __slots__ = ()


class Document(TypeDecorator[Any]):
    """A JSON document; a damaged one is read as `UnparsedText`, so that it hides no other row."""

    impl = JSON
    cache_ok = True

    def coerce_compared_value(self, op: OperatorType | None, value: Any) -> TypeEngine[Any]:
        # Paths into the document are names, as for JSON.
        return self.impl_instance.coerce_compared_value(op, value)

    def result_processor(self, dialect: Dialect, coltype: object) -> Callable[[Any], Any] | None:
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
    # The token never decreases; the owner is NULL while no runner holds the job.
    Column("lease_owner", Text),
    Column("lease_token", BigInteger, nullable=False),
    Column("lease_expires_at", UtcDateTime),
    # Number of committed iterations, and index of the next.
    Column("iterations", Integer, nullable=False),
    Column("evaluations", BigInteger, nullable=False),
    Column("best_fitness", Double),
    Column("best_iteration", Integer),
    Column("best_particle", Integer),
    Column("compute_seconds", Double, nullable=False),
    # Iterations to run if the job was extended; the spec stays as submitted.
    Column("budget", Integer),
    # Of the request with the idempotency key; NULL without a key.
    Column("request_digest", Text),
    # `ProvenanceRecords`.
    Column("provenance", Document(none_as_null=True)),
    # See `Job.accepts_changes`; NULL is false.
    Column("accepts_changes", Boolean),
    # Evaluations answered from the cache; NULL is none.
    Column("evaluations_saved", BigInteger),
    # Of a fork; no foreign key, as a fork outlives its parent.
    Column("parent_id", Text),
    Column("lineage", Document(none_as_null=True)),
    # Name of the token it was submitted with; NULL for none.
    Column("owner", Text),
    # Consecutive claims whose lease expired; NULL is none.
    Column("crashes", Integer),
    # Reason for waiting while running; NULL if it does not wait.
    Column("waiting", Text),
    # `Progress.recent_seconds`.
    Column("recent_seconds", Double),
    # Digest of the last committed iteration; NULL before the first.
    Column("head", Text),
    # URL notified of the job's end.
    Column("notify_url", Text),
    # Set from deletion until all rows are removed.
    Column("deleted_at", UtcDateTime),
    # Protected from deletion; NULL is false.
    Column("kept", Boolean),
    # Simulated time of the whole budget [s]; NULL if unknown.
    Column("simulated_seconds", Double),
    # Higher priorities are claimed first.
    Column("priority", Integer, nullable=False, server_default="0"),
    # `Labels`; NULL for none.
    Column("labels", Document(none_as_null=True)),
    # Hidden in lists; NULL is false.
    Column("archived", Boolean),
    # `Reference`; NULL until determined.
    Column("reference", Document(none_as_null=True)),
    # Folded name and searched text, see `search_columns`; sorted by code points in both databases.
    Column("sort_name", Text().with_variant(Text(collation="C"), "postgresql")),
    Column("search_text", Text),
    PrimaryKeyConstraint("id"),
    UniqueConstraint("idempotency_key"),
    Index(None, "created_at", "id"),
    Index(None, "state", "created_at", "id"),
    Index(None, "parent_id"),
    # Of deleted jobs only: SQLite would use a full index to find all others, and sort these.
    Index(None, "deleted_at", sqlite_where=_DELETED, postgresql_where=_DELETED),
    Index(None, "best_fitness", "id"),
    # Columns that lists filter and sort by. SQLite reads rows from their start, where the spec,
    # which may be large, precedes them; PostgreSQL stores large documents apart.
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
"""Condition on jobs that are not deleted."""

iterations: Final = Table(
    "iterations",
    metadata,
    Column("job_id", Text, nullable=False),
    Column("iteration", Integer, nullable=False),
    # The ask: (particles, d) positions and the optimizer's state, {} once a later iteration is
    # committed.
    Column("positions", Document, nullable=False),
    Column("optimizer_state", Document, nullable=False),
    Column("asked_at", UtcDateTime, nullable=False),
    # The following are NULL until the iteration is committed, the statistics also if all designs
    # failed.
    Column("committed_at", UtcDateTime),
    Column("best", Double),
    Column("mean", Double),
    Column("median", Double),
    Column("worst", Double),
    Column("best_so_far", Double),
    Column("failed", Integer),
    Column("evaluate_seconds", Double),
    # Of positions and state, and of the committed iteration, chained to the previous one.
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
    # (v,) numbers; (K, m) numbers, null for NaN; (K,) labels; a fitness of +inf is NULL.
    Column("design", JSON, nullable=False),
    Column("objectives", JSON, nullable=False),
    Column("statuses", JSON, nullable=False),
    Column("fitness", Double),
    # Key of the simulated design; NULL if the outcome was cached.
    Column("walk_key", LargeBinary),
    PrimaryKeyConstraint("job_id", "iteration", "particle"),
    ForeignKeyConstraint(["job_id", "iteration"], ["iterations.job_id", "iterations.iteration"]),
    Index(None, "walk_key"),
)

# Best designs of searches in single precision, evaluated again in double.
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
    # Digest of the content.
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
    # Of the secret, which is not stored.
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
    Column("actor", Text, nullable=False),
    Column("action", Text, nullable=False),
    # No foreign key: entries outlive their job.
    Column("job_id", Text),
    Column("details", JSON, nullable=False),
    PrimaryKeyConstraint("id"),
    Index(None, "job_id", "id"),
    # An id is never reused.
    sqlite_autoincrement=True,
)

notifications: Final = Table(
    "notifications",
    metadata,
    Column("id", Text, nullable=False),
    # No foreign key: a notification outlives its job.
    Column("job_id", Text, nullable=False),
    Column("url", Text, nullable=False),
    Column("document", JSON, nullable=False),
    Column("created_at", UtcDateTime, nullable=False),
    Column("attempts", Integer, nullable=False),
    # NULL once delivered or given up.
    Column("next_attempt_at", UtcDateTime),
    Column("delivered_at", UtcDateTime),
    Column("error", Text),
    PrimaryKeyConstraint("id"),
    Index(None, "next_attempt_at"),
    Index(None, "job_id"),
)
