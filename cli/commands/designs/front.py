"""`gaitswarm front`: what designs of a job trade."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.cli.tables.front import Placed
    from gaitswarm.jobs.port import Jobs


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
    published: Annotated[
        bool,
        typer.Option(help="Let the published designs of the controller walk, too, to place them."),
    ] = False,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Show the Pareto front of a job's designs, from what is stored: no walk is run.

    Its knees, the best design in each objective, the best under A, B and C and under the job's own
    preference, and the hypervolume.
    """
    from gaitswarm.cli.atomic_file import replacing
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.cli.tables.front import front_csv, marked_table, placed_lines, summary
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.services.optimizer.errors import InvalidRequest

    if output is not None and output.suffix != ".csv":
        raise InvalidRequest(f"{output} must end in .csv", field="output")
    if published and as_json:
        raise InvalidRequest("is for the table, not for --json", field="published")
    with open_jobs(server, db) as jobs:
        view = jobs.front(job_id, most=most)
        placed = _published(jobs, job_id) if published else {}
    if output is not None:
        with replacing(output, "output") as file:
            file.write(front_csv(view))
        note(f"{len(view.designs)} designs written to {output}")
    if as_json:
        print_json(view)
        return
    console = stdout_console()
    console.print(marked_table(view))
    for line in (*summary(view), *placed_lines(placed)):
        console.print(line, markup=False)


def _published(jobs: Jobs, job_id: str) -> dict[str, Placed]:
    """Where the published designs lie; raises InvalidRequest where they cannot be compared."""
    from gaitswarm.cli.comparison import published_walk
    from gaitswarm.cli.tables.front import placed
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
    from gaitswarm.sim.controllers import CONTROLLERS

    spec, view = jobs.job(job_id).spec, jobs.front(job_id, most=10_000)
    if not isinstance(spec, JobSpec) or spec.worlds is not None:
        raise InvalidRequest(
            "the job judges in worlds, in which no published design has walked", field="published"
        )
    names = CONTROLLERS[spec.controller].published
    return {name: placed(published_walk(spec, name), view) for name in names}
