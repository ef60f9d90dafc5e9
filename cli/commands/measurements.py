"""Commands about measured walks and tables of results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, cast

import typer

from gaitswarm.cli.options import (
    ControllerOption,
    JobIds,
    JobName,
    Place,
    Precision,
    RobotOption,
    TrajectoryOption,
    WorkerOptions,
    name_and_value,
)
from gaitswarm.cli.output import Parts, Printed, note
from gaitswarm.cli.tables import MISSING, number, place, table
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.near_names import instead_of

if TYPE_CHECKING:
    from rich.table import Table

    from gaitswarm.jobs.base import Jobs
    from gaitswarm.services.optimizer.analysis.identifiability import (
        IdentifiabilityView,
        ParameterView,
    )
    from gaitswarm.services.optimizer.analysis.targets import ReachedView, TargetsView
    from gaitswarm.sim.measurement.measured_log import MeasuredLog, MeasuredWalk, Synchronised
    from gaitswarm.sim.robot.robot import Robot

LARGEST_FILE: Final = 1 << 28
"""Largest accepted log [B]; one second takes about 1 MB."""

_HUGE: Final = 1e300


@dataclass(frozen=True, slots=True)
class WalkOptions:
    """Options that describe a measured walk.

    Args:
        design: Design as for `simulate`, or published:A.
        scenario: Name or number of the walk, or FILE.json.
        cycles: Walking cycles to simulate.
    """

    design: Annotated[str, typer.Option(metavar="JSON|FILE|published:NAME|job:ID")]
    scenario: Annotated[str, typer.Option()]
    controller: ControllerOption = None
    trajectory: TrajectoryOption = None
    cycles: Annotated[int | None, typer.Option(min=1, max=100)] = None
    robot: RobotOption = None

    def read(self, place: Place) -> MeasuredWalk:
        """Return the walk; a job's best uses the job's robot by default."""
        from gaitswarm.cli.inputs import given_design, one_scenario
        from gaitswarm.sim.measurement.measured_log import MeasuredWalk
        from gaitswarm.sim.robot import load_robot

        given = given_design(
            self.design, self.controller, self.trajectory, robot=self.robot, place=place
        )
        values: Mapping[str, Any] = given.values
        for name, value in values.items():
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and -_HUGE < value < _HUGE):
                raise InvalidRequest("must be a finite number", field=f"design.{name}")
        scenario = one_scenario(self.scenario, self.robot, preset=self.scenario)
        if self.cycles is not None:
            scenario = scenario.model_copy(update={"cycles": float(self.cycles)})
        robot = load_robot(given.robot(self.robot))
        return MeasuredWalk.of(robot, scenario, given.controller, given.values)


Measured = Annotated[
    Path,
    typer.Argument(metavar="MEASURED", help="Log, .csv, .npz or .mcap, as in docs/validation.md."),
]


def synchronised(
    path: Path, log: MeasuredLog, simulated: MeasuredLog, walk: MeasuredWalk
) -> Synchronised:
    """Align a log with the simulated walk; errors name the file."""
    from gaitswarm.sim.errors import MeasuredLogError
    from gaitswarm.sim.measurement.measured_log import synchronise

    try:
        return synchronise(log, simulated, walk.cycle_time)
    except MeasuredLogError as error:
        raise InvalidRequest(f"{path}: {error}", field="measured") from error


def read_measured(path: Path, robot: Robot) -> MeasuredLog:
    """Read a log; errors name file, line or row, column and unit."""
    from gaitswarm.cli.inputs import read_file
    from gaitswarm.sim.errors import MeasuredLogError
    from gaitswarm.sim.measurement.measured_files import parse_mcap, parse_measured_log, parse_npz

    content = read_file(path, "measured", LARGEST_FILE)
    parsed = {".npz": parse_npz, ".mcap": parse_mcap}.get(path.suffix.lower())
    try:
        return parsed(content, robot) if parsed else parse_measured_log(content.decode(), robot)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InvalidRequest(f"{path}: line {line}: not UTF-8 text", field="measured") from error
    except MeasuredLogError as error:
        raise InvalidRequest(f"{path}: {error}", field="measured") from error


Truth = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.json",
        help="True values by name, shown for comparison.",
    ),
]


def record(
    measured: Measured,
    options: WalkOptions,
    *,
    place: Place,
) -> Printed:
    """Store a measured walk for identification, and print the recording's id."""
    from gaitswarm.sim.identification import record as recorded

    walk = options.read(place)
    log = read_measured(measured, walk.robot)
    pair = synchronised(measured, log, walk.simulated(), walk)
    recording = recorded(pair, walk.scenario, walk.controller, walk.design)
    with place.open(create=True) as jobs:
        view = jobs.record(recording)

    def parts() -> Parts:
        yield view.id
        note(
            f"{'SYNTHETIC ' if view.synthetic else ''}recording of {view.joints} currents over"
            f" {view.seconds:g} s, {pair.cycles} cycles of {view.scenario}"
        )

    return view, parts()


