"""Commands about measured walks: record, identify, parameters, recordings, validate, synthesize."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

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
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.sim.measurement.measured_log import MeasuredLog, MeasuredWalk
    from gaitswarm.sim.measurement.synchronise import Synchronised
    from gaitswarm.sim.robot import Robot

LARGEST_FILE: Final = 1 << 28
"""Largest accepted log [B]; one second takes about 1 MB."""

_HUGE: Final = 1e300

DesignOption = Annotated[
    str,
    typer.Option(
        "--design",
        metavar="JSON|FILE|published:NAME|job:ID",
        help="Design as for `simulate`, or published:A.",
    ),
]
ScenarioOption = Annotated[
    str, typer.Option("--scenario", help="Name or number of the walk, or FILE.json.")
]
TrajectoryOption = Annotated[
    Path | None,
    typer.Option(
        "--trajectory", metavar="FILE", help="JSON object of gait parameters, added to the design."
    ),
]
CyclesOption = Annotated[
    int | None, typer.Option("--cycles", min=1, max=100, help="Walking cycles to simulate.")
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(record)
    app.command()(identify)
    app.command()(parameters)
    app.command()(recordings)
    app.command()(validate)
    app.command()(synthesize)


def read_walk(
    scenario: str,
    controller: str | None,
    design: str,
    trajectory: Path | None,
    cycles: int | None,
    robot: str | None,
    *,
    server: str | None,
    db: str | None,
) -> MeasuredWalk:
    """Return the walk of a design; a job's best uses the job's robot by default."""
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import chosen_scenarios
    from gaitswarm.sim.measurement.measured_log import MeasuredWalk
    from gaitswarm.sim.robot import load_robot

    given = given_design(design, controller, trajectory, robot=robot, server=server, db=db)
    values: Mapping[str, Any] = given.values
    for name, value in values.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and -_HUGE < value < _HUGE):
            raise InvalidRequest("must be a finite number", field=f"design.{name}")
    scenarios = chosen_scenarios(scenario, robot)
    if len(scenarios) != 1:
        raise InvalidRequest("must name one scenario", field="scenario")
    (chosen,) = scenarios
    if cycles is not None:
        chosen = chosen.model_copy(update={"cycles": float(cycles)})
    return MeasuredWalk.of(load_robot(given.robot(robot)), chosen, given.controller, given.values)


def synchronised(
    path: Path, log: MeasuredLog, simulated: MeasuredLog, walk: MeasuredWalk
) -> Synchronised:
    """Align a log with the simulated walk; errors name the file."""
    from gaitswarm.sim.errors import MeasuredLogError
    from gaitswarm.sim.measurement.synchronise import synchronise

    try:
        return synchronise(log, simulated, walk.cycle_time)
    except MeasuredLogError as error:
        raise InvalidRequest(f"{path}: {error}", field="measured") from error


def read_measured(path: Path, robot: Robot) -> MeasuredLog:
    """Read a log; errors name file, line, column and unit."""
    from gaitswarm.sim.errors import MeasuredLogError
    from gaitswarm.sim.measurement.measured_csv import parse_measured_log

    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field="measured") from error
    if len(content) > LARGEST_FILE:
        raise InvalidRequest(f"{path} is larger than {LARGEST_FILE >> 20} MiB", field="measured")
    try:
        return parse_measured_log(content.decode("utf-8"), robot)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InvalidRequest(f"{path}: line {line}: not UTF-8 text", field="measured") from error
    except MeasuredLogError as error:
        raise InvalidRequest(f"{path}: {error}", field="measured") from error


Truth = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.json",
        help="True values by name, as for `synthesize --parameters`, shown for comparison.",
    ),
]


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
    """Store a measured walk for identification, and print the recording's id."""
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.sim.identification.recorded_walk import record as recorded

    walk = read_walk(scenario, controller, design, trajectory, cycles, robot, server=server, db=db)
    log = read_measured(measured, walk.robot)
    pair = synchronised(measured, log, walk.simulated(), walk)
    recording = recorded(pair, walk.scenario, walk.controller, walk.design)
    with open_jobs(server, db, create=True) as jobs:
        view = jobs.record(recording)
    if as_json:
        print_json(view)
        return
    stdout_console().print(view.id, markup=False)
    note(
        f"{'SYNTHETIC ' if view.synthetic else ''}recording of {view.joints} currents over"
        f" {view.seconds:g} s, {pair.cycles} cycles of {view.scenario}"
    )


