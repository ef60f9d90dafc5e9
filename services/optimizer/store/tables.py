"""Tables, the same on SQLite and PostgreSQL

Columns are what is queried; the rest is JSON, and arrays of numbers are little-endian float64. A
document that may outlive this code carries its own schema version (`JobSpec.schema_version`, the
optimizer's state).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.types import TypeDecorator

from gaitswarm.services.optimizer.errors import StoreUnavailable

Row = Mapping[Any, Any]
"""Columns of a row by name."""


class UtcDateTime(TypeDecorator[datetime]):
    """An aware time, read as UTC. SQLite, which has no time zones, stores naive UTC."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"a stored time needs its time zone, {value} has none")
        value = value.astimezone(UTC)
        return value.replace(tzinfo=None) if dialect.name == "sqlite" else value

    def result_processor(self, dialect: sa.Dialect, coltype: object) -> Callable[[Any], Any] | None:
        parse = self.impl_instance.result_processor(dialect, coltype)

        def aware(raw: Any) -> datetime | None:
            try:
                value: datetime | None = raw if parse is None else parse(raw)
            except (TypeError, ValueError) as error:
                raise StoreUnavailable(
                    f"the database is damaged: a stored time is {str(raw)[:40]!r}; put a backup in"
                    " its place"
                ) from error
            if value is None:
                return None
            return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)

        return aware


metadata: Final = sa.MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)

_DELETED: Final = sa.text("deleted_at IS NOT NULL")

jobs: Final = sa.Table(
    "jobs",
    metadata,
    sa.Column("id", sa.Text, primary_key=True),
    sa.Column("state", sa.Text, nullable=False),
    sa.Column("spec", sa.JSON, nullable=False),
    sa.Column("idempotency_key", sa.Text, unique=True),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("updated_at", UtcDateTime, nullable=False),
    sa.Column("started_at", UtcDateTime),
    sa.Column("finished_at", UtcDateTime),
    sa.Column("error", sa.Text),
    # The token never decreases; the owner is NULL while no runner holds the job.
    sa.Column("lease_owner", sa.Text),
    sa.Column("lease_token", sa.BigInteger, nullable=False, default=0),
    sa.Column("lease_renewed_at", UtcDateTime),
    sa.Column("lease_expires_at", UtcDateTime),
    # Number of committed iterations, and index of the next.
    sa.Column("iterations", sa.Integer, nullable=False, default=0),
    sa.Column("evaluations", sa.BigInteger, nullable=False, default=0),
    sa.Column("best_fitness", sa.Double),
    sa.Column("best_iteration", sa.Integer),
    sa.Column("best_particle", sa.Integer),
    # `Progress.infeasible` and `Progress.least_violation`.
    sa.Column("infeasible", sa.BigInteger, nullable=False, server_default="0"),
    sa.Column("least_violation", sa.Double),
    sa.Column("compute_seconds", sa.Double, nullable=False, default=0.0),
    # Iterations to run if the job was extended; the spec stays as submitted.
    sa.Column("budget", sa.Integer),
    # Of the request with the idempotency key; NULL without a key.
    sa.Column("request_digest", sa.Text),
    sa.Column("provenance", sa.JSON(none_as_null=True)),  # `ProvenanceRecords`
    # See `Job.accepts_changes`.
    sa.Column("accepts_changes", sa.Boolean, nullable=False, server_default=sa.false()),
    # Evaluations answered from the cache, and those taken over by a fork.
    sa.Column("evaluations_saved", sa.BigInteger, nullable=False, server_default="0"),
    sa.Column("evaluations_taken", sa.BigInteger, nullable=False, server_default="0"),
    # Of a fork; no foreign key, as a fork outlives its parent.
    sa.Column("parent_id", sa.Text, index=True),
    sa.Column("lineage", sa.JSON(none_as_null=True)),
    sa.Column("owner", sa.Text),  # name of the token it was submitted with; NULL for none
    # Consecutive claims whose lease expired.
    sa.Column("crashes", sa.Integer, nullable=False, server_default="0"),
    sa.Column("waiting", sa.Text),  # reason for waiting while running; NULL if it does not wait
    sa.Column("recent_seconds", sa.Double),  # `Progress.recent_seconds`
    sa.Column("head", sa.Text),  # digest of the last committed iteration; NULL before the first
    sa.Column("notify_url", sa.Text),  # URL notified of the job's end
    sa.Column("deleted_at", UtcDateTime),  # set from deletion until all rows are removed
    # Protected from deletion.
    sa.Column("kept", sa.Boolean, nullable=False, server_default=sa.false()),
    # Simulated time of the whole budget [s]; NULL if unknown.
    sa.Column("simulated_seconds", sa.Double),
    # Higher priorities are claimed first.
    sa.Column("priority", sa.Integer, nullable=False, server_default="0"),
    sa.Column("labels", sa.JSON(none_as_null=True)),  # `Labels`; NULL for none
    sa.Column("archived", sa.Boolean, nullable=False, server_default=sa.false()),  # hidden in lists
    # `Reference`; NULL until determined, the kind until then only.
    sa.Column("reference_name", sa.Text),
    sa.Column("reference_fitness", sa.Double),
    sa.Column("reference_kind", sa.Text),
    sa.Column("reference_results", sa.LargeBinary),
    # What lists filter by. Of the spec: kind and names, see `labels.py`; of the labels: tags, each
    # between line ends.
    *(sa.Column(n, sa.Text) for n in ("kind", "robot", "controller", "preference", "tags")),
    # Folded name and searched text; sorted by code points in both databases.
    sa.Column("sort_name", sa.Text().with_variant(sa.Text(collation="C"), "postgresql")),
    sa.Column("search_text", sa.Text),
    sa.Column("evaluated_on", sa.Text),  # where the last iteration was simulated; NULL if unknown
    sa.Index(None, "created_at", "id"),
    sa.Index(None, "state", "created_at", "id"),
    # Of deleted jobs only: SQLite would use a full index to find all others, and sort these.
    sa.Index(None, "deleted_at", sqlite_where=_DELETED),
    sa.Index(None, "best_fitness", "id"),
    # Columns that lists filter and sort by. SQLite reads rows from their start, where the spec,
    # which may be large, precedes them; PostgreSQL stores large documents apart.
    sa.Index(
        "ix_jobs_entries",
        *("id", "created_at", "best_fitness", "evaluations", "state", "iterations", "priority"),
        *("compute_seconds", "reference_fitness", "evaluations_taken", "archived", "parent_id"),
        *("deleted_at", "sort_name", "search_text"),
        *("kind", "robot", "controller", "preference", "tags"),
        sqlite_where=sa.text("deleted_at IS NULL"),
    ).ddl_if(dialect="sqlite"),
)

