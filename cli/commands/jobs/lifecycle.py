"""Commands about jobs: submit, list, status, watch, and those that change one."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, TypeVar

import typer

from gaitswarm.cli.inputs.job_ids import completed
from gaitswarm.cli.inputs.options import (
    AcceptChanges,
    Db,
    JobId,
    Json,
    Notify,
    Priority,
    Server,
    SpecOptions,
    with_groups,
)

S = TypeVar("S", bound=StrEnum)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(submit)
    app.command("list")(list_jobs)
    app.command()(status)
    app.command()(watch)
    app.command()(pause)
    app.command()(resume)
    app.command()(extend)
    app.command()(prioritize)
    app.command()(cancel)


@with_groups
def submit(
    options: SpecOptions,
    idempotency_key: Annotated[
        str | None, typer.Option(help="The same key and spec again make no second job.")
    ] = None,
    priority: Priority = 0,
    notify: Notify = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Queue a job for a running server; see `optimize` to run one here and now."""
    from gaitswarm.cli.inputs.spec_file import build_spec
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    asked = build_spec(options)
    with open_jobs(server, db, create=True) as jobs:
        job = jobs.submit(
            asked, idempotency_key=idempotency_key, priority=priority, notify_url=notify
        )
        if as_json:
            print_json(job)
            return
        stdout_console().print(job.id, markup=False)
        note(f"{job.state}; follow it: gaitswarm watch {job.id}{jobs.place}")


def list_jobs(
    state: Annotated[
        str | None,
        typer.Option(
            help="Only jobs in this state: queued, running, pausing, paused, cancelled, failed or"
            " succeeded."
        ),
    ] = None,
    forks_of: Annotated[
        str | None,
        typer.Option(
            metavar="ID", callback=completed, help="Only jobs that were forked from this one."
        ),
    ] = None,
    search: Annotated[
        str,
        typer.Option(metavar="TEXT", help="Only jobs whose name, id, note or tags contain this."),
    ] = "",
    robot: Annotated[
        str | None, typer.Option(metavar="NAME", help="Only jobs of this robot, or of `own` ones.")
    ] = None,
    controller: Annotated[
        str | None, typer.Option(metavar="NAME", help="Only jobs that tune this controller.")
    ] = None,
    preference: Annotated[
        str | None, typer.Option(metavar="NAME", help="Only jobs of this preference, or of `own`.")
    ] = None,
    tag: Annotated[str | None, typer.Option(help="Only jobs that have this tag.")] = None,
    archived: Annotated[
        bool | None,
        typer.Option(
            "--archived/--not-archived",
            help="Only jobs that are archived, or are not, which is the default.",
        ),
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Jobs that are archived as well as those that are not.")
    ] = False,
    order: Annotated[
        str,
        typer.Option(
            help="created (newest first), fitness (best first), gain (greatest first), name,"
            " state, iterations, evaluations, priority, rate (most first) or time_left."
        ),
    ] = "created",
    reverse: Annotated[bool, typer.Option("--reverse", help="The other way round.")] = False,
    limit: Annotated[int, typer.Option(min=1, help="Most jobs to list.")] = 50,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """List jobs, newest first unless another order is chosen."""
    from gaitswarm.cli.output import note, print_json_list, stdout_console
    from gaitswarm.cli.tables.views import jobs_table
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
    from gaitswarm.services.optimizer.jobs.labels import JobFilter

    if everything and archived is not None:
        raise InvalidRequest("leaves out none; choose one of both", field="all")
    in_state = None if state is None else _one_of(JobState, state, "state")
    sorted_by = _one_of(JobOrder, order, "order")
    with open_jobs(server, db) as jobs:
        found = jobs.jobs(
            state=in_state,
            parent=forks_of,
            search=search,
            where=JobFilter(
                None if everything else bool(archived), robot, controller, preference, tag
            ),
            order=sorted_by,
            reverse=reverse,
            limit=limit if as_json else limit + 1,
        )
        if as_json:
            print_json_list(found)
            return
        rows = list(found)
    if rows:
        stdout_console().print(jobs_table(rows[:limit]))
    else:
        note("no job fits" if everything else "no job fits; --all lists archived ones, too")
    if len(rows) > limit:
        note(f"there are more than {limit}: see them by --limit, or fewer by --search or --tag")


def status(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show a job: state, progress, best design, and why it failed if it did."""
    from gaitswarm.cli.output import print_json
    from gaitswarm.cli.tables.views import print_job
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        job = jobs.job(job_id)
        if as_json:
            print_json(job)
        else:
            print_job(job)


def watch(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Follow a job until it ends; the exit code tells whether it succeeded.

    With --json every committed iteration is one line, as is every change of the job's state.
    """
    from gaitswarm.cli.progress import watch_as_json, watch_with_progress
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        follow = watch_as_json if as_json else watch_with_progress
        follow(jobs, job_id)


def pause(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Pause a job when its present iteration is committed."""
    _command("pause", job_id, server, db, as_json=as_json)


def resume(
    job_id: JobId,
    accept_changes: AcceptChanges = False,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Queue a paused or failed job again; a running server goes on with it."""
    _command("resume", job_id, server, db, as_json=as_json, accept_changes=accept_changes)


def extend(
    job_id: JobId,
    iterations: Annotated[
        int,
        typer.Option(help="Budget in all, not further iterations."),
    ],
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Give a job another budget; one that has succeeded is queued and goes on from its end."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        job = jobs.extend(job_id, iterations)
    if as_json:
        print_json(job)
    else:
        stdout_console().print(
            f"job {job.id} is {job.state}, with {job.spent}",
            markup=False,
        )


def prioritize(
    job_id: JobId,
    priority: Priority,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Give a job that waits or runs another priority."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        job = jobs.prioritize(job_id, priority)
    if as_json:
        print_json(job)
    else:
        stdout_console().print(
            f"job {job.id} is {job.state}, with priority {job.priority}", markup=False
        )


def cancel(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """End a job for good; what it has committed stays."""
    _command("cancel", job_id, server, db, as_json=as_json)


def _one_of(kind: type[S], text: str, option: str) -> S:
    """Raises InvalidRequest that says which there are."""
    from gaitswarm.services.optimizer.errors import InvalidRequest

    try:
        return kind(text)
    except ValueError:
        known = ", ".join(kind)
        raise InvalidRequest(f"{text!r} is none of {known}", field=option) from None


def _command(
    command: str,
    job_id: str,
    server: str | None,
    db: str | None,
    *,
    as_json: bool,
    accept_changes: bool = False,
) -> None:
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.services.optimizer.jobs.job import Command

    with open_jobs(server, db) as jobs:
        job = jobs.command(job_id, Command(command), accept_changes=accept_changes)
    if as_json:
        print_json(job)
    else:
        stdout_console().print(f"job {job.id} is {job.state}", markup=False)
