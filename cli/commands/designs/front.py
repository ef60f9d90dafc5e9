"""`gaitswarm front`: what designs of a job trade."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.options import Db, JobId, Json, Server


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(front)


def front(
    job_id: JobId,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.csv", help="Write the front's designs, too."),
    ] = None,
    most: Annotated[
        int, typer.Option(help="Designs to list, with --json and --output; of more, some.")
    ] = 1000,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Show the Pareto front of a job's designs, from what is stored: no walk is run.

    Its knees, the best design in each objective, the best under A, B and C and under the job's own
    preference, and the hypervolume.
    """
    from cli.atomic_file import replacing
    from cli.front_tables import front_csv, marked_table, summary
    from cli.output import note, print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs
    from services.optimizer.errors import InvalidRequest

    if output is not None and output.suffix != ".csv":
        raise InvalidRequest(f"{output} must end in .csv", field="output")
    with open_jobs(server, db) as jobs:
        view = jobs.front(job_id, most=most)
    if output is not None:
        with replacing(output, "output") as file:
            file.write(front_csv(view))
        note(f"{len(view.designs)} designs written to {output}")
    if as_json:
        print_json(view)
        return
    console = stdout_console()
    console.print(marked_table(view))
    for line in summary(view):
        console.print(line, markup=False)
