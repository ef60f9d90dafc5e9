"""Jobs that are deleted, and jobs that are to be kept."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL for a job that is there, and that may be deleted when it is old."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("deleted_at", sa.DateTime(timezone=True)))
        jobs.add_column(sa.Column("kept", sa.Boolean))
    op.create_index("ix_jobs_deleted_at", "jobs", ["deleted_at"])


def downgrade() -> None:
    """Drop them."""
    op.drop_index("ix_jobs_deleted_at", "jobs")
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("kept")
        jobs.drop_column("deleted_at")
