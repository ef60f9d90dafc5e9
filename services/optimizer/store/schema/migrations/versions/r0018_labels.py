"""What people write on jobs: names, notes and tags; and jobs that are archived."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL for a job without labels, and for one that is not archived."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("labels", sa.JSON))
        jobs.add_column(sa.Column("archived", sa.Boolean))


def downgrade() -> None:
    """Drop them."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("archived")
        jobs.drop_column("labels")
