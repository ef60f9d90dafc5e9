"""What every job is asked to do, and what its designs are worth.

Spec
├── JobSpec              (kind `tuning`) a drive is tuned to walk well
└── IdentificationSpec   (kind `identification`) a robot's parameters are fitted to measured walks
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from services.optimizer.jobs.design_space import DesignSpace
from services.optimizer.search.optimizer import Optimizer
from services.optimizer.search.pso import ParticleSwarm, PsoSettings
from sim.case import Case
from sim.identification.recorded_walk import Recordings
from sim.outcome import Objective, Outcome, Status
from sim.robot import RobotSource
from sim.variables import VariableChoice, VariableName

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """n designs after K cases; both to be minimized.

    fitness: (n,), +inf where a case failed; log_utilities: (n, K), logarithm of what a design is
    worth in each case, +inf where it failed.
    """

    fitness: Floats
    log_utilities: Floats

    @property
    def utilities(self) -> Floats:
        """(n, K), +inf where the case failed or the number is too great."""
        rows = [[exponential(u) for u in row] for row in self.log_utilities.tolist()]
        return np.array(rows, dtype=np.float64).reshape(self.log_utilities.shape)


def exponential(logarithm: float) -> float:
    """Its exponential, +inf where a double ends. Of Python's math: the same bits on any CPU."""
    try:
        return math.exp(logarithm)
    except OverflowError:
        return math.inf


class Spec(BaseModel):
    """An optimization: of which variables, for which robot, how long, from which seed."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    schema_version: Literal[1] = Field(default=1, description="Version of this schema.")
    name: str = Field(default="", max_length=200, description="For people; need not be unique.")
    robot: RobotSource = Field(
        default="szabadka2",
        description="Robot to simulate, by name, or a variant with another law of friction or with"
        " backlash, or the text of the files of your own.",
    )
    variables: tuple[VariableChoice, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=128,
        description="What the optimizer may choose: names (with the catalogue's bounds) or"
        " variables with bounds of your own. Default: all that the job needs, less `fixed`.",
    )
    fixed: dict[VariableName, FiniteFloat] = Field(
        default_factory=dict, description="Variables held at one value, by name."
    )
    optimizer: PsoSettings = Field(
        default_factory=PsoSettings, description="Search algorithm and its settings."
    )
    iterations: Annotated[int, Field(ge=1, le=1_000_000)] = Field(
        default=25, description="Budget: iterations to run (generations of the swarm)."
    )
    seed: int = Field(
        default=1, ge=0, lt=2**63, description="Source of all randomness; same seed, same bits."
    )

    @abstractmethod
    def design_space(self) -> DesignSpace:
        """The optimizer's variables and the fixed ones, checked against the catalogue."""

    @property
    @abstractmethod
    def objectives(self) -> tuple[Objective, ...]:
        """What is known of a design after one case: columns of its raw objectives."""

    @property
    @abstractmethod
    def case_names(self) -> tuple[str, ...]:
        """The cases that every design is put to, in order."""

    @abstractmethod
    def cases(self, recordings: Recordings) -> tuple[Case, ...]:
        """The cases themselves. recordings: those that the spec names."""

    @property
    def recording_ids(self) -> tuple[str, ...]:
        """Recordings that the cases need."""
        return ()

    @abstractmethod
    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Fitness from raw objectives (n, K, m); failed: (n, K), cases without a result."""

    @abstractmethod
    def resolved(self) -> Self:
        """The same job with every preset written out, so that it stays what it was when stored."""


def judge_outcomes(spec: Spec, outcomes: tuple[Outcome, ...]) -> Judgement:
    """Fitness of n designs from one outcome per case."""
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != Status.OK for outcome in outcomes], axis=1)
    return spec.judge(objectives, failed)


def create_optimizer(spec: Spec) -> Optimizer:
    """A fresh optimizer for the job, before its first ask."""
    space = spec.design_space()
    return ParticleSwarm(spec.optimizer, space.low, space.high, spec.iterations, spec.seed)
