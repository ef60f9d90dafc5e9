"""`gaitswarm record`, `identify`, `parameters`: a robot's parameters from measured walks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gaitswarm.cli.inputs.measured_walk import (
    CyclesOption,
    DesignOption,
    ScenarioOption,
    TrajectoryOption,
)
from gaitswarm.cli.inputs.options import (
    ControllerOption,
    Db,
    JobIds,
    JobName,
    Json,
    Precision,
    RobotOption,
    Server,
    WorkerOptions,
    with_groups,
)

Truth = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.json",
        help="True values by name, as `synthesize --parameters` takes them: shown beside.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(record)
    app.command()(identify)
    app.command()(parameters)


def record(
    measured: Annotated[
        Path,
        typer.Argument(metavar="MEASURED.csv", help="Log in the format of docs/validation.md."),
    ],
    design: DesignOption,
    scenario: ScenarioOption,
    controller: ControllerOption = None,
    trajectory: TrajectoryOption = None,
    cycles: CyclesOption = None,
    robot: RobotOption = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Keep a measured walk where jobs can fit a robot to it; prints the recording's id."""
    from gaitswarm.cli.inputs.measured_walk import read_measured, read_walk, synchronised
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.sim.identification.recorded_walk import record as recorded

    walk = read_walk(scenario, controller, design, trajectory, cycles, robot, server=server, db=db)
    log = read_measured(measured, walk.robot)
    pair = synchronised(measured, log, walk.simulated(), walk)
    taken = recorded(pair, walk.scenario, walk.controller, walk.design)
    with open_jobs(server, db, create=True) as jobs:
        kept = jobs.record(taken)
    if as_json:
        print_json(kept)
        return
    stdout_console().print(kept.id, markup=False)
    note(
        f"{'SYNTHETIC ' if kept.synthetic else ''}recording of {kept.joints} currents over"
        f" {kept.seconds:g} s, {pair.cycles} cycles of {kept.scenario}"
    )


@with_groups
def identify(
    recordings: Annotated[
        list[str], typer.Argument(metavar="RECORDING...", help="Ids that `record` printed.")
    ],
    *,
    variables: Annotated[
        str | None,
        typer.Option(help="Parameters to fit, separated by commas. Default: all of table 2.7."),
    ] = None,
    links: Annotated[
        str, typer.Option(help="Links whose currents are compared, separated by commas.")
    ] = "1,2,3",
    robot: RobotOption = None,
    runs: Annotated[
        int,
        typer.Option(
            min=1, max=32, help="Jobs that differ in their seed: one alone shows no trust."
        ),
    ] = 3,
    iterations: Annotated[int, typer.Option(help="Iterations of each job.")] = 120,
    particles: Annotated[int, typer.Option(help="Designs of an iteration.")] = 48,
    seed: Annotated[int, typer.Option(help="Seed of the first job; the others count up.")] = 1,
    precision: Precision = None,
    name: JobName = None,
    truth: Truth = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Fit parameters of a robot to recorded walks, here and now, and say which can be trusted."""
    from gaitswarm.cli.embedded import run_seeds
    from gaitswarm.cli.inputs.robots import chosen_robot
    from gaitswarm.cli.inputs.spec_file import parse_spec
    from gaitswarm.cli.tables.parameters import read_truth, show_parameters

    known = read_truth(truth)
    document = {
        "kind": "identification",
        "name": name or "identification",
        "robot": chosen_robot(robot),
        "recordings": recordings,
        "variables": None if variables is None else variables.split(","),
        "links": [int(link) if link.isdecimal() else link for link in links.split(",")],
        # Wide at first and narrow at last: there are many parameters, and one valley.
        "optimizer": {
            "name": "pso",
            "particles": particles,
            "inertia_start": 0.9,
            "inertia_end": 0.4,
        },
        "iterations": iterations,
        "precision": precision or "double",
    }
    specs = [parse_spec({**document, "seed": seed + run}) for run in range(runs)]
    run_seeds(
        specs,
        workers,
        lambda jobs, ids: show_parameters(jobs.parameters(ids), known, as_json=as_json),
        again="parameters",
    )


def parameters(
    job_ids: JobIds,
    truth: Truth = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Draw the intervals: .png, .svg."),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Say which fitted parameters can be trusted: intervals at twelve fitness thresholds.

    Of one job, or of jobs of one problem that differ in their seed.
    """
    from gaitswarm.cli.output import note
    from gaitswarm.cli.pictures.plots import save
    from gaitswarm.cli.tables.parameters import draw_parameters, read_truth, show_parameters
    from gaitswarm.jobs.open import open_jobs

    known = read_truth(truth)
    with open_jobs(server, db) as jobs:
        found = jobs.parameters(job_ids)
    show_parameters(found, known, as_json=as_json)
    if output is not None:
        save(draw_parameters(found, known), output)
        note(f"picture written to {output}")
