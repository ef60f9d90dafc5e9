"""What a job's numbers depend on, since which iteration."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL is a job whose provenance nobody recorded."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("provenance", sa.JSON))
        jobs.add_column(sa.Column("accepts_changes", sa.Boolean))


def downgrade() -> None:
    """Drop them."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("accepts_changes")
        jobs.drop_column("provenance")
