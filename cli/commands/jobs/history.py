"""What a job has found: history and best."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.views import HistoryIterationView, JobView


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(history)
    app.command()(best)


def history(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show every committed iteration.

    With --json also every design: its values, fitness, statuses and raw objectives.
    """
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables.views import iterations_table
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        if as_json:
            _print_history(jobs.job(job_id), jobs.history(job_id))
        else:
            jobs.job(job_id)
            stdout_console().print(iterations_table(jobs.iterations(job_id)))


def best(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show the best design that a job has found so far, scenario by scenario."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.cli.tables.views import print_best, worth
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.settings import place_of

    with open_jobs(server, db) as jobs:
        found = jobs.best(job_id)
        if as_json:
            print_json(found)
            return
        job = jobs.job(job_id)
        stdout_console().print(
            f"job {job_id}: fitness {worth(found, digits=6)}, design"
            f" {place_of(found.iteration, found.particle)}",
            markup=False,
        )
        print_best(found, job)


def _print_history(job: JobView, iterations: Iterator[HistoryIterationView]) -> None:
    """One JSON document, written as it is read: a history may be larger than memory."""
    import json
    import sys

    from gaitswarm.cli.output import write_json_items

    head = {
        "id": job.id,
        "state": job.state.value,
        "variables": job.spec.design_space().names,
        "provenance": [record.model_dump(mode="json") for record in job.provenance],
    }
    opening = json.dumps(head, indent=2).removesuffix("\n}")
    sys.stdout.write(f'{opening},\n  "iterations": ')
    write_json_items(sys.stdout, iterations, indent=2)
    sys.stdout.write("\n}\n")
