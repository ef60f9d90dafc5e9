"""`gaitswarm certify`: one design in many worlds and in held-out scenarios."""

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
            " or `-` for standard input; the id of a job, for its best with its robot, controller"
            " and preference; or the id of a certificate to continue.",
        ),
    ],
    *,
    worlds: Annotated[
        int | None, typer.Option(min=1, max=100_000, help="Number of worlds. [default: 1000]")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of the worlds. [default: 1]")
    ] = None,
    scenarios: Annotated[
        str | None,
        typer.Option(
            help="Names, numbers or FILE.json, separated by commas. Default: those of the job, of"
            " the robot's folder or of table 4.2, and at least two held-out ones, for a total of"
            " eight."
        ),
    ] = None,
    ranges: Annotated[
        list[str] | None,
        typer.Option(
            "--range",
            metavar="NAME=LOW:HIGH",
            help="Draw this perturbation from another range; repeatable.",
        ),
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Fix this perturbation in all worlds; repeatable.",
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="Draw only these perturbations; others stay nominal. Default: all.",
        ),
    ] = None,
    controller: ControllerOption = None,
    robot: RobotOption = None,
    preference: Annotated[
        str | None,
        typer.Option(
            help="Weighting of objectives: A, B, C or chapter-3 [default: the job's, else that of"
            " the robot's folder, else A]."
        ),
    ] = None,
    precision: Precision = None,
    engines: Annotated[
        list[str] | None,
        typer.Option(
            "--engine",
            metavar="mujoco|mujoco-contacts",
            help="Also simulate the nominal world in this engine and show the differences: MuJoCo"
            " with our contact laws, or with its own contacts. Repeatable; needs pip install"
            " 'gaitswarm[mujoco]'.",
        ),
    ] = None,
    name: JobName = None,
    most: Annotated[int, typer.Option(min=0, max=1000, help="Worst worlds to list.")] = 5,
    replay: Annotated[
        int | None,
        typer.Option(
            metavar="K",
            min=0,
            max=99_999,
            help="Run no certificate: simulate the design in world K again and show its results.",
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.npz",
            help="With --replay: write 500 Hz logs as NumPy arrays.",
        ),
    ] = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Test a design in many worlds: how often it fails, and how bad it gets.

    A world is one sample of the model's uncertainties: friction, masses, battery, sensors. With
    one seed, world K is the same for every design. Run the same command to resume; with more
    worlds, only the missing ones are simulated.
    """
    from contextlib import closing
    from dataclasses import asdict

    from gaitswarm.cli.certificate import certificate_spec, show_certificate, show_world
    from gaitswarm.cli.embedded import Embedded, job_run
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.database import DatabaseJobs
    from gaitswarm.jobs.open import database_to_write
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.service import JobService
    from gaitswarm.services.runtime import open_store
    from gaitswarm.settings import read_settings

    values = {
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
    spec = certificate_spec(design, workers.db, values)
    if replay is not None:
        show_world(spec, replay, log, as_json=as_json)
        return
    if log is not None:
        raise InvalidRequest("requires --replay", field="log")
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
