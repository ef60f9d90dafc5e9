"""`gaitswarm delete` and `gaitswarm keep`: jobs that nobody needs any more, and those that stay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs
    from gaitswarm.views import JobView


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(delete)
    app.command()(keep)


def delete(
    job_id: JobId,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    server: Server = None,
    db: Db = None,
) -> None:
    """Delete a job that has ended or is paused, with all that it has found."""
    import sys

    from gaitswarm.cli.output import note, stdout_console
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.services.optimizer.errors import InvalidRequest

    with open_jobs(server, db) as jobs:
        if not yes:
            note(_loss(jobs, jobs.job(job_id)))
            if not sys.stdin.isatty():
                raise InvalidRequest("nobody can be asked here; --yes deletes the job", field="yes")
            if not typer.confirm("Delete it?", err=True):
                note("nothing was deleted")
                return
        jobs.delete(job_id)
    stdout_console().print(f"job {job_id} is deleted", markup=False)


def keep(
    job_id: JobId,
    release: Annotated[bool, typer.Option("--release", help="Let it be deleted again.")] = False,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Protect a job from deletion, however long ago it ended."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        job = jobs.keep(job_id, kept=not release)
    if as_json:
        print_json(job)
    else:
        how = "is kept" if job.kept else "is not kept any more"
        stdout_console().print(f"job {job.id} {how}", markup=False)


def _loss(jobs: Jobs, job: JobView) -> str:
    """What goes with a job, and what stays."""
    forks = sum(1 for _ in jobs.jobs(parent=job.id))
    name = f" ({job.name})" if job.name else ""
    loss = (
        f"job {job.id}{name} is {job.state}; deleting it loses {job.iterations} iterations with"
        f" {job.evaluations} evaluated designs for good"
    )
    if forks:
        loss += f"\nforks of it, {forks}, keep their copies, but their parent is gone"
    return f"{loss}\ncertificates of its designs stay as jobs of their own"
