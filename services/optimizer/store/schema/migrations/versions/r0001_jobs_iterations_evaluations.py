"""Jobs, iterations and evaluations.

Types are spelled out, not imported from the tables: a migration stays what it was.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the three tables."""
    time = sa.DateTime(timezone=True)
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
        sa.PrimaryKeyConstraint("id", name="pk_jobs"),
        sa.UniqueConstraint("idempotency_key", name="uq_jobs_idempotency_key"),
    )
    op.create_index("ix_jobs_created_at_id", "jobs", ["created_at", "id"])
    op.create_index("ix_jobs_state_created_at_id", "jobs", ["state", "created_at", "id"])
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
        sa.PrimaryKeyConstraint("job_id", "iteration", "particle", name="pk_evaluations"),
        sa.ForeignKeyConstraint(
            ["job_id", "iteration"],
            ["iterations.job_id", "iterations.iteration"],
            name="fk_evaluations_iterations",
        ),
    )


def downgrade() -> None:
    """Drop everything."""
    op.drop_table("evaluations")
    op.drop_table("iterations")
    op.drop_table("jobs")