EXISTING: Final = jobs.c.deleted_at.is_(None)
"""Condition on jobs that are not deleted."""

iterations: Final = sa.Table(
    "iterations",
    metadata,
    sa.Column("job_id", sa.ForeignKey("jobs.id"), primary_key=True),
    sa.Column("iteration", sa.Integer, primary_key=True),
    # The ask: (designs, d) positions and the optimizer's state, {} once a later iteration is
    # committed.
    sa.Column("designs", sa.Integer, nullable=False),
    sa.Column("positions", sa.LargeBinary, nullable=False),
    sa.Column("optimizer_state", sa.JSON, nullable=False),
    sa.Column("asked_at", UtcDateTime, nullable=False),
    # The following are NULL until the iteration is committed, the statistics also if all designs
    # failed.
    sa.Column("committed_at", UtcDateTime),
    *(sa.Column(n, sa.Double) for n in ("best", "mean", "median", "worst", "best_so_far")),
    *(sa.Column(n, sa.Integer) for n in ("failed", "infeasible")),
    sa.Column("least_violation", sa.Double),
    sa.Column("evaluate_seconds", sa.Double),
    # Of positions and state, and of the committed iteration, chained to the previous one.
    sa.Column("ask_digest", sa.Text),
    sa.Column("digest", sa.Text),
)

