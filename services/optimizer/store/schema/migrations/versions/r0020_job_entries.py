"""What jobs are found and sorted by, apart from the specs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None

_COLUMNS = [
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
]


def upgrade() -> None:
    """Let SQLite read it from an index; a server's rows have large documents elsewhere."""
    if op.get_bind().dialect.name == "sqlite":
        there = sa.text("deleted_at IS NULL")
        op.create_index("ix_jobs_entries", "jobs", _COLUMNS, sqlite_where=there)


def downgrade() -> None:
    """Read it from the rows."""
    if op.get_bind().dialect.name == "sqlite":
        op.drop_index("ix_jobs_entries", "jobs")
