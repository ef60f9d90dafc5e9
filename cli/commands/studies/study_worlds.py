"""`gaitswarm study worlds`: what a search in worlds gains where the model is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Json, RobotOption, WorkerOptions, with_groups

if TYPE_CHECKING:
    from gaitswarm.cli.studies.worlds import Contestant, HeldOut


@with_groups
def worlds(
    *,
    preference: Annotated[
        str | None,
        typer.Option(help="A, B, C or chapter-3 [default: that of the robot's folder, else A]."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Runs of each search.")] = 10,
    worlds: Annotated[
        str,
        typer.Option(
            metavar="N,...", help="In how many worlds a search judges a design; each is tried."
        ),
    ] = "8",
    aggregate: Annotated[
        str,
        typer.Option(
            metavar="NAME,...",
            help="What utilities in all worlds come to: mean, quantile, worst or cvar; each is"
            " tried.",
        ),
    ] = "cvar",
    level: Annotated[float, typer.Option(help="Where a quantile or the tail of cvar begins.")] = (
        0.75
    ),
    held_out: Annotated[
        int, typer.Option(min=1, max=100_000, help="Worlds in which the best designs are judged.")
    ] = 1000,
    held_out_seed: Annotated[
        int, typer.Option(min=0, help="Of these worlds. Searches in worlds have seeds from 1 on.")
    ] = 0,
    optimizer: Annotated[
        str | None, typer.Option(help="Search method or preset. Default: that of all jobs.")
    ] = None,
    particles: Annotated[int, typer.Option(help="Designs of an iteration, at most.")] = 25,
    iterations: Annotated[int, typer.Option(help="Iterations of each search.")] = 25,
    precision: Annotated[
        str,
        typer.Option(
            metavar="single|double",
            help="Of the searches' walks; what they found is judged in double.",
        ),
    ] = "single",
    robot: RobotOption = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Search with and without worlds from several seeds, and judge the results in held-out worlds.

    Every run is a job of the database, and so is the certificate of its best design. What has been
    run before, by the same code, is not run again: a study that was stopped goes on where it was by
    the same command.
    """
    import json

    from gaitswarm.cli.inputs.robots import chosen_robot, robot_defaults
    from gaitswarm.cli.output import note, print_text, stdout_console
    from gaitswarm.cli.studies.worlds import (
        HeldOut,
        check_held_out,
        contestants,
        runs_table,
        study_document,
        study_table,
    )
    from gaitswarm.services.optimizer.analysis.statistics import CONFIDENCE
    from gaitswarm.services.optimizer.search.registry import DEFAULT_METHOD

    judged_in = HeldOut(held_out, held_out_seed)
    check_held_out(judged_in, seeds)
    defaults = robot_defaults(robot)
    planned = contestants(
        {
            **defaults.document,
            "robot": chosen_robot(robot),
            "preference": preference or defaults.preference,
            "optimizer": optimizer or DEFAULT_METHOD,
            "particles": particles,
            "iterations": iterations,
            "precision": precision,
        },
        counts=_counts(worlds),
        aggregates=[name.strip() for name in aggregate.split(",")],
        level=level,
        seeds=seeds,
    )
    found = _run(planned, judged_in, workers)
    if as_json:
        print_text(json.dumps(study_document(found, judged_in), indent=2))
        return
    console = stdout_console()
    console.print(study_table(found))
    console.print(runs_table(found))
    note(
        f"judged in {held_out} held-out worlds of seed {held_out_seed}, the same for all runs, in"
        " double precision; less is better\n"
        "in the model: fitness where nothing is wrong; failed, fell: worlds in which a walk did\n"
        "change: median of all ratios of a run to a run of the search without worlds\n"
        f"intervals of {100.0 * CONFIDENCE:g} % or more, by order statistics; of runs' failures"
        " exact (Clopper and Pearson)"
    )


def _counts(given: str) -> list[int]:
    from gaitswarm.services.optimizer.errors import InvalidRequest

    try:
        return [int(count) for count in given.split(",")]
    except ValueError:
        raise InvalidRequest(f"{given!r} are no whole numbers", field="worlds") from None


def _run(planned: list[Contestant], held_out: HeldOut, workers: WorkerOptions) -> list[Contestant]:
    """Run what has not been run before. Raises JobEnded, and KeyboardInterrupt if interrupted."""
    from dataclasses import replace

    from gaitswarm.cli.embedded import study_jobs
    from gaitswarm.cli.studies.worlds import Run, certificate_of

    with study_jobs(workers) as (jobs, run):

        def with_runs(contestant: Contestant) -> Contestant:
            runs = []
            for spec in contestant.specs:
                job = jobs.job(run(spec).id)
                if job.best is None:
                    continue
                certificate = run(certificate_of(spec, job.best.design, held_out))
                runs.append(Run(spec.seed, job.id, jobs.certificate(certificate.id)))
            return replace(contestant, runs=tuple(runs))

        return [with_runs(contestant) for contestant in planned]
