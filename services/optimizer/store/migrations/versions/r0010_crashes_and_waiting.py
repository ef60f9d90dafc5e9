"""Jobs say how many runner processes went down with them, and what they wait for."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL for no crash, and for a job that waits for nothing."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("crashes", sa.Integer))
        jobs.add_column(sa.Column("waiting", sa.Text))


def downgrade() -> None:
    """Drop them."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("waiting")
        jobs.drop_column("crashes")
