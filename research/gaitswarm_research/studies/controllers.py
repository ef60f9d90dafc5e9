"""PI against Fuzzy-PI, each optimized alike (thesis 3.4)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.table import Table

from gaitswarm import InvalidRequest, JobSpec, JobView, job_spec
from gaitswarm_research import options
from gaitswarm_research.medians import (
    MedianInterval,
    cells,
    median_interval,
    median_ratio,
    percent_change,
)

THESIS: Final = {"chapter": 3, "gain_pso_ps": 6.887 / 5.644 - 1.0, "gain_average": 0.20}
"""Gain of F of the Fuzzy-PI over that of the PI: table 3.6, and Thesis 5."""

CHAPTERS: Final[Mapping[int, Mapping[str, Any]]] = {
    3: {
        "controllers": ("pi", "fuzzy-pi-3"),
        "scenarios": ("straight",),
        "preference": "chapter-3",
        "particles": 40,
        "iterations": 70,
    },
    4: {
        "controllers": ("pi", "fuzzy-pi"),
        "scenarios": ("1", "2", "3", "4", "5", "6"),
        "preference": "A",
        "particles": 25,
        "iterations": 25,
    },
}
"""Jobs of the thesis: chapter 3 optimized controller and gait, chapter 4 the controller."""

ROBOTS: Final = ("szabadka2", "szabadka2-identified", "szabadka2-reconstructed")


@dataclass(frozen=True, slots=True)
class Runs:
    """Jobs of one controller, one for each seed.

    Attributes:
        jobs: Finished jobs in the order of `specs`; empty before they have run.
    """

    controller: str
    specs: tuple[JobSpec, ...]
    jobs: tuple[JobView, ...] = ()

    @property
    def fitness(self) -> list[float]:
        """Least fitness of every job that found a design that walks."""
        found = [job.best_fitness for job in self.jobs]
        return [fitness for fitness in found if fitness is not None]

    @property
    def quantity(self) -> str:
        """Quantity of `values`: F of eq. 3.1, to be maximized, or the fitness f_G."""
        return "f_G" if self.specs[0].figure_of_merit(1.0) is None else "F"

    @property
    def values(self) -> list[float]:
        """F or f_G of every job."""
        return [self.specs[0].figure_of_merit(fitness) or fitness for fitness in self.fitness]


@dataclass(frozen=True, slots=True)
class Comparison:
    """PI and Fuzzy-PI of one chapter on one robot."""

    chapter: int
    robot: str
    pi: Runs
    fuzzy: Runs

    @property
    def ratio(self) -> MedianInterval | None:
        """Fitness of the PI over that of the Fuzzy-PI: how many times better the latter is."""
        if not self.pi.fitness or not self.fuzzy.fitness:
            return None
        return median_ratio(self.pi.fitness, self.fuzzy.fitness)


def comparisons(
    chapters: Sequence[int],
    robots: Sequence[str],
    seeds: int,
    **budget: Any,
) -> list[Comparison]:
    """Plan the study's jobs.

    budget: fields of the jobs in place of the chapter's.
    """
    return [
        Comparison(chapter, robot, *(_runs(chapter, c, robot, seeds, budget) for c in controllers))
        for chapter in chapters
        for controllers in [CHAPTERS[chapter]["controllers"]]
        for robot in robots
    ]


def _runs(chapter: int, controller: str, robot: str, seeds: int, budget: Mapping[str, Any]) -> Runs:
    fields = {**CHAPTERS[chapter], **budget, "controller": controller, "robot": robot}
    del fields["controllers"]
    specs = []
    for seed in range(1, seeds + 1):
        name = f"study of controllers: chapter {chapter}, {controller}, {robot}, seed {seed}"
        spec = job_spec(**fields, name=name[:200], seed=seed)
        specs.append(spec.with_gait_searched() if chapter == 3 else spec)
    return Runs(controller, tuple(specs))


def study_document(found: Sequence[Comparison]) -> dict[str, Any]:
    """The study as a JSON document."""
    return {
        "thesis": THESIS,
        "comparisons": [
            {
                "chapter": comparison.chapter,
                "robot": comparison.robot,
                "quantity": comparison.pi.quantity,
                "pi": _runs_document(comparison.pi),
                "fuzzy": _runs_document(comparison.fuzzy),
                "ratio": None if comparison.ratio is None else asdict(comparison.ratio),
            }
            for comparison in found
        ],
    }


def _runs_document(runs: Runs) -> dict[str, Any]:
    return {
        "controller": runs.controller,
        "jobs": [job.id for job in runs.jobs],
        "values": runs.values,
        **(asdict(median_interval(runs.values)) if runs.values else {"median": None}),
    }


def study_table(found: Sequence[Comparison]) -> Table:
    """Three rows for every chapter and robot: both controllers' medians, and the gain."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for column in ("chapter", "robot", "controller"):
        table.add_column(column, no_wrap=True)
    for column in ("runs", "median", "interval"):
        table.add_column(column, justify="right", no_wrap=True)
    for comparison in found:
        place = (f"{comparison.chapter} ({comparison.pi.quantity})", comparison.robot)
        for runs in (comparison.pi, comparison.fuzzy):
            interval = median_interval(runs.values) if runs.values else None
            numbers = cells(interval, "{:.4g}".format)
            table.add_row(*place, runs.controller, str(len(runs.values)), *numbers)
            place = ("", "")
        gain = cells(comparison.ratio, percent_change)
        table.add_row(*place, "gain", "", *gain, style="bold")
    return table


