"""`gaitswarm export`: every evaluation of a job as a table in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.options import Db, JobId, Server


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(export)


def export(
    job_id: JobId,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="FILE.csv or FILE.parquet.")
    ],
    server: Server = None,
    db: Db = None,
) -> None:
    """Write one row per evaluated design: fitness, variables, and results by scenario."""
    from cli.evaluation_table import write_evaluations
    from cli.jobs.open import open_jobs
    from cli.output import note

    with open_jobs(server, db) as jobs:
        rows = write_evaluations(output, jobs.job(job_id).spec, jobs.history(job_id))
    note(f"{rows} evaluations written to {output}")
