"""`gaitswarm db`, `token` and `audit`: administration of an installation."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gaitswarm.cli.inputs.options import Db, Json, completed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaitswarm.services.optimizer.access import Token, Tokens

Force = Annotated[bool, typer.Option("--force", help="Replace what is there.")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help="Upgrade, check, back up, restore and prune the database.")
    for command in (upgrade, check, backup, restore, prune):
        group.command()(command)
    app.add_typer(group, name="db")
    group = typer.Typer(help="Make, list and revoke tokens, by which a server knows who asks.")
    group.command()(create)
    group.command("list")(list_)
    group.command()(revoke)
    app.add_typer(group, name="token")
    app.command()(audit)


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


Name = Annotated[str, typer.Argument(metavar="NAME", help="Of the token: whose jobs its jobs are.")]


def create(
    name: Name,
    scope: Annotated[
        Literal["read", "submit", "admin"],
        typer.Option(
            help="read: look at everything; submit: also submit jobs and command these; admin:"
            " command all jobs."
        ),
    ] = "submit",
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Make a token. Its secret is printed once, and stored nowhere."""
    from gaitswarm.cli.output import note, print_text
    from gaitswarm.services.optimizer.access import Scope

    with _tokens(db) as tokens:
        token, secret = tokens.create(name, Scope(scope))
    if as_json:
        _print_json({**_document(token), "secret": secret})
        return
    note(f"token {name!r} of scope {scope}; its secret is shown only now:")
    print_text(secret)


def list_(db: Db = None, as_json: Json = False) -> None:
    """List all tokens, the oldest first."""
    from gaitswarm.cli.output import note, print_text

    with _tokens(db, made=False) as tokens:
        found = tokens.all()
    if as_json:
        _print_json([_document(token) for token in found])
        return
    if not found:
        note("there are no tokens; `gaitswarm token create NAME` makes one")
    for token in found:
        state = "valid" if token.revoked_at is None else f"revoked {token.revoked_at:%Y-%m-%d}"
        made = f"{token.created_at:%Y-%m-%d}"
        print_text(f"{token.name:24} {token.scope:7} made {made}  {state}")


def revoke(name: Name, db: Db = None, as_json: Json = False) -> None:
    """Let a token allow nothing any more; servers know within five seconds."""
    from gaitswarm.cli.output import note

    with _tokens(db, made=False) as tokens:
        token = tokens.revoke(name)
    if as_json:
        _print_json(_document(token))
    else:
        note(f"token {name!r} is revoked")


@contextmanager
def _tokens(db: str | None, *, made: bool = True) -> Iterator[Tokens]:
    """Of the database that the option or the environment names.

    made: whether it is made if it is not there; else that is an error.
    """
    from contextlib import closing

    from gaitswarm.jobs.open import database_to_read, database_to_write
    from gaitswarm.services.runtime import open_store
    from gaitswarm.settings import read_settings

    find = database_to_write if made else database_to_read
    with closing(open_store(find(read_settings(db=db or None)))) as store:
        yield store.tokens


def _document(token: Token) -> dict[str, Any]:
    return {
        "name": token.name,
        "scope": str(token.scope),
        "created_at": token.created_at.isoformat(),
        "revoked_at": None if token.revoked_at is None else token.revoked_at.isoformat(),
    }


def _print_json(document: Any) -> None:
    import json

    from gaitswarm.cli.output import print_text

    print_text(json.dumps(document, indent=2))


def audit(
    job: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            callback=completed,
            help="Only changes of this job; in full, if it is deleted.",
        ),
    ] = None,
    limit: Annotated[int, typer.Option(min=1, max=10_000, help="Most changes to show.")] = 50,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Show who submitted, commanded and deleted jobs and made tokens, the newest first.

    It reads the database; /v1/audit of a server tells the same to administrators.
    """
    from contextlib import closing

    from gaitswarm.cli.output import note, print_json_list, print_text
    from gaitswarm.jobs.open import database_to_write
    from gaitswarm.services.runtime import open_store
    from gaitswarm.settings import read_settings
    from gaitswarm.views.operations import AuditEntryView

    settings = read_settings(db=db or None)
    with closing(open_store(database_to_write(settings))) as store:
        entries = store.audit(job_id=job, limit=limit).items
    if as_json:
        print_json_list(map(AuditEntryView.from_entry, entries))
        return
    if not entries:
        note("nothing is known of it" if job else "nothing was done yet")
    for entry in entries:
        details = ", ".join(f"{name}={value}" for name, value in entry.details.items())
        print_text(
            f"{entry.at:%Y-%m-%d %H:%M:%S}  {entry.actor:16} {entry.action:14}"
            f" {entry.job_id or '-':12}  {details}".rstrip()
        )
