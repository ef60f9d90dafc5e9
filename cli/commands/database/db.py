"""`gaitswarm db`: the database as a whole, whatever jobs are in it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from gaitswarm.cli.inputs.options import Db, Json

Force = Annotated[bool, typer.Option("--force", help="Replace what is there.")]


def register(app: typer.Typer) -> None:
    """Add the group of commands."""
    group = typer.Typer(help="Upgrade, check, back up, restore and prune the database.")
    for command in (upgrade, check, backup, restore, prune):
        group.command()(command)
    app.add_typer(group, name="db")


def upgrade(db: Db = None) -> None:
    """Bring the database to this version's schema. No other command does.

    It must not be in use, and a backup of it is advisable.
    """
    from gaitswarm.cli.output import note
    from gaitswarm.services.optimizer.store.schema import migrate
    from gaitswarm.services.optimizer.store.schema.revisions import head

    before = migrate.upgrade(_database(db))
    if before == head():
        note(f"the database has this version's schema already, revision {before}")
    else:
        note(f"the database has schema revision {head()} now, after {before or 'none'}")


def check(
    skip_histories: Annotated[
        bool,
        typer.Option("--skip-histories", help="Compute no chain of a history again."),
    ] = False,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Read all of the database, and look for what contradicts itself. Jobs may run meanwhile.

    The history of every job is compared with its digests. Exit code 1 if there is anything.
    """
    import json
    from contextlib import closing

    from gaitswarm.cli.exit_codes import CheckFailed
    from gaitswarm.cli.output import note, print_text
    from gaitswarm.services.optimizer.analysis.verification import check_histories
    from gaitswarm.services.optimizer.store.schema import maintenance
    from gaitswarm.services.optimizer.store.sql_store import open_store

    database = _database(db)
    findings = maintenance.check(database)
    if not skip_histories:
        with closing(open_store(database)) as store:
            findings += check_histories(store)
    if as_json:
        print_text(json.dumps(findings, indent=2) + "\n")
    else:
        print_text("".join(f"{finding}\n" for finding in findings))
    if findings:
        raise CheckFailed(f"the database is not as it should be: {len(findings)} findings")
    note("the database is as it should be")


def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="To be made.")],
    force: Force = False,
    db: Db = None,
) -> None:
    """Write all that the database holds at one moment to a file. Jobs may run meanwhile.

    The file is an SQLite database, whatever the database is.
    """
    from gaitswarm.cli.output import note
    from gaitswarm.services.optimizer.store.schema import backup

    backup.backup(_database(db), file, overwrite=force)
    note(f"{file} holds all of the database")


def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="As `backup` made it.")],
    force: Force = False,
    db: Db = None,
) -> None:
    """Fill an empty database with a backup. It must not be in use.

    A backup by an older version comes in this version's schema, one of SQLite may be restored to
    PostgreSQL, and the other way round.
    """
    from gaitswarm.cli.output import note
    from gaitswarm.jobs.open import database_to_write
    from gaitswarm.services.optimizer.store.schema import backup
    from gaitswarm.settings import read_settings

    backup.restore(database_to_write(read_settings(db=db or None)), file, overwrite=force)
    note(f"the database holds what {file} does")


def prune(
    older_than: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="DAYS", help="Delete jobs that ended so long ago, too."),
    ] = None,
    state: Annotated[
        Literal["succeeded", "failed", "cancelled"] | None,
        typer.Option(help="With --older-than: only jobs that ended so [default: all]."),
    ] = None,
    audit_older_than: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="DAYS", help="Remove older entries of the audit log, too."),
    ] = None,
    db: Db = None,
) -> None:
    """Remove recorded walks that no job refers to, a day after they came, and free their space.

    With --older-than also jobs, but for those that are kept and those with forks under way.
    """
    from datetime import timedelta

    from gaitswarm.cli.output import note
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.jobs.job import ENDED, JobState
    from gaitswarm.services.optimizer.store.schema import maintenance

    if state is not None and older_than is None:
        raise InvalidRequest("deletes nothing without --older-than", field="state")
    removed = maintenance.prune(
        _database(db),
        older_than=None if older_than is None else timedelta(days=older_than),
        states=ENDED if state is None else {JobState(state)},
        audit_older_than=None if audit_older_than is None else timedelta(days=audit_older_than),
    )
    audit = f", {removed.audit} entries of the audit log" if audit_older_than is not None else ""
    note(
        f"{len(removed.jobs)} jobs{audit} and {removed.recordings} recorded walks are removed, and"
        " free space is given back"
    )


def _database(db: str | None) -> str:
    """That of the option or the environment; NotFound for an SQLite file that is not there."""
    from gaitswarm.jobs.open import database_to_read
    from gaitswarm.settings import read_settings

    return database_to_read(read_settings(db=db or None))