@with_groups
def identify(
    recordings: Annotated[
        list[str], typer.Argument(metavar="RECORDING...", help="Ids printed by `record`.")
    ],
    *,
    variables: Annotated[
        str | None,
        typer.Option(help="Parameters to fit, separated by commas. Default: all of table 2.7."),
    ] = None,
    links: Annotated[
        str, typer.Option(help="Links whose currents to compare, separated by commas.")
    ] = "1,2,3",
    robot: RobotOption = None,
    runs: Annotated[
        int,
        typer.Option(
            min=1, max=32, help="Number of jobs with different seeds; one alone shows no trust."
        ),
    ] = 3,
    iterations: Annotated[int, typer.Option(help="Iterations of each job.")] = 120,
    particles: Annotated[int, typer.Option(help="Designs per iteration.")] = 48,
    seed: Annotated[int, typer.Option(help="Seed of the first job; others follow.")] = 1,
    precision: Precision = None,
    name: JobName = None,
    truth: Truth = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Fit a robot's parameters to recorded walks in this process, and show which are reliable."""
    from gaitswarm.cli.calibration import read_truth, show_parameters
    from gaitswarm.cli.embedded import run_seeds
    from gaitswarm.cli.inputs.robots import chosen_robot
    from gaitswarm.cli.inputs.spec_file import parse_spec

    true_values = read_truth(truth)
    document = {
        "kind": "identification",
        "name": name or "identification",
        "robot": chosen_robot(robot),
        "recordings": recordings,
        "variables": None if variables is None else variables.split(","),
        "links": [int(link) if link.isdecimal() else link for link in links.split(",")],
        # Explore first, then converge: there are many parameters, and one valley.
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
        lambda jobs, ids: show_parameters(jobs.parameters(ids), true_values, as_json=as_json),
        report_command="parameters",
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
    """Show which fitted parameters are reliable: intervals at twelve fitness thresholds.

    Takes one job, or jobs that differ only in their seed.
    """
    from gaitswarm.cli.calibration import draw_parameters, read_truth, show_parameters
    from gaitswarm.cli.output import note
    from gaitswarm.cli.pictures import save
    from gaitswarm.jobs.open import open_jobs

    true_values = read_truth(truth)
    with open_jobs(server, db) as jobs:
        view = jobs.parameters(job_ids)
    show_parameters(view, true_values, as_json=as_json)
    if output is not None:
        save(draw_parameters(view, true_values), output)
        note(f"picture written to {output}")


def recordings(
    search: Annotated[
        str,
        typer.Option(
            metavar="TEXT",
            help="Only recordings whose id, scenario or controller contain this, in any case.",
        ),
    ] = "",
    limit: Annotated[int, typer.Option(min=1, help="Maximum number of recordings.")] = 50,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """List recorded walks and their ids for `identify`, newest first."""
    from gaitswarm.cli.output import note, print_json_list, stdout_console
    from gaitswarm.cli.tables import recordings_table
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        matches = jobs.recordings(search=search, limit=limit)
        if as_json:
            print_json_list(matches)
            return
        rows = list(matches)
    if not rows:
        note("no recording matches" if search else "no recordings yet; see `gaitswarm record`")
        return
    stdout_console().print(recordings_table(rows))


def validate(
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
    repeat: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE.csv", help="Another measurement of the same walk, for CONF; repeatable."
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write a report in Markdown, with pictures, to DIR."),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Simulate a measured walk, and classify the differences by tolerance."""
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.cli.validation import (
        alignment,
        comparison_table,
        confidence_table,
        remarks,
        write_report,
    )
    from gaitswarm.sim.validation import compare_synchronised

    walk = read_walk(scenario, controller, design, trajectory, cycles, robot, server=server, db=db)
    logs = {path: read_measured(path, walk.robot) for path in (measured, *(repeat or ()))}
    simulated = walk.simulated()
    pairs = [synchronised(path, log, simulated, walk) for path, log in logs.items()]
    comparison = compare_synchronised(pairs[0], [pair.measured for pair in pairs[1:]])
    if as_json:
        print_json(comparison)
    else:
        console = stdout_console()
        console.print(comparison_table(comparison))
        if comparison.repeats:
            console.print(confidence_table(comparison))
        console.print(alignment(comparison), markup=False)
    for remark in remarks(comparison):
        note(f"note: {remark}")
    if report is not None:
        facts = {
            "measured": measured.name,
            **{f"measured, {key}": value for key, value in logs[measured].metadata.items()},
            "simulated": f"{walk.robot.description.name} in {walk.scenario.name}",
            "controller": walk.controller,
            "design": ", ".join(f"{name}={value:g}" for name, value in walk.design.items()),
        }
        note(f"report written to {write_report(report, comparison, pairs[0], facts)}")


def synthesize(
    design: DesignOption,
    scenario: ScenarioOption,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE.csv", help="Where to write the log.")
    ],
    controller: ControllerOption = None,
    trajectory: TrajectoryOption = None,
    cycles: CyclesOption = None,
    robot: RobotOption = None,
    seed: Annotated[
        int, typer.Option(min=0, max=(1 << 64) - 1, help="Seed of the sensor noise.")
    ] = 1,
    parameters: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="Parameter values by name; the twin differs only in these.",
        ),
    ] = None,
    server: Server = None,
    db: Db = None,
) -> None:
    """Write a SYNTHETIC log of a perturbed twin of the robot with sensor noise, for tests."""
    from gaitswarm.cli.calibration import read_truth
    from gaitswarm.cli.files import replacing
    from gaitswarm.cli.output import note
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.sim.measurement.measured_csv import format_measured_log
    from gaitswarm.sim.measurement.synthetic import Perturbation, synthetic_log
    from gaitswarm.sim.robot.identifiable import identifiable_variables

    if output.suffix != ".csv":
        raise InvalidRequest(f"{output} must end in .csv", field="output")
    walk = read_walk(scenario, controller, design, trajectory, cycles, robot, server=server, db=db)
    twin = None
    if parameters is not None:
        names = {variable.name for variable in identifiable_variables(walk.robot)}
        values = read_truth(parameters)
        for name in values:
            if name not in names:
                raise InvalidRequest("no such parameter of the robot", field=f"parameters.{name}")
        twin = Perturbation.of(values)
    log = synthetic_log(
        walk.robot, walk.scenario, walk.controller, walk.design, seed=seed, perturbation=twin
    )
    with replacing(output, "output") as file:
        file.write(format_measured_log(log).encode())
    note(f"SYNTHETIC log of {len(log.time)} rows written to {output}")
