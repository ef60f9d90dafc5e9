"""What is raced: plans by name, each with a file of its own for its runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Final

from gaitswarm.cli.tournament.plan import Size, tournament_jobs
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec

CHECKPOINTS: Final = (25, 50, 100, 250, 625, 1250, 2500, 5000)
"""Evaluations after which the best so far is kept, as far as the budget reaches."""

SEED: Final = 1
"""From which the seeds of all runs are drawn: run k has the same one in every method and plan."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Methods that run as often on the same problems.

    Attributes:
        methods: Names, each with its default settings.
        problems: Names, as of `gaitswarm tournament`.
        repetitions: Runs of each method on each problem.
        evaluations: Budget of a run; one of `CHECKPOINTS`.
    """

    methods: tuple[str, ...]
    problems: tuple[str, ...]
    repetitions: int
    evaluations: int

    def runs(self) -> Iterator[tuple[int, str, str]]:
        """(repetition, problem, method); the first of all before the second of one."""
        return product(range(self.repetitions), self.problems, self.methods)

    def spec(self, method: str, problem: str) -> TournamentSpec:
        """The job of all runs of a method on a problem: those that `gaitswarm tournament` runs."""
        size = Size(self.repetitions, self.evaluations, SEED, "default")
        spec = tournament_jobs({method: method}, [problem], size, "single")[method]
        kept = tuple(count for count in CHECKPOINTS if count <= self.evaluations)
        return spec.model_copy(update={"checkpoints": kept}).resolved()


ROBOT: Final = ("chapter-4.A", "chapter-4.B", "chapter-4.C")
CHAPTER_3: Final = ("chapter-3.pi", "chapter-3.fuzzy-pi")
BETWEEN: Final = ("chapter-3.fuzzy-pi-fixed-gait", "chapter-4.A-straight", "chapter-4.A-gait")
FUNCTION: Final = ("D7C0R0I1",)
GLOBALS: Final = ("global-unirandi", "global-nelder-mead", "global-bfgs")
ANCHORS: Final = ("cma-es", "pso", "pso-thesis", "random")
LOCAL: Final = ("dts", "nelder-mead", "sa", *GLOBALS)
OTHERS: Final = ("pso-ps", "ps", "tlbo", "de", "ga", "gsa", "mads")

PLANS: Final = {
    "chapter-4-anchors": Plan(ANCHORS, ROBOT, 5, 625),
    "chapter-4-local": Plan(LOCAL, ROBOT, 5, 625),
    "chapter-4-default": Plan(("cma-es",), ROBOT, 20, 625),
    "chapter-4-others": Plan(OTHERS, ROBOT, 5, 625),
    "chapter-4-rivals": Plan(("pymoo-pso", "cma", "scipy-de", "optuna-cma-es"), ROBOT, 5, 625),
    "chapter-4-tpe": Plan(("optuna-tpe",), ROBOT, 20, 625),
    "chapter-4-bayesian": Plan(("bayesian",), ROBOT, 3, 625),
    "chapter-4-long": Plan(
        ("cma-es", "de", "pso-ps", "tlbo", "pso-thesis", "pymoo-pso"), ROBOT, 20, 2500
    ),
    "chapter-4-long-rivals": Plan(("cma", "scipy-de"), ROBOT, 20, 2500),
    "chapter-4-long-optuna": Plan(("optuna-cma-es",), ROBOT, 20, 2500),
    "chapter-4-long-tpe": Plan(("optuna-tpe",), ROBOT, 20, 2500),
    "chapter-3": Plan(("cma-es", "de", "pso-ps", "pso-thesis", "tlbo"), CHAPTER_3, 20, 625),
    "between": Plan(("cma-es", "de"), BETWEEN, 20, 625),
    "function": Plan(
        (*ANCHORS, *LOCAL, *OTHERS, "pymoo-pso", "scipy-de", "cma"), FUNCTION, 100, 5000
    ),
    "function-slow": Plan(("optuna-cma-es",), FUNCTION, 5, 5000),
}
"""Methods that compute for long themselves have plans of their own."""
