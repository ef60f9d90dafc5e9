"""`gaitswarm audit`: who did what to which job, when."""

from __future__ import annotations

from typing import Annotated

import typer

from gaitswarm.cli.inputs.job_ids import completed
from gaitswarm.cli.inputs.options import Db, Json


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(audit)


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
