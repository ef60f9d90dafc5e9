"""`gaitswarm export`: every evaluation of a job as a table in a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Server

if TYPE_CHECKING:
    from gaitswarm.tables import TableFormat


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
    from gaitswarm.cli.atomic_file import replacing
    from gaitswarm.cli.output import note
    from gaitswarm.jobs.open import open_jobs

    file_format = _format(output)
    with open_jobs(server, db) as jobs:
        job = jobs.job(job_id)
        with replacing(output, "output") as file:
            for part in jobs.export(job_id, file_format):
                file.write(part)
    note(f"{job.evaluations} evaluations written to {output}")


def _format(path: Path) -> TableFormat:
    """As the file's suffix says. Raises InvalidRequest for another."""
    from gaitswarm.services.optimizer.errors import InvalidRequest

    match path.suffix:
        case ".csv":
            return "csv"
        case ".parquet":
            return "parquet"
        case _:
            raise InvalidRequest(f"{path} must end in .csv or .parquet", field="output")
