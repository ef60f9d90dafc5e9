"""Evaluations are found again by what they depend on, and jobs count those that were."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL for what was stored before, which is not found again."""
    with op.batch_alter_table("evaluations") as evaluations:
        evaluations.add_column(sa.Column("walk_key", sa.LargeBinary))
    op.create_index("ix_evaluations_walk_key", "evaluations", ["walk_key"])
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("evaluations_saved", sa.BigInteger))


def downgrade() -> None:
    """Drop them."""
    op.drop_index("ix_evaluations_walk_key", "evaluations")
    with op.batch_alter_table("evaluations") as evaluations:
        evaluations.drop_column("walk_key")
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("evaluations_saved")
