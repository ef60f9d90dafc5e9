"""Searches with and without worlds, and their best designs in held-out worlds."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.table import Table

import gaitswarm
from gaitswarm import CertificateSpec, CertificateView, InvalidRequest, JobSpec, job_spec
from gaitswarm_research import options
from gaitswarm_research.medians import (
    CONFIDENCE,
    MedianInterval,
    cells,
    median_interval,
    median_ratio,
    percent_change,
)


@dataclass(frozen=True, slots=True)
class Run:
    """Best design of one search: identifier of the job, and certificate in held-out worlds."""

    seed: int
    job: str
    certificate: CertificateView


@dataclass(frozen=True, slots=True)
class Contestant:
    """One way to search, from several seeds.

    Attributes:
        worlds: Worlds in which it judges designs, without their seed; None for the model alone.
        specs: Jobs, one for each seed.
        runs: Runs that found a design that walks; empty before they have run.
    """

    title: str
    worlds: Mapping[str, Any] | None
    specs: tuple[JobSpec, ...]
    runs: tuple[Run, ...] = ()

    def values(self, quantity: str) -> list[float] | None:
        """One of `QUANTITIES` by run; None without runs, or if a run has no such value."""
        values = [QUANTITIES[quantity](run.certificate) for run in self.runs]
        numbers = [value for value in values if value is not None]
        return numbers if numbers and len(numbers) == len(values) else None

    def median(self, quantity: str) -> MedianInterval | None:
        """Median of one of `QUANTITIES` over the runs."""
        values = self.values(quantity)
        return None if values is None else median_interval(values)

    def ratio(self, plain: Contestant, quantity: str) -> MedianInterval | None:
        """Ratio to the search without worlds."""
        values, reference = self.values(quantity), plain.values(quantity)
        if self is plain or quantity not in _RATIOS or values is None or reference is None:
            return None
        return median_ratio(values, reference)


QUANTITIES: Final[Mapping[str, Callable[[CertificateView], float | None]]] = {
    "nominal": lambda view: view.fitness.nominal,
    "median": lambda view: view.fitness.quantiles[2],
    "cvar": lambda view: view.fitness.cvar,
    "failed": lambda view: view.failed.count,
    "fell": lambda view: view.fell.count,
}
"""Quantities that runs are compared by: fitness in the nominal model, its median and conditional
value at risk over the held-out worlds, and the number of worlds in which a simulation failed or the
robot fell."""

_HEADS: Final = {
    "nominal": "in the model",
    "median": "median",
    "cvar": "CVaR 95 %",
    "failed": "failed",
    "fell": "fell",
}

_RATIOS: Final = ("nominal", "median", "cvar")
"""Quantities that are never zero."""


def contestants(
    common: Mapping[str, Any],
    *,
    counts: Sequence[int],
    aggregates: Sequence[str],
    level: float,
    seeds: int,
) -> list[Contestant]:
    """Plan the study's searches; the first is the one without worlds."""
    planned: list[tuple[str, dict[str, Any] | None]] = [("without worlds", None)]
    for count in counts:
        for aggregate in aggregates:
            worlds = {"count": count, "aggregate": aggregate, "level": level}
            planned.append((f"{aggregate} of {count}", worlds))
    return [
        Contestant(title, worlds, tuple(_specs(title, worlds, common, seeds)))
        for title, worlds in planned
    ]


def _specs(
    title: str, worlds: Mapping[str, Any] | None, common: Mapping[str, Any], seeds: int
) -> list[JobSpec]:
    specs = []
    for seed in range(1, seeds + 1):
        name = f"study of worlds: {title}, seed {seed}"
        of_seed = None if worlds is None else {**worlds, "seed": seed}
        specs.append(job_spec(**common, worlds=of_seed, seed=seed, name=name))
    return specs


def study_document(
    found: Sequence[Contestant], held_out: int, held_out_seed: int
) -> dict[str, Any]:
    """The study as a JSON document."""

    def interval(value: MedianInterval | None) -> dict[str, Any] | None:
        return None if value is None else asdict(value)

    return {
        "held_out": {"worlds": held_out, "seed": held_out_seed},
        "searches": [
            {
                "search": contestant.title,
                "worlds": contestant.worlds,
                "runs": [
                    {
                        "seed": run.seed,
                        "job": run.job,
                        "certificate": run.certificate.job,
                        "fitness": run.certificate.fitness.model_dump(mode="json"),
                        "failed": run.certificate.failed.model_dump(mode="json"),
                        "fell": run.certificate.fell.model_dump(mode="json"),
                    }
                    for run in contestant.runs
                ],
                "quantities": {
                    quantity: {
                        "of_runs": interval(contestant.median(quantity)),
                        "ratio": interval(contestant.ratio(found[0], quantity)),
                    }
                    for quantity in QUANTITIES
                },
            }
            for contestant in found
        ],
    }


