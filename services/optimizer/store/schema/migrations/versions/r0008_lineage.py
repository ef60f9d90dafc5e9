"""Jobs that were forked say from which job, and what they took over of it."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL for a job that was not forked."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("parent_id", sa.Text))
        jobs.add_column(sa.Column("lineage", sa.JSON))
    op.create_index("ix_jobs_parent_id", "jobs", ["parent_id"])


def downgrade() -> None:
    """Drop them."""
    op.drop_index("ix_jobs_parent_id", "jobs")
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("lineage")
        jobs.drop_column("parent_id")
