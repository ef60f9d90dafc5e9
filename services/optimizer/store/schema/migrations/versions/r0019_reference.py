"""What the best of a job is measured against."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; NULL for jobs of which nobody has found it out."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("reference", sa.JSON))


def downgrade() -> None:
    """Drop it."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("reference")
