"""Options that several commands share, and jobs run by these options."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from rich.console import Console
from rich.progress import Progress

from gaitswarm import CONTROLLERS, InvalidRequest, OptimizationResult, optimize

Db = Annotated[
    str | None,
    typer.Option(help="Database of the jobs: a file or URL. Default: the user's own."),
]
Cpus = Annotated[
    int | None,
    typer.Option(min=1, help="Simulations to compute at once. Default: all processors."),
]
RayAddress = Annotated[
    str | None,
    typer.Option(help="Ray cluster to run the jobs on. Default: this process runs them."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]
Robot = Annotated[
    str | None, typer.Option(help="Name of a shipped robot, or the folder of another.")
]
Design = Annotated[
    str, typer.Option(metavar="JSON|FILE|published:NAME", help="Values of the design by name.")
]

Spec: TypeAlias = Any
"""Specification of a job, as `gaitswarm.job_spec` returns it."""

stderr = Console(stderr=True, highlight=False)


def run_job(
    spec: Spec, *, db: str | None, cpus: int | None, ray_address: str | None
) -> OptimizationResult:
    """Run a job, or return the result of the same job that was run before."""
    with Progress(console=stderr, transient=True, disable=not stderr.is_terminal) as progress:
        task = progress.add_task(spec.name, total=spec.iterations)
        return optimize(
            spec,
            reuse=True,
            db=db,
            cpus=cpus,
            ray_address=ray_address,
            on_iteration=lambda _: progress.advance(task),
        )


def read_design(text: str, controller: str) -> dict[str, float]:
    """Read a design of a controller. Names of choices become their indices."""
    if controller not in CONTROLLERS:
        raise InvalidRequest(
            f"unknown controller {controller!r}; known are {', '.join(CONTROLLERS)}",
            field="controller",
        )
    known = CONTROLLERS[controller]
    values: dict[str, Any]
    if text.startswith("published:"):
        name = text.removeprefix("published:")
        if name not in known.published:
            raise InvalidRequest(
                f"no published design {name!r} of {controller}; known are"
                f" {', '.join(known.published)}",
                field="design",
            )
        values = dict(known.published[name])
    else:
        try:
            values = json.loads(text if text.lstrip().startswith("{") else Path(text).read_text())
        except (OSError, ValueError) as error:
            raise InvalidRequest(f"cannot read {text}: {error}", field="design") from error
        # `gaitswarm best --json` prints an object with the values under "design".
        values = values.get("design", values)
    choices = {v.name: v for v in (*known.variables, *known.conventions) if v.choices}
    return {n: choices[n].number(v) if n in choices else float(v) for n, v in values.items()}
