"""`gaitswarm study controllers`: what the Fuzzy-PI gains on the PI when both are optimized."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Json, Precision, WorkerOptions, with_groups

if TYPE_CHECKING:
    from gaitswarm.cli.studies.controllers import Comparison, Runs


@with_groups
def controllers(
    *,
    chapters: Annotated[
        str, typer.Option(help="3: with the gait, by eq. 3.1; 4: in six scenarios, preference A.")
    ] = "3,4",
    robots: Annotated[
        str | None,
        typer.Option(help="Names or folders, separated by commas. Default: all that are shipped."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Runs of each controller.")] = 10,
    particles: Annotated[
        int | None, typer.Option(help="Designs of an iteration. Default: 40 in chapter 3, 25 in 4.")
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(help="Iterations of each run. Default: 70 in chapter 3, 25 in 4.")
    ] = None,
    optimizer: Annotated[str, typer.Option(help="pso-thesis or pso.")] = "pso-thesis",
    precision: Precision = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Optimize PI and Fuzzy-PI alike from several seeds, and compare them (thesis 3.4).

    Every run is a job of the database. What has been run before, by the same code, is not run
    again: a study that was stopped goes on where it was by the same command.
    """
    import json

    from gaitswarm.cli.inputs.robots import chosen_robot
    from gaitswarm.cli.output import note, print_text, stdout_console
    from gaitswarm.cli.studies.controllers import Budget, comparisons, study_document, study_table
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.sim.robot.variant import SHIPPED

    names = SHIPPED if robots is None else robots.split(",")
    chosen = [chapter.strip() for chapter in chapters.split(",")]
    if not set(chosen) <= {"3", "4"}:
        raise InvalidRequest(f"{chapters!r} is none of 3, 4 or 3,4", field="chapters")
    planned = comparisons(
        sorted({int(chapter) for chapter in chosen}),
        {name: chosen_robot(name) for name in names},
        Budget(seeds, particles, iterations, optimizer, precision or "double"),
    )
    found = _run(planned, workers)
    if as_json:
        print_text(json.dumps(study_document(found), indent=2))
        return
    stdout_console().print(study_table(found))
    note(
        "in the thesis +22 % (table 3.6, PSO-PS) and +20 % on average, both in chapter 3\n"
        "medians over the runs; gain: median of all ratios of a run to a run of the other;\n"
        "intervals of 95 % or more, by order statistics; F is maximized, f_G minimized"
    )


def _run(planned: list[Comparison], workers: WorkerOptions) -> list[Comparison]:
    """Run what has not been run before. Raises JobEnded, and KeyboardInterrupt if interrupted."""
    from dataclasses import replace

    from gaitswarm.cli.embedded import study_jobs

    with study_jobs(workers) as (_, run):

        def with_jobs(runs: Runs) -> Runs:
            return replace(runs, jobs=tuple(run(spec) for spec in runs.specs))

        return [replace(c, pi=with_jobs(c.pi), fuzzy=with_jobs(c.fuzzy)) for c in planned]
