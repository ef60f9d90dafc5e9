"""Jobs say how many runners went down with them, what they wait for, and their pace of late."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL for no crash, for a job that waits for nothing, and for no pace yet."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("crashes", sa.Integer))
        jobs.add_column(sa.Column("waiting", sa.Text))
        jobs.add_column(sa.Column("recent_seconds", sa.Double))


def downgrade() -> None:
    """Drop them."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("recent_seconds")
        jobs.drop_column("waiting")
        jobs.drop_column("crashes")
