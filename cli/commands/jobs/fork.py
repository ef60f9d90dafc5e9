"""`gaitswarm fork`: a job that begins with iterations of another one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import (
    AcceptChanges,
    Db,
    JobId,
    JobName,
    Json,
    Notify,
    Priority,
    RobotOption,
    Server,
)

if TYPE_CHECKING:
    from gaitswarm.specs import ForkOptions


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(fork)


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
    from gaitswarm.cli.tables.views import lineage_line
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
