"""`gaitswarm certify`: one design in many worlds, and in scenarios that no job contained."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gaitswarm.cli.inputs.options import (
    ControllerOption,
    JobName,
    Json,
    Precision,
    RobotOption,
    WorkerOptions,
    with_groups,
)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(certify)


@with_groups
def certify(
    design: Annotated[
        str,
        typer.Argument(
            metavar="DESIGN|ID",
            help="A published design, as published:A; a file with a JSON object {variable: value},"
            " or `-` for standard input; or the identifier of a job, whose best is taken with its"
            " robot, controller and preference, or of a certificate, which goes on.",
        ),
    ],
    *,
    worlds: Annotated[
        int | None, typer.Option(min=1, max=100_000, help="Worlds to draw. [default: 1000]")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Of the worlds. [default: 1]")] = None,
    scenarios: Annotated[
        str | None,
        typer.Option(
            help="Names, numbers or FILE.json, separated by commas. Default: those of the job, of"
            " the robot's folder or of table 4.2, and so many held-out ones that there are eight,"
            " two at least."
        ),
    ] = None,
    ranges: Annotated[
        list[str] | None,
        typer.Option(
            "--range",
            metavar="NAME=LOW:HIGH",
            help="Draw this perturbation from a range of your own; may be repeated.",
        ),
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Hold this perturbation at one value in all worlds; may be repeated.",
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="Draw these perturbations alone; the others stay nominal. Default: all.",
        ),
    ] = None,
    controller: ControllerOption = None,
    robot: RobotOption = None,
    preference: Annotated[
        str | None,
        typer.Option(
            help="A, B, C or chapter-3: how objectives are weighed [default: the job's, else that"
            " of the robot's folder, else A]."
        ),
    ] = None,
    precision: Precision = None,
    engines: Annotated[
        list[str] | None,
        typer.Option(
            "--engine",
            metavar="mujoco|mujoco-contacts",
            help="Let the design walk in the nominal world in this engine, too, and tell the"
            " differences: in MuJoCo under our laws of contact, or with its own contacts. May be"
            " repeated; needs pip install 'gaitswarm[mujoco]'.",
        ),
    ] = None,
    name: JobName = None,
    most: Annotated[int, typer.Option(min=0, max=1000, help="Worst worlds to name.")] = 5,
    replay: Annotated[
        int | None,
        typer.Option(
            metavar="K",
            min=0,
            max=99_999,
            help="Run no certificate: let the design walk in world K again, and show its results.",
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.npz",
            help="With --replay: write the walks' 500 Hz logs as NumPy arrays.",
        ),
    ] = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Put a design to the test in many worlds: how often it fails, and how bad it gets.

    A world is one draw of all that a model may get wrong: friction, masses, battery, sensors. World
    K is the same for every design under one seed. The same command goes on where it was stopped;
    more worlds walk only what is missing.
    """
    from contextlib import closing
    from dataclasses import asdict

    from gaitswarm.cli.certificate import certificate_spec, show_certificate, show_world
    from gaitswarm.cli.embedded import Embedded, job_run
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.database.jobs import DatabaseJobs
    from gaitswarm.jobs.open import database_to_write
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.service import JobService
    from gaitswarm.services.runtime import open_store
    from gaitswarm.settings import read_settings

    given = {
        "worlds": worlds,
        "seed": seed,
        "scenarios": scenarios,
        "ranges": ranges,
        "fixed": fixed,
        "only": only,
        "controller": controller,
        "robot": robot,
        "preference": preference,
        "precision": precision,
        "engines": engines,
        "name": name,
    }
    spec = certificate_spec(design, workers.db, given)
    if replay is not None:
        show_world(spec, replay, log, as_json=as_json)
        return
    if log is not None:
        raise InvalidRequest("goes with --replay, which says of which world", field="log")
    settings = read_settings(**asdict(workers))
    url = database_to_write(settings)
    with closing(open_store(url)) as store, closing(Embedded(settings)) as embedded:
        jobs = DatabaseJobs(JobService(store), url)
        job = job_run(spec, store, jobs, embedded, any_budget=True)
        view = jobs.certificate(job.id, worlds=spec.worlds, most=most)
    if as_json:
        print_json(view)
    else:
        show_certificate(view, jobs.place)
