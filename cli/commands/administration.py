"""Administration of an installation: databases, tokens, audit log, plug-ins."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gaitswarm.cli.exit_codes import CheckFailed
from gaitswarm.cli.options import Db, Json, completed
from gaitswarm.cli.output import Parts, Printed, note, show
from gaitswarm.cli.tables import table
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store
    from gaitswarm.views.catalogue import CaseView, OptimizerView

Force = Annotated[bool, typer.Option("--force", help="Overwrite existing data.")]


def upgrade(db: Db = None) -> None:
    """Upgrade the database to this version's schema.

    No other command does. The database must not be in use; back it up first.
    """
    from gaitswarm.services.optimizer.store import schema

    before = schema.upgrade(_database(db))
    if before == schema.head():
        note(f"the schema is up to date, revision {before}")
    else:
        note(f"schema upgraded to revision {schema.head()} from {before or 'none'}")


def check(
    skip_histories: Annotated[
        bool,
        typer.Option("--skip-histories", help="Do not recompute the digests of histories."),
    ] = False,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Check the database for inconsistencies; jobs may run meanwhile.

    The history of every job is compared with its digests. The exit code is 1 if there are findings.
    """
    from gaitswarm.services.optimizer.analysis.verification import check_histories
    from gaitswarm.services.optimizer.store import maintenance

    findings = maintenance.check(_database(db))
    if not skip_histories:
        with _store(db) as store:
            findings += check_histories(store)
    show(findings, findings, as_json=as_json)
    if findings:
        raise CheckFailed(f"the database is inconsistent: {len(findings)} findings")
    note("the database is consistent")


def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write.")],
    force: Force = False,
    db: Db = None,
) -> None:
    """Write a consistent copy of an SQLite database to a file; jobs may run meanwhile."""
    from gaitswarm.services.optimizer.store import maintenance

    maintenance.backup(_database(db), file, overwrite=force)
    note(f"database written to {file}")


def restore(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File of `backup`.")],
    force: Force = False,
    db: Db = None,
) -> None:
    """Restore a backup to an empty database that is not in use.

    Backups of older versions are upgraded, and can be restored to PostgreSQL.
    """
    from gaitswarm.services.optimizer.store import maintenance

    maintenance.restore(_database(db, create=True), file, overwrite=force)
    note(f"database restored from {file}")


def prune(
    older_than: Annotated[float | None, typer.Option(min=0.0, metavar="DAYS")] = None,
    state: Literal["succeeded", "failed", "cancelled"] | None = None,
    audit_older_than: Annotated[float | None, typer.Option(min=0.0, metavar="DAYS")] = None,
    trust_clock: Annotated[bool, typer.Option("--trust-clock")] = False,
    db: Db = None,
) -> None:
    """Remove recordings older than a day that no job uses, and free their space.

    With --older-than, also jobs, except those that are kept or have active forks.

    Args:
        older_than: Also delete jobs that ended earlier.
        state: With --older-than: only jobs in this state [default: all].
        audit_older_than: Also remove older audit entries.
        trust_clock: Also after a jump of the clock.
    """
    from gaitswarm.services.optimizer.jobs.job import ENDED, JobState
    from gaitswarm.services.optimizer.store import maintenance

    if state is not None and older_than is None:
        raise InvalidRequest("requires --older-than", field="state")
    removed = maintenance.prune(
        _database(db),
        older_than=None if older_than is None else timedelta(days=older_than),
        states=ENDED if state is None else {JobState(state)},
        audit_older_than=None if audit_older_than is None else timedelta(days=audit_older_than),
        trusts_clock=trust_clock,
    )
    audit = f", {removed.audit} audit entries" if audit_older_than is not None else ""
    note(
        f"removed {len(removed.jobs)} jobs{audit} and {removed.recordings} recordings, and freed"
        " their space"
    )


def _database(db: str | None, *, create: bool = False) -> str:
    """Return the URL of the option or environment; a missing SQLite file may be an error."""
    from gaitswarm.jobs.open import database_to_read, database_to_write
    from gaitswarm.settings import read_settings

    return (database_to_write if create else database_to_read)(read_settings(db=db or None))


@contextmanager
def _store(db: str | None, *, create: bool = False) -> Iterator[Store]:
    from gaitswarm.services.optimizer.store import open_store

    with closing(open_store(_database(db, create=create))) as store:
        yield store


