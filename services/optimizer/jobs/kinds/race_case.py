"""Runs of a search method on a problem, as they are sent to a worker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.kinds.problem import FunctionProblem, TuningProblem
from gaitswarm.services.optimizer.jobs.provenance import optimizer_digest
from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.tournament.methods import drawn_settings, search_of
from gaitswarm.services.optimizer.tournament.race import Stop, Terms, race
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Objective, Outcome, Status
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.variables import Variable

Floats = NDArray[np.float64]

SEED: Final = Variable(
    name="seed",
    low=0.0,
    high=2.0**31 - 1.0,
    kind="integer",
    description="Of the run's random numbers.",
)


@dataclass(frozen=True, slots=True)
class RaceCase:
    """Runs of a method on a problem, as they are sent to a worker.

    Attributes:
        problem: That is to be solved.
        method: Settings, before what is drawn.
        terms: What each run is given.
        variables: Columns of the designs.
        robots: Of all problems of the job, on which its provenance depends.
        objectives: Columns of its outcomes' objectives.
        digest: Of the code of search and judgement that the job was begun with.
    """

    problem: FunctionProblem | TuningProblem
    method: SearchSettings
    terms: Terms
    variables: tuple[str, ...]
    robots: tuple[RobotSource, ...]
    objectives: tuple[Objective, ...]
    digest: str

    @property
    def name(self) -> str:
        """That of the problem."""
        return self.problem.name

    @property
    def precision(self) -> Precision:
        """Of what is reported."""
        return "double"

    @property
    def duration(self) -> float:
        """Simulated time of one run [s]."""
        return self.terms.evaluations * self.problem.duration

    def run(self, designs: Floats) -> Outcome:
        """Run the method with each design's settings and seed."""
        return self.run_until(designs, lambda: False)

    def run_until(self, designs: Floats, should_stop: Stop) -> Outcome:
        """As `run`, unless nobody waits for it any more."""
        if optimizer_digest() != self.digest:
            raise SimulationError(
                "this worker has other code of search and judgement than the job was begun with;"
                " give all workers the same gaitswarm, and resume the job"
            )
        rows = []
        for values in designs.tolist():
            settings, seed = settings_of_run(self.method, self.variables, values)
            run = race(search_of(settings), self.problem, self.terms, seed, should_stop)
            rows.append([*run.best.tolist(), run.to_best, run.to_target])
        objectives = np.array(rows).reshape(len(rows), len(self.objectives))
        return Outcome(objectives, np.full(len(rows), Status.OK, dtype=np.uint8))


def settings_of_run(
    method: SearchSettings, names: tuple[str, ...], values: list[float]
) -> tuple[SearchSettings, int]:
    """Settings and seed of the run that a design stands for."""
    drawn = dict(zip(names, values, strict=True))
    seed = int(drawn.pop(SEED.name))
    return drawn_settings(method, drawn), seed
