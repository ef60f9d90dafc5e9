"""Commands about jobs."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, TypeVar

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
    with_groups,
)

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs
    from gaitswarm.specs import ForkOptions
    from gaitswarm.views import HistoryIterationView, JobView
    from gaitswarm.views.comparison import JobComparisonView

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
    from gaitswarm.cli.tables import jobs_table
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
    from gaitswarm.cli.tables import print_job
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


def history(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show every committed iteration.

    With --json also every design: its values, fitness, statuses and raw objectives.
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
    """Show the best design that a job has found so far, scenario by scenario."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.cli.tables import print_best, worth
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
            "they judge by different measures, so their fitness cannot be compared", markup=False
        )


def fork(
    job_id: JobId,
    from_iteration: Annotated[
        int,
        typer.Option(
            "--from",
            metavar="K",
            help="First iteration that is the fork's own, counted from 0 as `history` does: it"
            " begins with those before it, 0 to K-1.",
        ),
    ],
    preference: Annotated[
        str | None, typer.Option(help="How objectives are weighed: A, B, C, chapter-3, or JSON.")
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
        int | None, typer.Option(help="Designs of one iteration, at most.")
    ] = None,
    scenarios: Annotated[
        str | None, typer.Option(help="Names, numbers or FILE.json, separated by commas.")
    ] = None,
    robot: RobotOption = None,
    iterations: Annotated[
        int | None,
        typer.Option(help="Budget in all, with the iterations that it begins with."),
    ] = None,
    start_count: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Designs to start from where the search cannot be taken over. [default: 5]",
        ),
    ] = None,
    name: JobName = None,
    accept_changes: AcceptChanges = False,
    idempotency_key: Annotated[
        str | None, typer.Option(help="The same key and fork again make no second job.")
    ] = None,
    priority: Priority = 0,
    notify: Notify = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Queue a job that begins with iterations of another one; what is not said is as in that."""
    from gaitswarm.cli.inputs.robots import chosen_robot, scenario_data
    from gaitswarm.cli.inputs.spec_file import optimizer_choice, preference_choice
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.cli.tables import lineage_line
    from gaitswarm.jobs.open import open_jobs

    given = {
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
    options: ForkOptions = {k: v for k, v in given.items() if v is not None}  # type: ignore[assignment]
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
        note(f"follow it: gaitswarm watch {job.id}{jobs.place}")


def label(
    job_id: JobId,
    name: Annotated[
        str | None, typer.Option(help="Show this in place of the spec's name; empty to end that.")
    ] = None,
    note: Annotated[str | None, typer.Option(help="Write this note.")] = None,
    tag: Annotated[
        list[str] | None, typer.Option(help="Tag it, in place of its tags; may be repeated.")
    ] = None,
    no_tags: Annotated[bool, typer.Option("--no-tags", help="Remove its tags.")] = False,
    archive: Annotated[
        bool | None,
        typer.Option("--archive/--unarchive", help="Put it out of the way in lists, or back."),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Name, note, tag or archive a job; its spec and its results stay as they are."""
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs

    tags = [] if no_tags else tag or None
    with open_jobs(server, db) as jobs:
        job = jobs.label(job_id, name=name, note=note, tags=tags, archived=archive)
    if as_json:
        print_json(job)
        return
    written = [f"name {job.name!r}", *(f"tag {word}" for word in job.tags)]
    if job.note:
        written.append("a note")
    if job.archived:
        written.append("archived")
    stdout_console().print(f"job {job.id}: {', '.join(written)}", markup=False)


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
