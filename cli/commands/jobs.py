"""Commands about jobs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import (
    AcceptChanges,
    Db,
    JobId,
    JobIds,
    JobName,
    Json,
    Notify,
    Priority,
    RobotOption,
    Server,
    SpecOptions,
    completed,
    one_of,
    with_groups,
)

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.specs import ForkOptions
    from gaitswarm.views import HistoryIterationView, JobView
    from gaitswarm.views.comparison import JobComparisonView


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
    app.command()(history)
    app.command()(best)
    app.command()(diff)
    app.command()(fork)
    app.command()(label)
    app.command()(delete)
    app.command()(keep)


@with_groups
def submit(
    options: SpecOptions,
    idempotency_key: Annotated[
        str | None, typer.Option(help="Repeating a key with the same spec creates no second job.")
    ] = None,
    priority: Priority = 0,
    notify: Notify = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Queue a job for a running server; `optimize` runs one in this process."""
    from gaitswarm.cli.inputs.spec_file import build_spec
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    spec = build_spec(options)
    with open_jobs(server, db, create=True) as jobs:
        job = jobs.submit(
            spec, idempotency_key=idempotency_key, priority=priority, notify_url=notify
        )
        if as_json:
            print_json(job)
            return
        stdout_console().print(job.id, markup=False)
        note(f"{job.state}; to follow it, run: gaitswarm watch {job.id}{jobs.place}")


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
        typer.Option(metavar="ID", callback=completed, help="Only forks of this job."),
    ] = None,
    search: Annotated[
        str,
        typer.Option(metavar="TEXT", help="Only jobs whose name, id, note or tags contain this."),
    ] = "",
    robot: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Only jobs of this robot; `own`: custom robots."),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(metavar="NAME", help="Only jobs that tune this controller.")
    ] = None,
    preference: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Only jobs of this preference; `own`: custom ones."),
    ] = None,
    tag: Annotated[str | None, typer.Option(help="Only jobs with this tag.")] = None,
    archived: Annotated[
        bool | None,
        typer.Option(
            "--archived/--not-archived",
            help="Only archived jobs, or only others (the default).",
        ),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="Include archived jobs.")] = False,
    order: Annotated[
        str,
        typer.Option(
            help="created (newest first), fitness (best first), gain (greatest first), name,"
            " state, iterations, evaluations, priority, rate (most first) or time_left."
        ),
    ] = "created",
    reverse: Annotated[bool, typer.Option("--reverse", help="Reverse the order.")] = False,
    limit: Annotated[int, typer.Option(min=1, help="Maximum number of jobs.")] = 50,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """List jobs, newest first by default."""
    from gaitswarm.cli.output import note, print_json_list, stdout_console
    from gaitswarm.cli.tables import jobs_table
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
    from gaitswarm.services.optimizer.jobs.labels import JobFilter

    if everything and archived is not None:
        raise InvalidRequest("--all and --archived are mutually exclusive", field="all")
    job_state = None if state is None else one_of(JobState, state, "state")
    job_order = one_of(JobOrder, order, "order")
    with open_jobs(server, db) as jobs:
        matches = jobs.jobs(
            state=job_state,
            parent=forks_of,
            search=search,
            where=JobFilter(
                None if everything else bool(archived), robot, controller, preference, tag
            ),
            order=job_order,
            reverse=reverse,
            limit=limit if as_json else limit + 1,
        )
        if as_json:
            print_json_list(matches)
            return
        rows = list(matches)
    if rows:
        stdout_console().print(jobs_table(rows[:limit]))
    else:
        note("no job matches" if everything else "no job matches; --all includes archived jobs")
    if len(rows) > limit:
        note(f"more than {limit} jobs match: raise --limit, or narrow by --search or --tag")


