"""Indexes by which the job list is read in its orders."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

_DELETED = sa.text("deleted_at IS NOT NULL")


def upgrade() -> None:
    """Let the index of deleted jobs hold no others: SQLite took it to find all that are there."""
    op.drop_index("ix_jobs_deleted_at", "jobs")
    op.create_index(
        "ix_jobs_deleted_at",
        "jobs",
        ["deleted_at"],
        sqlite_where=_DELETED,
        postgresql_where=_DELETED,
    )
    op.create_index("ix_jobs_best_fitness_id", "jobs", ["best_fitness", "id"])


def downgrade() -> None:
    """Let it hold all jobs again."""
    op.drop_index("ix_jobs_best_fitness_id", "jobs")
    op.drop_index("ix_jobs_deleted_at", "jobs")
    op.create_index("ix_jobs_deleted_at", "jobs", ["deleted_at"])