def study_table(found: Sequence[Contestant]) -> Table:
    """Median over the runs of every search and quantity, and its change from the first search."""
    table = Table(
        title="Medians over the runs", title_justify="left", box=None, padding=(0, 1, 0, 0)
    )
    table.add_column("search", no_wrap=True)
    table.add_column("")
    for column in ("median", "interval", "change", "interval"):
        table.add_column(column, justify="right")
    for contestant in found:
        title = contestant.title
        for quantity, head in _HEADS.items():
            median, interval = cells(contestant.median(quantity), _number)
            tail_failed = any(run.certificate.fitness.tail_failed for run in contestant.runs)
            if quantity == "cvar" and tail_failed:
                median = f"> {median}"
            ratio = cells(contestant.ratio(found[0], quantity), percent_change)
            table.add_row(title, head, median, interval, *ratio)
            title = ""
    return table


def runs_table(found: Sequence[Contestant]) -> Table:
    """Every run, with the exact intervals of its chances of failure."""
    table = Table(title="Runs", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("search", no_wrap=True)
    for column in ("seed", "model", "median", "CVaR", "failed", "fell"):
        table.add_column(column, justify="right")
    for contestant in found:
        for run in contestant.runs:
            view = run.certificate
            cvar = _number(view.fitness.cvar)
            chances = [
                f"{p.count} ({100.0 * p.low:.2g} to {100.0 * p.high:.2g} %)"
                for p in (view.failed, view.fell)
            ]
            table.add_row(
                contestant.title,
                str(run.seed),
                _number(view.fitness.nominal),
                _number(view.fitness.quantiles[2]),
                f"> {cvar}" if view.fitness.tail_failed else cvar,
                *chances,
            )
    return table


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


def worlds(
    *,
    preference: Annotated[
        str | None,
        typer.Option(help="A, B, C or chapter-3. Default: that of the robot's folder, else A."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Runs of each search.")] = 10,
    worlds: Annotated[
        str,
        typer.Option(metavar="N,...", help="Numbers of worlds that searches judge designs in."),
    ] = "8",
    aggregate: Annotated[
        str, typer.Option(metavar="NAME,...", help="mean, quantile, worst or cvar over the worlds.")
    ] = "cvar",
    level: Annotated[
        float, typer.Option(help="Level at which a quantile or the tail of cvar begins.")
    ] = 0.75,
    held_out: Annotated[
        int, typer.Option(min=1, max=100_000, help="Worlds in which the best designs are judged.")
    ] = 1000,
    held_out_seed: Annotated[
        int, typer.Option(min=0, help="Seed of these worlds. Searches use seeds from 1 on.")
    ] = 0,
    optimizer: Annotated[str, typer.Option(help="Search method or preset.")] = "cma-es",
    particles: Annotated[int, typer.Option(help="Designs per iteration, at most.")] = 25,
    iterations: Annotated[int, typer.Option(help="Iterations of each search.")] = 25,
    precision: Annotated[
        str,
        typer.Option(
            metavar="single|double",
            help="Precision of the searches; their results are judged in double.",
        ),
    ] = "single",
    robot: options.Robot = None,
    db: options.Db = None,
    cpus: options.Cpus = None,
    ray_address: options.RayAddress = None,
    as_json: options.Json = False,
) -> None:
    """Search with and without worlds from several seeds, and judge the results in held-out worlds.

    Every run is a job of the database, and so is the certificate of its best design. Jobs that the
    same code ran before are reused, so the same command resumes an interrupted study.
    """
    if 1 <= held_out_seed <= seeds:
        raise InvalidRequest(
            f"{held_out_seed} is the seed of a search's worlds; take 0, or one above {seeds}",
            field="held-out-seed",
        )
    try:
        counts = [int(count) for count in worlds.split(",")]
    except ValueError:
        raise InvalidRequest(f"{worlds!r} is not a list of integers", field="worlds") from None
    common: dict[str, Any] = {
        "optimizer": optimizer,
        "particles": particles,
        "iterations": iterations,
        "precision": precision,
    }
    common |= {k: v for k, v in (("preference", preference), ("robot", robot)) if v is not None}
    planned = contestants(
        common,
        counts=counts,
        aggregates=[name.strip() for name in aggregate.split(",")],
        level=level,
        seeds=seeds,
    )

    def run_all(contestant: Contestant) -> Contestant:
        runs = []
        for spec in contestant.specs:
            job = options.run_job(spec, db=db, cpus=cpus, ray_address=ray_address).job
            if job.best is None:
                continue
            certificate = CertificateSpec.of_job(
                spec,
                job.best.design,
                name=f"certificate of {spec.name}",
                worlds=held_out,
                seed=held_out_seed,
            )
            judged = options.run_job(certificate, db=db, cpus=cpus, ray_address=ray_address).job
            with gaitswarm.open(db) as jobs:
                runs.append(Run(spec.seed, job.id, jobs.certificate(judged.id)))
        return Contestant(contestant.title, contestant.worlds, contestant.specs, tuple(runs))

    found = [run_all(contestant) for contestant in planned]
    if as_json:
        typer.echo(json.dumps(study_document(found, held_out, held_out_seed), indent=2))
        return
    console = Console()
    console.print(study_table(found))
    console.print(runs_table(found))
    options.stderr.print(
        f"judged in {held_out} held-out worlds of seed {held_out_seed}, the same for all runs, in"
        " double precision; less is better\n"
        "in the model: fitness in the nominal world; failed, fell: number of worlds\n"
        "change: median of all ratios of a run to a run of the search without worlds\n"
        f"intervals of {100.0 * CONFIDENCE:g} % or more, by order statistics; of runs' failures"
        " exact (Clopper and Pearson)"
    )
