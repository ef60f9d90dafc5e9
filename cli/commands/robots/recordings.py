"""`gaitswarm recordings`: which measured walks are kept."""

from __future__ import annotations

from typing import Annotated

import typer

from gaitswarm.cli.inputs.options import Db, Json, Server


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(recordings)


def recordings(
    search: Annotated[
        str,
        typer.Option(
            metavar="TEXT",
            help="Only those whose id, scenario or controller contain this, whatever its case.",
        ),
    ] = "",
    limit: Annotated[int, typer.Option(min=1, help="Most recordings to list.")] = 50,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """List recorded walks, newest first: their ids are what `identify` takes."""
    from gaitswarm.cli.output import note, print_json_list, stdout_console
    from gaitswarm.cli.tables.recordings import recordings_table
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        found = jobs.recordings(search=search, limit=limit)
        if as_json:
            print_json_list(found)
            return
        rows = list(found)
    if not rows:
        note("no recording fits" if search else "nothing is recorded yet; see `gaitswarm record`")
        return
    stdout_console().print(recordings_table(rows))