def identify(
    recordings: Annotated[list[str], typer.Argument(metavar="RECORDING...")],
    *,
    variables: str | None = None,
    links: str = "1,2,3",
    robot: RobotOption = None,
    runs: Annotated[int, typer.Option(min=1, max=32)] = 3,
    iterations: int = 120,
    particles: int = 48,
    seed: int = 1,
    precision: Precision = None,
    name: JobName = None,
    truth: Truth = None,
    workers: WorkerOptions,
) -> Printed:
    """Fit a robot's parameters to recorded walks in this process, and show which are reliable.

    Args:
        recordings: Ids printed by `record`.
        variables: Parameters to fit, separated by commas. Default: all of table 2.7.
        links: Links whose currents to compare, separated by commas.
        runs: Number of jobs with different seeds; one alone shows no trust.
        iterations: Iterations of each job.
        particles: Designs per iteration.
        seed: Seed of the first job; others follow.
    """
    from gaitswarm.cli.embedded import run_seeds
    from gaitswarm.cli.inputs import chosen_robot
    from gaitswarm.specs import job_spec

    true_values = read_truth(truth)
    document = {
        "kind": "identification",
        "name": name or "identification",
        "robot": chosen_robot(robot),
        "recordings": recordings,
        "variables": None if variables is None else variables.split(","),
        "links": [int(link) if link.isdecimal() else link for link in links.split(",")],
        "optimizer": _swarm(particles),
        "iterations": iterations,
        "precision": precision or "double",
    }
    specs = [job_spec({**document, "seed": seed + run}) for run in range(runs)]

    def report(jobs: Jobs, ids: list[str]) -> Printed:
        view = jobs.parameters(ids)
        return view, _parameters(view, true_values)

    return run_seeds(specs, workers, report, report_command="parameters")


def _swarm(particles: int) -> dict[str, Any]:
    """Explore first, then converge, for many parameters in a single valley."""
    inertia = {"inertia_start": 0.9, "inertia_end": 0.4}
    return {"name": "pso", "particles": particles, **inertia}


def parameters(
    job_ids: JobIds,
    truth: Truth = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Draw the intervals: .png, .svg."),
    ] = None,
    *,
    jobs: Jobs,
) -> Printed:
    """Show which fitted parameters are reliable: intervals at twelve fitness thresholds.

    Takes one job, or jobs that differ only in their seed.
    """
    true_values = read_truth(truth)
    view = jobs.parameters(job_ids)
    if output is not None:
        from gaitswarm.cli.pictures import draw_parameters, save

        save(draw_parameters(view, true_values), output)
    return view, _parameters(view, true_values)


_SHOWN: Final = (0.2, 0.1, 0.05, 0.02)
"""Thresholds shown in tables; JSON and the picture contain all twelve."""

_TRUST: Final = {"trusted": "green", "rough": "yellow", "unknown": "red"}

ONE_RUN: Final = "note: a single run always converges; runs with other seeds show what is reliable"


def read_truth(path: Path | None) -> dict[str, float]:
    """Read true values by name; none without a file."""
    from gaitswarm.cli.inputs import read_json_object

    values = {} if path is None else read_json_object(path, "truth")
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InvalidRequest("must be a number", field=f"truth.{name}")
    return values


def _parameters(view: IdentifiabilityView, truth: Mapping[str, float]) -> Parts:
    yield parameters_table(view, truth)
    for job, fitness in zip(view.jobs, view.fitness, strict=True):
        yield f"job {job}: mean error of currents {1000 * fitness:.2f} mA"
    if len(view.jobs) == 1:
        note(ONE_RUN)


def parameters_table(view: IdentifiabilityView, truth: Mapping[str, float]) -> Table:
    def width(p: ParameterView, threshold: float) -> str:
        interval = p.intervals[view.thresholds.index(threshold)]
        return f"{100.0 * (interval.high - interval.low) / (p.high - p.low):.0f}"

    rows = (
        (
            *(p.name, p.unit, number(p.best)),
            *([truth.get(p.name)] if truth else []),
            *(width(p, threshold) for threshold in _SHOWN),
            (p.trust or "one run", _TRUST.get(p.trust or "", "")),
        )
        for p in view.parameters
    )
    heads = ["parameter", "<unit", "best", *(["true"] if truth else [])]
    heads += [*(f"{threshold:.0%}" for threshold in _SHOWN), "<trust"]
    title = "Fitted parameters; widths of their intervals in % of the range searched"
    return table(heads, rows, title=title, gap=1)