def controllers(
    *,
    chapters: Annotated[
        str, typer.Option(help="3: with the gait, by eq. 3.1; 4: in six scenarios, preference A.")
    ] = "3,4",
    robots: Annotated[
        str, typer.Option(help="Names or folders of robots, separated by commas.")
    ] = ",".join(ROBOTS),
    seeds: Annotated[int, typer.Option(min=1, max=100, help="Runs of each controller.")] = 10,
    particles: Annotated[
        int | None, typer.Option(help="Designs per iteration. Default: 40 in chapter 3, 25 in 4.")
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(help="Iterations per run. Default: 70 in chapter 3, 25 in 4.")
    ] = None,
    optimizer: Annotated[str, typer.Option(help="pso or pso-falling-inertia.")] = "pso",
    precision: Annotated[
        str, typer.Option(help="Precision of the simulations: single or double.")
    ] = "double",
    db: options.Db = None,
    cpus: options.Cpus = None,
    ray_address: options.RayAddress = None,
    as_json: options.Json = False,
) -> None:
    """Optimize PI and Fuzzy-PI alike from several seeds, and compare them (thesis 3.4).

    Every run is a job of the database. Jobs that the same code ran before are reused, so the same
    command resumes an interrupted study.
    """
    chosen = {chapter.strip() for chapter in chapters.split(",")}
    if not chosen <= {"3", "4"}:
        raise InvalidRequest(f"{chapters!r} is none of 3, 4 or 3,4", field="chapters")
    budget = {"particles": particles, "iterations": iterations}
    planned = comparisons(
        sorted(map(int, chosen)),
        robots.split(","),
        seeds,
        optimizer=optimizer,
        precision=precision,
        **{name: value for name, value in budget.items() if value is not None},
    )

    def with_jobs(runs: Runs) -> Runs:
        jobs = [options.run_job(s, db=db, cpus=cpus, ray_address=ray_address) for s in runs.specs]
        return Runs(runs.controller, runs.specs, tuple(result.job for result in jobs))

    found = [Comparison(c.chapter, c.robot, with_jobs(c.pi), with_jobs(c.fuzzy)) for c in planned]
    if as_json:
        typer.echo(json.dumps(study_document(found), indent=2))
        return
    Console().print(study_table(found))
    options.stderr.print(
        "in the thesis +22 % (table 3.6, PSO-PS) and +20 % on average, both in chapter 3\n"
        "medians over the runs; gain: median of all ratios of a run to a run of the other;\n"
        "intervals of 95 % or more, by order statistics; F is maximized, f_G minimized"
    )