evaluations: Final = sa.Table(
    "evaluations",
    metadata,
    sa.Column("job_id", sa.Text, primary_key=True),
    sa.Column("iteration", sa.Integer, primary_key=True),
    sa.Column("particle", sa.Integer, primary_key=True),
    # (v,) and (K, m) float64; K bytes, values of `Status`.
    *(sa.Column(n, sa.LargeBinary, nullable=False) for n in ("design", "objectives", "statuses")),
    sa.Column("fitness", sa.Double, nullable=False),
    # Key of the simulated design; NULL if the outcome was cached.
    sa.Column("walk_key", sa.LargeBinary, index=True),
    sa.ForeignKeyConstraint(["job_id", "iteration"], ["iterations.job_id", "iterations.iteration"]),
)

# Best designs of searches in single precision, evaluated again in double.
reevaluations: Final = sa.Table(
    "reevaluations",
    metadata,
    sa.Column("job_id", sa.Text, primary_key=True),
    sa.Column("iteration", sa.Integer, primary_key=True),
    sa.Column("particle", sa.Integer, primary_key=True),
    *(sa.Column(n, sa.LargeBinary, nullable=False) for n in ("objectives", "statuses")),
    sa.Column("fitness", sa.Double, nullable=False),
    sa.ForeignKeyConstraint(
        ["job_id", "iteration", "particle"],
        ["evaluations.job_id", "evaluations.iteration", "evaluations.particle"],
    ),
)

# Outcomes of finished tasks of open asks, so that a crash loses little of a long iteration.
journal: Final = sa.Table(
    "journal",
    metadata,
    sa.Column("id", sa.BigInteger().with_variant(sa.Integer, "sqlite"), primary_key=True),
    sa.Column("job_id", sa.Text, nullable=False, index=True),
    sa.Column("iteration", sa.Integer, nullable=False),
    sa.Column("case_index", sa.Integer, nullable=False),
    # n keys of designs; (n, m) float64; n bytes, values of `Status`.
    *(sa.Column(n, sa.LargeBinary, nullable=False) for n in ("keys", "objectives", "statuses")),
    sa.ForeignKeyConstraint(["job_id", "iteration"], ["iterations.job_id", "iterations.iteration"]),
)

recordings: Final = sa.Table(
    "recordings",
    metadata,
    # Digest of the content.
    sa.Column("id", sa.Text, primary_key=True),
    sa.Column("document", sa.JSON, nullable=False),
    sa.Column("created_at", UtcDateTime, nullable=False),
    # What a list shows of it; see `RecordingEntry`.
    *(sa.Column(n, sa.Text, nullable=False) for n in ("scenario", "controller")),
    *(sa.Column(n, sa.Integer, nullable=False) for n in ("size", "joints", "rows")),
    sa.Column("synthetic", sa.Boolean, nullable=False),
)

tokens: Final = sa.Table(
    "tokens",
    metadata,
    sa.Column("name", sa.Text, primary_key=True),
    sa.Column("scope", sa.Text, nullable=False),
    # Of the secret, which is not stored.
    sa.Column("digest", sa.Text, nullable=False, unique=True),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("revoked_at", UtcDateTime),
)

audit: Final = sa.Table(
    "audit",
    metadata,
    sa.Column("id", sa.BigInteger().with_variant(sa.Integer, "sqlite"), primary_key=True),
    sa.Column("at", UtcDateTime, nullable=False),
    sa.Column("actor", sa.Text, nullable=False),
    sa.Column("action", sa.Text, nullable=False),
    # No foreign key: entries outlive their job.
    sa.Column("job_id", sa.Text),
    sa.Column("details", sa.JSON, nullable=False),
    sa.Index(None, "job_id", "id"),
    # An id is never reused.
    sqlite_autoincrement=True,
)

notifications: Final = sa.Table(
    "notifications",
    metadata,
    sa.Column("id", sa.Text, primary_key=True),
    # No foreign key: a notification outlives its job.
    sa.Column("job_id", sa.Text, nullable=False, index=True),
    sa.Column("url", sa.Text, nullable=False),
    sa.Column("document", sa.JSON, nullable=False),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("attempts", sa.Integer, nullable=False),
    # NULL once delivered or given up.
    sa.Column("next_attempt_at", UtcDateTime, index=True),
    sa.Column("delivered_at", UtcDateTime),
    sa.Column("error", sa.Text),
)