def recordings(
    search: Annotated[str, typer.Option(metavar="TEXT")] = "",
    limit: Annotated[int, typer.Option(min=1)] = 50,
    *,
    jobs: Jobs,
) -> Printed:
    """List recorded walks and their ids for `identify`, newest first.

    Args:
        search: Only recordings whose id, scenario or controller contain this, in any case.
        limit: Maximum number of recordings.
    """

    def parts() -> Parts:
        rows = [
            (
                entry.id,
                f"{entry.scenario} {entry.controller}{' SYNTHETIC' if entry.synthetic else ''}",
                f"{entry.joints} over {number(entry.seconds)} s",
                f"{entry.created_at:%Y-%m-%d %H:%M}",
            )
            for entry in jobs.recordings(search=search, limit=limit)
        ]
        if rows:
            yield table(("id", "<walk", "<currents", "<recorded (UTC)"), rows)
        else:
            note("no recording matches" if search else "no recordings yet; see `gaitswarm record`")

    return jobs.recordings(search=search, limit=limit), parts()


def validate(
    measured: Measured,
    options: WalkOptions,
    repeat: Annotated[list[Path] | None, typer.Option(metavar="FILE")] = None,
    report: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
    *,
    place: Place,
) -> Printed:
    """Simulate a measured walk, classify the differences by tolerance, and give a verdict.

    Args:
        repeat: Another measurement of the same walk, for CONF; repeatable.
        report: Write a report in Markdown, with pictures, to DIR.
    """
    from gaitswarm.cli.validation import (
        alignment,
        battery,
        comparison_table,
        confidence_table,
        remarks,
        verdict_lines,
        write_report,
    )
    from gaitswarm.sim.validation import compare_synchronised

    walk = options.read(place)
    logs = {path: read_measured(path, walk.robot) for path in (measured, *(repeat or ()))}
    simulated = walk.simulated()
    pairs = [synchronised(path, log, simulated, walk) for path, log in logs.items()]
    comparison = compare_synchronised(pairs[0], [pair.measured for pair in pairs[1:]])
    if report is not None:
        facts = {
            "measured": measured.name,
            **{f"measured, {key}": value for key, value in logs[measured].metadata.items()},
            "simulated": f"{walk.robot.description.name} in {walk.scenario.name}",
            "controller": walk.controller,
            "design": ", ".join(f"{name}={value:g}" for name, value in walk.design.items()),
        }
        note(f"report written to {write_report(report, comparison, pairs[0], facts)}")
    for remark in remarks(comparison):
        note(f"note: {remark}")

    def parts() -> Parts:
        yield comparison_table(comparison)
        if comparison.repeats:
            yield confidence_table(comparison)
        yield battery(comparison)
        yield alignment(comparison)
        yield from verdict_lines(comparison.verdict)

    return comparison, parts()


LeaveOneOut = Annotated[
    Literal["target", "walk"] | None,
    typer.Option(
        metavar="target|walk",
        help="Predict every target by the best design without it, or without its walk; without"
        " simulation.",
    ),
]


def calibrate(
    table: Annotated[Path, typer.Argument(metavar="TARGETS.csv")],
    *,
    robot: Annotated[str | None, typer.Option(metavar="NAME,...|JSON|FOLDER")] = None,
    variables: str | None = None,
    fixed: Annotated[str | None, typer.Option(metavar="NAME=VALUE,...")] = None,
    seeds: Annotated[int, typer.Option(min=1, max=32)] = 3,
    iterations: int = 60,
    particles: int = 48,
    seed: int = 1,
    precision: Precision = None,
    name: JobName = None,
    leave_one_out: LeaveOneOut = None,
    workers: WorkerOptions,
) -> Printed:
    """Fit a robot and unknown conventions to a table of results, in this process.

    Args:
        table: Results of walks, in the format of docs/calibration.md.
        robot: Robot by name, or several names as choices of the variable `robot`; a variant as
            JSON; or a robot's folder.
        variables: Variables to fit, separated by commas; NAME=LOW:HIGH sets bounds, and NAME=A:B
            limits choices. Default: all parameters of the robot.
        fixed: Variables to fix.
        seeds: Number of jobs with different seeds; one alone decides nothing.
        iterations: Iterations of each job.
        particles: Designs per iteration.
        seed: Seed of the first job; others follow.
    """
    from gaitswarm.cli.embedded import run_seeds
    from gaitswarm.cli.targets_file import read_targets
    from gaitswarm.specs import job_spec

    document: dict[str, Any] = {
        "kind": "calibration",
        "name": name or f"calibration to {table.name}",
        **read_targets(table),
        **_robots(robot),
        "fixed": dict(name_and_value(entry, "fixed") for entry in _entries(fixed)),
        "optimizer": _swarm(particles),
        "iterations": iterations,
        "precision": precision or "double",
    }
    if variables is not None:
        document["variables"] = _variables(document, variables)
    specs = [job_spec({**document, "seed": seed + run}) for run in range(seeds)]
    return run_seeds(
        specs,
        workers,
        lambda jobs, ids: _targets(jobs, ids, leave_one_out),
        report_command="targets",
    )


