"""Jobs that are extended: a budget of their own beside the spec that was submitted."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; NULL is the spec's own budget."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("budget", sa.Integer))


def downgrade() -> None:
    """Drop it."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("budget")