def status(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show a job's state, progress and best design, and the reason if it failed."""
    from gaitswarm.cli.output import print_json
    from gaitswarm.cli.tables import print_job
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        job = jobs.job(job_id)
        if as_json:
            print_json(job)
        else:
            print_job(job)


def watch(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Follow a job until it ends; the exit code is 0 if it succeeded.

    With --json, every committed iteration and every change of state is one line.
    """
    from gaitswarm.cli.progress import watch_as_json, watch_with_progress
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        follow = watch_as_json if as_json else watch_with_progress
        follow(jobs, job_id)


def pause(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Pause a job after its current iteration."""
    _command("pause", job_id, server, db, as_json=as_json)


def resume(
    job_id: JobId,
    accept_changes: AcceptChanges = False,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Resume a paused or failed job."""
    _command("resume", job_id, server, db, as_json=as_json, accept_changes=accept_changes)


def extend(
    job_id: JobId,
    iterations: Annotated[
        int,
        typer.Option(help="Total budget, including iterations done."),
    ],
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Extend a job's budget; a job that has succeeded continues."""
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
    """Change the priority of a queued or running job."""
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
    """Cancel a job for good; committed iterations remain."""
    _command("cancel", job_id, server, db, as_json=as_json)


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


def history(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show every committed iteration.

    With --json, also every design: values, fitness, statuses and raw objectives.
    """
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import iterations_table
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        if as_json:
            _print_history(jobs.job(job_id), jobs.history(job_id))
        else:
            jobs.job(job_id)
            stdout_console().print(iterations_table(jobs.iterations(job_id)))


def best(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show a job's best design so far, by scenario."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.cli.tables import print_best, worth
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.settings import place_of

    with open_jobs(server, db) as jobs:
        view = jobs.best(job_id)
        if as_json:
            print_json(view)
            return
        job = jobs.job(job_id)
        stdout_console().print(
            f"job {job_id}: fitness {worth(view, digits=6)}, design"
            f" {place_of(view.iteration, view.particle)}",
            markup=False,
        )
        print_best(view, job)


def _print_history(job: JobView, iterations: Iterator[HistoryIterationView]) -> None:
    """Stream one JSON document: a history may be larger than memory."""
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


def diff(
    job_ids: JobIds,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Compare up to 12 jobs: results, and differences of their specs.

    With --json, also convergence and the distribution of fitness.
    """
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        view = jobs.comparison(job_ids)
    if as_json:
        print_json(view)
    else:
        _print_comparison(view)


def _print_comparison(view: JobComparisonView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import MISSING, Table, number

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
            "the jobs use different measures, so their fitness is not comparable", markup=False
        )


def fork(
    job_id: JobId,
    from_iteration: Annotated[
        int,
        typer.Option(
            "--from",
            metavar="K",
            help="First iteration of the fork itself, counted from 0 as in `history`; iterations 0"
            " to K-1 are copied.",
        ),
    ],
    preference: Annotated[
        str | None, typer.Option(help="Weighting of objectives: A, B, C, chapter-3, or JSON.")
    ] = None,
    optimizer: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Search method; `gaitswarm optimizers` lists all."),
    ] = None,
    optimizer_settings: Annotated[
        str | None,
        typer.Option(metavar="JSON|FILE", help="Settings of the method."),
    ] = None,
    particles: Annotated[
        int | None, typer.Option(help="Maximum number of designs per iteration.")
    ] = None,
    scenarios: Annotated[
        str | None, typer.Option(help="Names, numbers or FILE.json, separated by commas.")
    ] = None,
    robot: RobotOption = None,
    iterations: Annotated[
        int | None,
        typer.Option(help="Total budget, including copied iterations."),
    ] = None,
    start_count: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Start designs if the search cannot be continued. [default: 5]",
        ),
    ] = None,
    name: JobName = None,
    accept_changes: AcceptChanges = False,
    idempotency_key: Annotated[
        str | None, typer.Option(help="Repeating a key with the same fork creates no second job.")
    ] = None,
    priority: Priority = 0,
    notify: Notify = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Queue a job that starts with iterations of another; omitted options keep its values."""
    from gaitswarm.cli.inputs.robots import chosen_robot, scenario_data
    from gaitswarm.cli.inputs.spec_file import optimizer_choice, preference_choice
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.cli.tables import lineage_line
    from gaitswarm.jobs.open import open_jobs

    values = {
        "preference": None if preference is None else preference_choice(preference),
        "optimizer": optimizer_choice(optimizer, optimizer_settings),
        "particles": particles,
        "scenarios": None if scenarios is None else scenario_data(scenarios, robot),
        "robot": None if robot is None else chosen_robot(robot),
        "iterations": iterations,
        "start_count": start_count,
        "name": name,
        "accept_changes": accept_changes or None,
    }
    options: ForkOptions = {k: v for k, v in values.items() if v is not None}  # type: ignore[assignment]
    with open_jobs(server, db) as jobs:
        job = jobs.fork(
            job_id,
            from_iteration,
            idempotency_key=idempotency_key,
            priority=priority,
            notify_url=notify,
            **options,
        )
        if as_json:
            print_json(job)
            return
        stdout_console().print(job.id, markup=False)
        if job.lineage is not None:
            note(f"{job.state}: {lineage_line(job.lineage)}")
        note(f"to follow it, run: gaitswarm watch {job.id}{jobs.place}")


def label(
    job_id: JobId,
    name: Annotated[
        str | None, typer.Option(help="Name to show instead of the spec's; empty restores that.")
    ] = None,
    note: Annotated[str | None, typer.Option(help="Note; empty removes it.")] = None,
    tag: Annotated[
        list[str] | None, typer.Option(help="Tag, replacing all tags; repeatable.")
    ] = None,
    no_tags: Annotated[bool, typer.Option("--no-tags", help="Remove all tags.")] = False,
    archive: Annotated[
        bool | None,
        typer.Option("--archive/--unarchive", help="Hide the job from lists, or show it again."),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Name, annotate, tag or archive a job; its spec and results do not change."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    tags = [] if no_tags else tag or None
    with open_jobs(server, db) as jobs:
        job = jobs.label(job_id, name=name, note=note, tags=tags, archived=archive)
    if as_json:
        print_json(job)
        return
    labels = [f"name {job.name!r}", *(f"tag {word}" for word in job.tags)]
    if job.note:
        labels.append("a note")
    if job.archived:
        labels.append("archived")
    stdout_console().print(f"job {job.id}: {', '.join(labels)}", markup=False)


def delete(
    job_id: JobId,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
    server: Server = None,
    db: Db = None,
) -> None:
    """Delete an ended or paused job with all its results."""
    import sys

    from gaitswarm.cli.output import note, stdout_console
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.services.optimizer.errors import InvalidRequest

    with open_jobs(server, db) as jobs:
        if not yes:
            note(_loss(jobs, jobs.job(job_id)))
            if not sys.stdin.isatty():
                raise InvalidRequest("not a terminal: pass --yes to confirm", field="yes")
            if not typer.confirm("Delete it?", err=True):
                note("nothing was deleted")
                return
        jobs.delete(job_id)
    stdout_console().print(f"job {job_id} is deleted", markup=False)


def keep(
    job_id: JobId,
    release: Annotated[bool, typer.Option("--release", help="Allow deletion again.")] = False,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Protect a job from deletion."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        job = jobs.keep(job_id, kept=not release)
    if as_json:
        print_json(job)
    else:
        state = "is kept" if job.kept else "is no longer kept"
        stdout_console().print(f"job {job.id} {state}", markup=False)


def _loss(jobs: Jobs, job: JobView) -> str:
    """Describe what deletion removes, and what remains."""
    forks = sum(1 for _ in jobs.jobs(parent=job.id))
    name = f" ({job.name})" if job.name else ""
    loss = (
        f"job {job.id}{name} is {job.state}; deletion removes {job.iterations} iterations with"
        f" {job.evaluations} evaluated designs permanently"
    )
    if forks:
        loss += f"\nforks that keep their copies of its iterations: {forks}"
    return f"{loss}\ncertificates of its designs remain"