Name = Annotated[str, typer.Argument(metavar="NAME", help="Name of the token, owner of its jobs.")]


def create(
    name: Name,
    scope: Literal["read", "submit", "admin"] = "submit",
    db: Db = None,
) -> Printed:
    """Create a token; its secret is printed once and never stored.

    Args:
        scope: read: read everything; submit: also submit jobs and control them; admin: control all
            jobs.
    """
    from gaitswarm.services.optimizer.access import Scope

    with _store(db, create=True) as store:
        token, secret = store.tokens.create(name, Scope(scope))

    def parts() -> Parts:
        note(f"token {name!r} of scope {scope}; the secret is shown only once:")
        yield secret

    return {**asdict(token), "secret": secret}, parts()


def list_tokens(db: Db = None) -> Printed:
    """List tokens, oldest first."""
    with _store(db) as store:
        listed = store.tokens.all()

    def parts() -> Parts:
        if not listed:
            note("there are no tokens; create one by `gaitswarm token create NAME`")
        for token in listed:
            state = "valid" if token.revoked_at is None else f"revoked {token.revoked_at:%Y-%m-%d}"
            created = f"{token.created_at:%Y-%m-%d}"
            yield f"{token.name:24} {token.scope:7} created {created}  {state}"

    return listed, parts()


def revoke(name: Name, db: Db = None) -> Printed:
    """Revoke a token; servers refuse it within five seconds."""
    with _store(db) as store:
        token = store.tokens.revoke(name)

    def parts() -> Parts:
        note(f"token {name!r} is revoked")
        yield from ()

    return token, parts()


def audit(
    job: Annotated[str | None, typer.Option(metavar="ID", callback=completed)] = None,
    limit: Annotated[int, typer.Option(min=1, max=10_000)] = 50,
    db: Db = None,
) -> Printed:
    """Show who submitted, controlled and deleted jobs and created tokens, newest first.

    Reads the database; administrators of a server can also read /v1/audit.

    Args:
        job: Only entries of this job; give the full id of a deleted one.
        limit: Maximum number of entries.
    """
    with _store(db, create=True) as store:
        entries = store.audit(job_id=job, limit=limit).items

    def parts() -> Parts:
        if not entries:
            note("no entries of this job" if job else "no entries yet")
        for entry in entries:
            details = ", ".join(f"{name}={value}" for name, value in entry.details.items())
            yield (
                f"{entry.at:%Y-%m-%d %H:%M:%S}  {entry.actor:16} {entry.action:14}"
                f" {entry.job_id or '-':12}  {details}".rstrip()
            )

    return iter(entries), parts()


def optimizers() -> Printed:
    """List search methods and their settings."""
    from gaitswarm.views.catalogue import optimizers

    views = optimizers()
    rows = (
        (view.name, _described(view), _settings(view.settings.model_dump(exclude={"name"})))
        for view in views
    )
    return iter(views), _listed(("name", "<description", "<settings"), rows)


def plugins() -> Printed:
    """List installed plug-ins: controllers, cases and search methods of other packages."""
    from gaitswarm.views.catalogue import plugin_views

    views = plugin_views()
    rows = (
        (
            *(view.kind, view.name, view.distribution, view.version),
            view.state if view.reason is None else f"{view.state}: {view.reason}",
        )
        for view in views
    )
    return iter(views), _listed(("kind", "<name", "<distribution", "<version", "<state"), rows)


def cases() -> Printed:
    """List cases: plug-ins that evaluate designs instead of the simulator, and their settings."""
    from gaitswarm.views.catalogue import case_views

    views = case_views()
    rows = []
    for view in views:
        fields = view.settings_schema.get("properties", {}).items()
        lines = (f"{name} {f.get('default', '')}" for name, f in fields if name != "name")
        rows.append((view.name, _described(view), "\n".join(lines)))
    return iter(views), _listed(("name", "<description", "<settings"), rows)


def _listed(headings: Sequence[str], rows: Iterable[Sequence[Any]]) -> Parts:
    yield table(headings, rows)


def _described(view: OptimizerView | CaseView) -> str:
    return f"{view.description}{'' if view.needs is None else f'; needs {view.needs}'}"


def _settings(settings: dict[str, Any]) -> str:
    return "\n".join(f"{name} {json.dumps(value)}" for name, value in settings.items())
