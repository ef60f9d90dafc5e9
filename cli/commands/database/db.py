"""`gaitswarm db`: the database as a whole, whatever jobs are in it."""

from __future__ import annotations

import typer

from cli.options import Db


def register(app: typer.Typer) -> None:
    """Add the group of commands."""
    group = typer.Typer(help="Upgrade, check, back up, restore and prune the database.")
    group.command()(upgrade)
    app.add_typer(group, name="db")


def upgrade(db: Db = None) -> None:
    """Bring the database to this version's schema. No other command does.

    It must not be in use, and a backup of it is advisable.
    """
    from cli.output import note
    from services.optimizer.store import migrate
    from services.optimizer.store.revisions import head

    before = migrate.upgrade(_database(db))
    if before == head():
        note(f"the database has this version's schema already, revision {before}")
    else:
        note(f"the database has schema revision {head()} now, after {before or 'none'}")


def _database(db: str | None) -> str:
    """That of the option or the environment; NotFound for an SQLite file that is not there."""
    from gaitswarm.jobs.open import database_to_read
    from gaitswarm.settings import read_settings

    return database_to_read(read_settings(db=db or None))
