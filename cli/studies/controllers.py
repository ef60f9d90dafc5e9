"""PI against Fuzzy-PI, each optimized alike (thesis 3.4): jobs, table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.services.optimizer.analysis.statistics import (
    MedianInterval,
    median_interval,
    median_ratio,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.optimizer_choice import with_settings
from gaitswarm.services.optimizer.jobs.preference import figure_of_merit

if TYPE_CHECKING:
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.services.optimizer.jobs.job import Job

THESIS: Final = {"chapter": 3, "gain_pso_ps": 6.887 / 5.644 - 1.0, "gain_average": 0.20}
"""How much greater F of the Fuzzy-PI is than that of the PI: table 3.6, and Thesis 5."""

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
"""What the thesis optimized: in chapter 3 controller and gait, in chapter 4 the controller."""


@dataclass(frozen=True, slots=True)
class Budget:
    """How much every controller is given; None leaves the chapter's.

    Attributes:
        seeds: number of runs, whose seeds count from 1.
        particles: designs of an iteration, at most.
        iterations: of the budget.
        optimizer: name of the search's preset.
        precision: of the searches; their best designs are judged in double.
    """

    seeds: int
    particles: int | None
    iterations: int | None
    optimizer: str
    precision: str = "double"


@dataclass(frozen=True, slots=True)
class Runs:
    """One controller's runs.

    Attributes:
        controller: its name.
        specs: of the jobs, one by seed.
        jobs: those that were run, in the same order; none before.
    """

    controller: str
    specs: tuple[JobSpec, ...]
    jobs: tuple[Job, ...] = ()

    @property
    def fitness(self) -> list[float]:
        """Least fitness of every job that has found a design that walks."""
        found = [job.progress.best_fitness for job in self.jobs]
        return [fitness for fitness in found if fitness is not None]

    @property
    def quantity(self) -> str:
        """What `values` are."""
        return "F" if self.specs[0].figure_of_merit(1.0) is not None else "f_G"

    @property
    def values(self) -> list[float]:
        """F of eq. 3.1 of every job, to be maximized, or its fitness f_G, to be minimized."""
        preference = self.specs[0].resolved_preference()
        return [figure_of_merit(fitness, preference) or fitness for fitness in self.fitness]


@dataclass(frozen=True, slots=True)
class Comparison:
    """PI and Fuzzy-PI of one chapter on one robot.

    Attributes:
        chapter: of the thesis.
        robot: name of the robot that walks.
        pi: the runs of the PI.
        fuzzy: the runs of the Fuzzy-PI.
    """

    chapter: int
    robot: str
    pi: Runs
    fuzzy: Runs

    @property
    def ratio(self) -> MedianInterval | None:
        """How many times better the Fuzzy-PI is: fitness of the PI over its own, or F over F."""
        if not self.pi.fitness or not self.fuzzy.fitness:
            return None
        return median_ratio(self.pi.fitness, self.fuzzy.fitness)


def comparisons(
    chapters: Iterable[int], robots: Mapping[str, Any], budget: Budget
) -> list[Comparison]:
    """The study's jobs, none of them run yet."""
    return [
        Comparison(chapter, name, *(_runs(chapter, c, name, robot, budget) for c in controllers))
        for chapter in chapters
        for controllers in [CHAPTERS[chapter]["controllers"]]
        for name, robot in robots.items()
    ]


def _runs(chapter: int, controller: str, name: str, robot: object, budget: Budget) -> Runs:
    from pydantic import ValidationError

    from gaitswarm.errors import invalid_request

    study = CHAPTERS[chapter]
    particles, iterations = (
        study[field] if given is None else given
        for field, given in (("particles", budget.particles), ("iterations", budget.iterations))
    )
    document = {
        "robot": robot,
        "controller": controller,
        "scenarios": study["scenarios"],
        "preference": study["preference"],
        "optimizer": with_settings(budget.optimizer, {"particles": particles}),
        "iterations": iterations,
        "precision": budget.precision,
    }
    specs = []
    for seed in range(1, budget.seeds + 1):
        title = f"study of controllers: chapter {chapter}, {controller}, {name}, seed {seed}"
        try:
            spec = JobSpec.model_validate({**document, "name": title[:200], "seed": seed})
        except ValidationError as error:
            raise invalid_request(error) from error
        specs.append(spec.with_gait_searched() if chapter == 3 else spec)
    return Runs(controller, tuple(specs))


def study_document(found: Sequence[Comparison]) -> dict[str, Any]:
    """The study as JSON has it."""
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
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import interval_cells, number, relative_change

    table = Table(box=None, header_style="bold", pad_edge=False)
    for column in ("chapter", "robot", "controller"):
        table.add_column(column, no_wrap=True)
    for column in ("runs", "median", "interval"):
        table.add_column(column, justify="right", no_wrap=True)
    for comparison in found:
        place = (f"{comparison.chapter} ({comparison.pi.quantity})", comparison.robot)
        for runs in (comparison.pi, comparison.fuzzy):
            interval = median_interval(runs.values) if runs.values else None
            cells = interval_cells(interval, number)
            table.add_row(*place, runs.controller, str(len(runs.values)), *cells)
            place = ("", "")
        table.add_row(
            *place, "gain", "", *interval_cells(comparison.ratio, relative_change), style="bold"
        )
    return table