def targets(
    job_ids: JobIds,
    leave_one_out: LeaveOneOut = None,
    *,
    jobs: Jobs,
) -> Printed:
    """Show how closely calibrations meet their targets, and what the evidence decides.

    The jobs differ only in their seed.
    """
    return _targets(jobs, job_ids, leave_one_out)


def _targets(
    jobs: Jobs, job_ids: list[str], leave_one_out: Literal["target", "walk"] | None
) -> tuple[dict[str, Any], Parts]:
    reached = jobs.targets(job_ids, leave_out=leave_one_out)
    parameters = jobs.parameters(job_ids)
    return {"targets": reached, "parameters": parameters}, _calibrated(reached, parameters)


def _calibrated(reached: TargetsView, parameters: IdentifiabilityView) -> Parts:
    def values(target: ReachedView | None) -> tuple[str, str]:
        off = None if target is None else target.difference
        simulated = None if target is None else target.simulated
        return number(simulated), MISSING if off is None else f"{off:+.2f}"

    left_out = any(target.left_out is not None for target in reached.targets)
    rows = (
        (
            t.walk if t.relative_to is None else f"{t.walk} / {t.relative_to}",
            *(t.quantity, t.unit, number(t.value), *values(t)),
            *(values(t.left_out) if left_out else ()),
            "" if t.use == "fit" else "predict",
        )
        for t in reached.targets
    )
    heads = ["walk", "<quantity", "<unit", "target", "simulated", "off"]
    heads += [*(("left out", "off") if left_out else ()), "<"]
    yield table(heads, rows, title="Targets; off: difference in tolerances", gap=1)
    yield (
        f"misfit {reached.fitness:.3f} tolerances (root mean square over fitted targets): job"
        f" {reached.job}, design {place(reached)}"
    )
    for job, fitness in zip(parameters.jobs, parameters.fitness, strict=True):
        yield f"job {job}: misfit {fitness:.3f}"
    yield parameters_table(parameters, {})
    choices = [
        (
            *("" if index else parameter.name, choice.name),
            *map(number, (choice.fitness, *choice.by_run)),
            "" if index else parameter.explanation or "one run",
        )
        for parameter in parameters.parameters
        for index, choice in enumerate(parameter.choices)
    ]
    if choices:
        runs = (f"run {k}" for k in range(1, len(parameters.jobs) + 1))
        heads = ["variable", "<choice", "misfit", *runs, "<evidence"]
        yield table(heads, choices, title="Least misfit by choice", gap=1)
    if len(parameters.jobs) == 1:
        note(ONE_RUN)


def _robots(text: str | None) -> dict[str, Any]:
    """Return the spec's field of one robot, or of several shipped ones."""
    from gaitswarm.cli.inputs import chosen_robot

    if text is None or text.lstrip().startswith("{") or "," not in text:
        return {"robot": chosen_robot(text)}
    return {"robots": [name.strip() for name in text.split(",")]}


def _variables(document: dict[str, Any], text: str) -> list[Any]:
    from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
    from gaitswarm.specs import job_spec

    entries = _entries(text)
    if not any("=" in entry for entry in entries):
        return entries
    spec = cast(CalibrationSpec, job_spec({**document, "fixed": {}, "variables": None, "seed": 1}))
    catalogue = {variable.name: variable for variable in spec.catalogue()}
    variables: list[Any] = []
    for entry in entries:
        if "=" not in entry:
            variables.append(entry)
            continue
        name, value = name_and_value(entry, "variables")
        if name not in catalogue:
            raise InvalidRequest(
                f"unknown variable {name!r}; {instead_of(name, catalogue)}", field="variables"
            )
        parts = [part.strip() for part in value.split(":")]
        if catalogue[name].kind == "categorical":
            domain: dict[str, Any] = {"choices": parts}
        elif len(parts) == 2:
            domain = dict(zip(("low", "high"), parts, strict=True))
        else:
            raise InvalidRequest(f"{entry!r} is not NAME=LOW:HIGH", field="variables")
        variables.append({"name": name, "kind": catalogue[name].kind, **domain})
    return variables


def _entries(text: str | None) -> list[str]:
    return [] if text is None else [entry.strip() for entry in text.split(",")]
