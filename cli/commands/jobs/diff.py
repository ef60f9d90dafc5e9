"""`gaitswarm diff`: jobs beside each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from gaitswarm.cli.inputs.options import Db, JobIds, Json, Server

if TYPE_CHECKING:
    from gaitswarm.views.comparison import JobComparisonView


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(diff)


def diff(
    job_ids: JobIds,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Set up to 12 jobs beside each other: what they came to, and how their specs differ.

    With --json how they converged and how the fitness of their designs is distributed, too.
    """
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        view = jobs.comparison(job_ids)
    if as_json:
        print_json(view)
    else:
        _print(view)


def _print(view: JobComparisonView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import MISSING, number

    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("", no_wrap=True)
    for job in view.jobs:
        table.add_column(job.id)
    table.add_row("name", *(job.name or MISSING for job in view.jobs))
    table.add_row("state", *(job.state for job in view.jobs))
    table.add_row("best fitness", *(number(job.best_fitness, 5) for job in view.jobs))
    table.add_row("evaluations", *(str(job.evaluations) for job in view.jobs))
    for difference in view.differences:
        values = (MISSING if value is None else value for value in difference.values)
        table.add_row(difference.field, *values)
    console = stdout_console()
    console.print(table, markup=False)
    if not view.comparable:
        console.print(
            "they judge by different measures, so their fitness cannot be compared", markup=False
        )
