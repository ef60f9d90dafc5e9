"""The first schema, revision 0020, from which migrations are tested."""

from __future__ import annotations

import sqlalchemy as sa
from alembic.migration import MigrationContext
from alembic.operations import Operations


def create_first_schema(connection: sa.Connection) -> None:
    """Create the tables as the first version did."""
    op = Operations(MigrationContext.configure(connection))
    time = sa.DateTime(timezone=True)
    op.create_table(
        "audit",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer, "sqlite"), autoincrement=True),
        sa.Column("at", time, nullable=False),
        sa.Column("actor", sa.Text, nullable=False),
        sa.Column("action", sa.Text, nullable=False),
        sa.Column("job_id", sa.Text),
        sa.Column("details", sa.JSON, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_audit"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_audit_job_id_id", "audit", ["job_id", "id"])
    op.create_table(
        "jobs",
        sa.Column("id", sa.Text, nullable=False),
        sa.Column("state", sa.Text, nullable=False),
        sa.Column("spec", sa.JSON, nullable=False),
        sa.Column("idempotency_key", sa.Text),
        sa.Column("created_at", time, nullable=False),
        sa.Column("updated_at", time, nullable=False),
        sa.Column("started_at", time),
        sa.Column("finished_at", time),
        sa.Column("error", sa.Text),
        sa.Column("lease_owner", sa.Text),
        sa.Column("lease_token", sa.BigInteger, nullable=False),
        sa.Column("lease_expires_at", time),
        sa.Column("iterations", sa.Integer, nullable=False),
        sa.Column("evaluations", sa.BigInteger, nullable=False),
        sa.Column("best_fitness", sa.Double),
        sa.Column("best_iteration", sa.Integer),
        sa.Column("best_particle", sa.Integer),
        sa.Column("compute_seconds", sa.Double, nullable=False),
        sa.Column("budget", sa.Integer),
        sa.Column("request_digest", sa.Text),
        sa.Column("provenance", sa.JSON),
        sa.Column("accepts_changes", sa.Boolean),
        sa.Column("evaluations_saved", sa.BigInteger),
        sa.Column("parent_id", sa.Text),
        sa.Column("lineage", sa.JSON),
        sa.Column("owner", sa.Text),
        sa.Column("crashes", sa.Integer),
        sa.Column("waiting", sa.Text),
        sa.Column("recent_seconds", sa.Double),
        sa.Column("head", sa.Text),
        sa.Column("notify_url", sa.Text),
        sa.Column("deleted_at", time),
        sa.Column("kept", sa.Boolean),
        sa.Column("simulated_seconds", sa.Double),
        sa.Column("priority", sa.Integer, nullable=False, server_default="0"),
        sa.Column("labels", sa.JSON),
        sa.Column("archived", sa.Boolean),
        sa.Column("reference", sa.JSON),
        sa.PrimaryKeyConstraint("id", name="pk_jobs"),
        sa.UniqueConstraint("idempotency_key", name="uq_jobs_idempotency_key"),
    )
    op.create_index("ix_jobs_best_fitness_id", "jobs", ["best_fitness", "id"])
    op.create_index("ix_jobs_created_at_id", "jobs", ["created_at", "id"])
    op.create_index(
        "ix_jobs_deleted_at",
        "jobs",
        ["deleted_at"],
        sqlite_where=sa.text("deleted_at IS NOT NULL"),
        postgresql_where=sa.text("deleted_at IS NOT NULL"),
    )
    if connection.dialect.name == "sqlite":
        op.create_index(
            "ix_jobs_entries",
            "jobs",
            [
                "id",
                "created_at",
                "best_fitness",
                "evaluations",
                "state",
                "labels",
                "iterations",
                "priority",
                "compute_seconds",
                "reference",
                "lineage",
                "archived",
                "parent_id",
                "deleted_at",
            ],
            sqlite_where=sa.text("deleted_at IS NULL"),
        )
    op.create_index("ix_jobs_parent_id", "jobs", ["parent_id"])
    op.create_index("ix_jobs_state_created_at_id", "jobs", ["state", "created_at", "id"])
    op.create_table(
        "notifications",
        sa.Column("id", sa.Text, nullable=False),
        sa.Column("job_id", sa.Text, nullable=False),
        sa.Column("url", sa.Text, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("created_at", time, nullable=False),
        sa.Column("attempts", sa.Integer, nullable=False),
        sa.Column("next_attempt_at", time),
        sa.Column("delivered_at", time),
        sa.Column("error", sa.Text),
        sa.PrimaryKeyConstraint("id", name="pk_notifications"),
    )
    op.create_index("ix_notifications_job_id", "notifications", ["job_id"])
    op.create_index("ix_notifications_next_attempt_at", "notifications", ["next_attempt_at"])
    op.create_table(
        "recordings",
        sa.Column("id", sa.Text, nullable=False),
        sa.Column("document", sa.JSON, nullable=False),
        sa.Column("created_at", time, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_recordings"),
    )
    op.create_table(
        "tokens",
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("scope", sa.Text, nullable=False),
        sa.Column("digest", sa.Text, nullable=False),
        sa.Column("created_at", time, nullable=False),
        sa.Column("revoked_at", time),
        sa.PrimaryKeyConstraint("name", name="pk_tokens"),
        sa.UniqueConstraint("digest", name="uq_tokens_digest"),
    )
    op.create_table(
        "iterations",
        sa.Column("job_id", sa.Text, nullable=False),
        sa.Column("iteration", sa.Integer, nullable=False),
        sa.Column("positions", sa.JSON, nullable=False),
        sa.Column("optimizer_state", sa.JSON, nullable=False),
        sa.Column("asked_at", time, nullable=False),
        sa.Column("committed_at", time),
        sa.Column("best", sa.Double),
        sa.Column("mean", sa.Double),
        sa.Column("median", sa.Double),
        sa.Column("worst", sa.Double),
        sa.Column("best_so_far", sa.Double),
        sa.Column("failed", sa.Integer),
        sa.Column("evaluate_seconds", sa.Double),
        sa.Column("ask_digest", sa.Text),
        sa.Column("digest", sa.Text),
        sa.PrimaryKeyConstraint("job_id", "iteration", name="pk_iterations"),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"], name="fk_iterations_jobs"),
    )
    op.create_table(
        "evaluations",
        sa.Column("job_id", sa.Text, nullable=False),
        sa.Column("iteration", sa.Integer, nullable=False),
        sa.Column("particle", sa.Integer, nullable=False),
        sa.Column("design", sa.JSON, nullable=False),
        sa.Column("objectives", sa.JSON, nullable=False),
        sa.Column("statuses", sa.JSON, nullable=False),
        sa.Column("fitness", sa.Double),
        sa.Column("walk_key", sa.LargeBinary),
        sa.PrimaryKeyConstraint("job_id", "iteration", "particle", name="pk_evaluations"),
        sa.ForeignKeyConstraint(
            ["job_id", "iteration"],
            ["iterations.job_id", "iterations.iteration"],
            name="fk_evaluations_iterations",
        ),
    )
    op.create_index("ix_evaluations_walk_key", "evaluations", ["walk_key"])
    op.create_table(
        "reevaluations",
        sa.Column("job_id", sa.Text, nullable=False),
        sa.Column("iteration", sa.Integer, nullable=False),
        sa.Column("particle", sa.Integer, nullable=False),
        sa.Column("objectives", sa.JSON, nullable=False),
        sa.Column("statuses", sa.JSON, nullable=False),
        sa.Column("fitness", sa.Double),
        sa.PrimaryKeyConstraint("job_id", "iteration", "particle", name="pk_reevaluations"),
        sa.ForeignKeyConstraint(
            ["job_id", "iteration", "particle"],
            ["evaluations.job_id", "evaluations.iteration", "evaluations.particle"],
            name="fk_reevaluations_evaluations",
        ),
    )
    op.create_table(
        "alembic_version",
        sa.Column("version_num", sa.String(32), nullable=False),
        sa.PrimaryKeyConstraint("version_num", name="alembic_version_pkc"),
    )
    connection.execute(sa.text("INSERT INTO alembic_version VALUES ('0020')"))
