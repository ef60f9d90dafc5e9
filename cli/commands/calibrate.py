"""`gaitswarm calibrate`, `targets`: a robot and conventions from a table of results."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from gaitswarm.cli.inputs.options import (
    Db,
    JobIds,
    JobName,
    Json,
    Precision,
    Server,
    WorkerOptions,
    with_groups,
)
from gaitswarm.sim.near_names import instead_of

if TYPE_CHECKING:
    from gaitswarm.jobs.port import Jobs

LeaveOneOut = Annotated[
    str | None,
    typer.Option(
        metavar="target|walk",
        help="Predict every target by the design that is best without it, or without all of its"
        " walk; nothing is simulated.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(calibrate)
    app.command()(targets)


@with_groups
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
            help="Robot by name, or several for the variable `robot` to choose among; a variant as"
            " JSON, or the folder of your own.",
        ),
    ] = None,
    variables: Annotated[
        str | None,
        typer.Option(
            help="What to fit, separated by commas; NAME=LOW:HIGH for bounds of your own, and"
            " NAME=ONE:OTHER for some of its choices. Default: all of the robot's parameters."
        ),
    ] = None,
    fixed: Annotated[
        str | None, typer.Option(metavar="NAME=VALUE,...", help="What to hold at one value.")
    ] = None,
    seeds: Annotated[
        int,
        typer.Option(
            min=1, max=32, help="Jobs that differ in their seed: one alone decides nothing."
        ),
    ] = 3,
    iterations: Annotated[int, typer.Option(help="Iterations of each job.")] = 60,
    particles: Annotated[int, typer.Option(help="Designs of an iteration.")] = 48,
    seed: Annotated[int, typer.Option(help="Seed of the first job; the others count up.")] = 1,
    precision: Precision = None,
    name: JobName = None,
    leave_one_out: LeaveOneOut = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Fit a robot and open conventions to a table of results, here and now."""
    from gaitswarm.cli.calibration import read_targets
    from gaitswarm.cli.embedded import run_seeds
    from gaitswarm.cli.inputs.spec_file import parse_spec
    from gaitswarm.requests.arguments import leave_out

    leave_out(leave_one_out)
    document: dict[str, Any] = {
        "kind": "calibration",
        "name": name or f"calibration to {table.name}",
        **read_targets(table),
        **_robots(robot),
        "fixed": dict(_pair(entry, "fixed") for entry in _entries(fixed)),
        # Wide at first and narrow at last, as for identification.
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
    run_seeds(
        specs,
        workers,
        lambda jobs, ids: _show(jobs, ids, leave_one_out, as_json=as_json),
        again="targets",
    )


def targets(
    job_ids: JobIds,
    leave_one_out: LeaveOneOut = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Say how near calibrations that differ in their seed come to their targets.

    And what the evidence decides.
    """
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        _show(jobs, job_ids, leave_one_out, as_json=as_json)


def _show(jobs: Jobs, job_ids: list[str], leave_one_out: str | None, *, as_json: bool) -> None:
    import json

    from gaitswarm.cli.calibration import show_targets
    from gaitswarm.cli.output import print_text
    from gaitswarm.requests.arguments import leave_out

    reached = jobs.targets(job_ids, leave_out=leave_out(leave_one_out))
    parameters = jobs.parameters(job_ids)
    if as_json:
        views = {"targets": reached, "parameters": parameters}
        documents = {key: view.model_dump(mode="json") for key, view in views.items()}
        print_text(json.dumps(documents, indent=2, allow_nan=False))
    else:
        show_targets(reached, parameters)


def _robots(text: str | None) -> dict[str, Any]:
    """What a spec has of one robot, or of several shipped ones."""
    from gaitswarm.cli.inputs.robots import chosen_robot

    if text is None or text.lstrip().startswith("{") or "," not in text:
        return {"robot": chosen_robot(text)}
    return {"robots": [name.strip() for name in text.split(",")]}


def _variables(document: dict[str, Any], text: str) -> list[Any]:
    """Names, and variables with bounds or choices of the user's own."""
    from gaitswarm.cli.inputs.spec_file import parse_spec
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec

    entries = _entries(text)
    if not any("=" in entry for entry in entries):
        return entries
    # Everything is known to the catalogue, whatever of it is searched.
    whole = cast(
        CalibrationSpec, parse_spec({**document, "fixed": {}, "variables": None, "seed": 1})
    )
    known = {variable.name: variable for variable in whole.catalogue()}
    found: list[Any] = []
    for entry in entries:
        if "=" not in entry:
            found.append(entry)
            continue
        name, value = _pair(entry, "variables")
        if name not in known:
            raise InvalidRequest(
                f"unknown variable {name!r}; {instead_of(name, known)}", field="variables"
            )
        parts = [part.strip() for part in value.split(":")]
        if known[name].kind == "categorical":
            own: dict[str, Any] = {"choices": parts}
        elif len(parts) == 2:
            own = dict(zip(("low", "high"), parts, strict=True))
        else:
            raise InvalidRequest(f"{entry!r} is not NAME=LOW:HIGH", field="variables")
        found.append({"name": name, "kind": known[name].kind, **own})
    return found


def _entries(text: str | None) -> list[str]:
    return [] if text is None else [entry.strip() for entry in text.split(",")]


def _pair(entry: str, option: str) -> tuple[str, str]:
    from gaitswarm.services.optimizer.errors import InvalidRequest

    name, equals, value = entry.partition("=")
    if not (name and equals and value):
        raise InvalidRequest(f"{entry!r} is not NAME=VALUE", field=option)
    return name.strip(), value.strip()
