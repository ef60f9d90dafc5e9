"""Jobs know which request made them, so that a repeated one is told from another."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; NULL for jobs whose request nobody kept."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("request_digest", sa.Text))


def downgrade() -> None:
    """Drop it."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("request_digest")
