"""`gaitswarm label`: what people write on a job."""

from __future__ import annotations

from typing import Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(label)


def label(
    job_id: JobId,
    name: Annotated[
        str | None, typer.Option(help="Show this in place of the spec's name; empty to end that.")
    ] = None,
    note: Annotated[str | None, typer.Option(help="Write this note.")] = None,
    tag: Annotated[
        list[str] | None, typer.Option(help="Tag it, in place of its tags; may be repeated.")
    ] = None,
    no_tags: Annotated[bool, typer.Option("--no-tags", help="Remove its tags.")] = False,
    archive: Annotated[
        bool | None,
        typer.Option("--archive/--unarchive", help="Put it out of the way in lists, or back."),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Name, note, tag or archive a job; its spec and its results stay as they are."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    tags = [] if no_tags else tag or None
    with open_jobs(server, db) as jobs:
        job = jobs.label(job_id, name=name, note=note, tags=tags, archived=archive)
    if as_json:
        print_json(job)
        return
    written = [f"name {job.name!r}", *(f"tag {word}" for word in job.tags)]
    if job.note:
        written.append("a note")
    if job.archived:
        written.append("archived")
    stdout_console().print(f"job {job.id}: {', '.join(written)}", markup=False)
