"""What jobs are planned to walk, by which quotas count."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; NULL for a job that was stored before, which counts as none."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("simulated_seconds", sa.Double))


def downgrade() -> None:
    """Drop it."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("simulated_seconds")
