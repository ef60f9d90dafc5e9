"""`gaitswarm calibrate` and `targets`: robots and conventions fitted to a table of results."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from gaitswarm.cli.commands.measurements import ONE_RUN, parameters_table
from gaitswarm.cli.inputs.options import (
    JobIds,
    JobName,
    Precision,
    WorkerOptions,
    name_and_value,
)
from gaitswarm.cli.output import note
from gaitswarm.cli.tables import MISSING, number, place, table
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.near_names import instead_of

if TYPE_CHECKING:
    from gaitswarm.cli.output import Printed
    from gaitswarm.cli.rich_table import Table
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.services.optimizer.analysis.identifiability import IdentifiabilityView
    from gaitswarm.services.optimizer.analysis.targets import ReachedView, TargetsView

LeaveOneOut = Annotated[
    str | None,
    typer.Option(
        metavar="target|walk",
        help="Predict every target by the best design without it, or without its walk; without"
        " simulation.",
    ),
]


def calibrate(
    table: Annotated[
        Path,
        typer.Argument(
            metavar="TARGETS.csv", help="Results of walks, in the format of docs/calibration.md."
        ),
    ],
    *,
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...|JSON|FOLDER",
            help="Robot by name, or several names as choices of the variable `robot`; a variant as"
            " JSON; or a robot's folder.",
        ),
    ] = None,
    variables: Annotated[
        str | None,
        typer.Option(
            help="Variables to fit, separated by commas; NAME=LOW:HIGH sets bounds, and"
            " NAME=A:B limits choices. Default: all parameters of the robot."
        ),
    ] = None,
    fixed: Annotated[
        str | None, typer.Option(metavar="NAME=VALUE,...", help="Variables to fix.")
    ] = None,
    seeds: Annotated[
        int,
        typer.Option(
            min=1, max=32, help="Number of jobs with different seeds; one alone decides nothing."
        ),
    ] = 3,
    iterations: Annotated[int, typer.Option(help="Iterations of each job.")] = 60,
    particles: Annotated[int, typer.Option(help="Designs per iteration.")] = 48,
    seed: Annotated[int, typer.Option(help="Seed of the first job; others follow.")] = 1,
    precision: Precision = None,
    name: JobName = None,
    leave_one_out: LeaveOneOut = None,
    workers: WorkerOptions,
) -> Printed:
    """Fit a robot and unknown conventions to a table of results, in this process."""
    from gaitswarm.cli.embedded import run_seeds
    from gaitswarm.cli.inputs.spec_file import parse_spec
    from gaitswarm.cli.inputs.targets_file import read_targets
    from gaitswarm.operations import TargetsQuery
    from gaitswarm.specs import checked

    checked(TargetsQuery, {"leave_out": leave_one_out})
    document: dict[str, Any] = {
        "kind": "calibration",
        "name": name or f"calibration to {table.name}",
        **read_targets(table),
        **_robots(robot),
        "fixed": dict(name_and_value(entry, "fixed") for entry in _entries(fixed)),
        # Explore first, then converge, as for identification.
        "optimizer": {
            "name": "pso",
            "particles": particles,
            "inertia_start": 0.9,
            "inertia_end": 0.4,
        },
        "iterations": iterations,
        "precision": precision or "double",
    }
    if variables is not None:
        document["variables"] = _variables(document, variables)
    specs = [parse_spec({**document, "seed": seed + run}) for run in range(seeds)]
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
    jobs: Jobs, job_ids: list[str], leave_one_out: str | None
) -> tuple[dict[str, Any], Iterator[Table | str]]:
    from gaitswarm.operations import TargetsQuery
    from gaitswarm.specs import checked

    query = checked(TargetsQuery, {"leave_out": leave_one_out})
    reached = jobs.targets(job_ids, leave_out=query.leave_out)
    parameters = jobs.parameters(job_ids)
    views = {"targets": reached, "parameters": parameters}
    documents = {key: view.model_dump(mode="json") for key, view in views.items()}
    return documents, _parts(reached, parameters)


def _parts(reached: TargetsView, parameters: IdentifiabilityView) -> Iterator[Table | str]:
    """Yield targets, simulated values and differences; then the fitted parameters."""

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
    from gaitswarm.cli.inputs.robots import chosen_robot

    if text is None or text.lstrip().startswith("{") or "," not in text:
        return {"robot": chosen_robot(text)}
    return {"robots": [name.strip() for name in text.split(",")]}


def _variables(document: dict[str, Any], text: str) -> list[Any]:
    from gaitswarm.cli.inputs.spec_file import parse_spec
    from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec

    entries = _entries(text)
    if not any("=" in entry for entry in entries):
        return entries
    spec = cast(
        CalibrationSpec, parse_spec({**document, "fixed": {}, "variables": None, "seed": 1})
    )
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
