"""What every job is asked to do, and what its designs are worth.

Spec
├── WalksSpec            designs walk through scenarios and are judged by a preference
│   ├── JobSpec          (kind `tuning`) a drive is tuned to walk well
│   └── CertificateSpec  (kind `certificate`) a design walks in many worlds that differ
├── IdentificationSpec   (kind `identification`) a robot's parameters are fitted to measured walks
└── CalibrationSpec      (kind `calibration`) robot and conventions are fitted to tables of results
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Annotated, ClassVar, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.judgement import Judgement, by_design
from gaitswarm.services.optimizer.jobs.optimizer_choice import OptimizerChoice
from gaitswarm.services.optimizer.jobs.start import EarlierJobs, StartChoice
from gaitswarm.services.optimizer.search.automatic import AutoSettings, chosen_method
from gaitswarm.services.optimizer.search.optimizer import Optimizer
from gaitswarm.services.optimizer.search.registry import (
    DEFAULT_METHOD,
    LONGEST_REPLAY,
    METHODS,
    OPTIMIZERS,
    OptimizerSettings,
    create_search,
)
from gaitswarm.sim.assembly import check_precision
from gaitswarm.sim.case import Case
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.identification.recorded_walk import RecordedWalk, Recordings
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Objective, Outcome
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotSource, load_robot
from gaitswarm.sim.variables import VariableChoice, VariableName, VariableValue

Floats = NDArray[np.float64]

DECISIVE: Final = 0.05
"""Distance from the best fitness, as a share of it, within which designs count as good as it."""


class Spec(BaseModel):
    """An optimization: of which variables, for which robot, how long, from which seed."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    unwalked: ClassVar[frozenset[str]] = frozenset(
        {
            "schema_version",
            "name",
            "variables",
            "fixed",
            "optimizer",
            "iterations",
            "seed",
            "start",
        }
    )
    """Fields on which no outcome of a given design depends."""

    searches: ClassVar[bool] = True
    """Whether designs are searched for, so that the best ones of another job are a start. Else they
    are drawn, and what is said of them holds for draws alone."""

    has_objective_vectors: ClassVar[bool] = False
    """Whether designs of this kind have objectives to trade, which `told` then gives."""

    schema_version: Literal[1] = Field(default=1, description="Version of this schema.")
    name: str = Field(default="", max_length=200, description="For people; need not be unique.")
    robot: RobotSource = Field(
        default=DEFAULT_ROBOT,
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
    fixed: dict[VariableName, VariableValue] = Field(
        default_factory=dict,
        description="Variables held at one value, by name; a categorical one at a choice's name or"
        " index.",
        examples=[{"FOMF": 2, "stride": 0.15}],
    )
    optimizer: OptimizerChoice = Field(
        default=OPTIMIZERS[DEFAULT_METHOD],
        description="Search method and its settings: a name (see /v1/optimizers), or settings of"
        " your own.",
    )
    iterations: Annotated[int, Field(ge=1, le=1_000_000)] = Field(
        default=25,
        description="Budget: `particles` of the optimizer times this many designs are judged. A"
        " method that asks for fewer at once takes more iterations for them.",
    )
    seed: int = Field(
        default=1, ge=0, lt=2**63, description="Source of all randomness; same seed, same bits."
    )
    start: StartChoice = Field(
        default=(),
        description="Designs that are judged first, and that the search begins with if its method"
        " can: a list of them, or the best of earlier jobs, which are looked up when the job is"
        " submitted. They count as part of the budget.",
        examples=[{"jobs": ["k2q7zr5dm9xw"], "count": 5}],
    )
    precision: Precision = Field(
        default="double",
        description="Of the numbers of the search's physics: `double`, or `single`, which is about"
        " twice as fast and needs a C compiler. What is reported as best is judged in double.",
    )

    @property
    def budget(self) -> int:
        """Designs that the job judges in all."""
        return self.iterations * self.optimizer.particles

    def with_budget(self, iterations: int) -> Self:
        """The same job with another budget.

        Args:
            iterations: Of the budget, of `particles` designs each.

        Returns:
            The spec of a job that was extended to it.
        """
        return self.model_copy(update={"iterations": iterations})

    @property
    def search(self) -> OptimizerSettings:
        """Settings of the method that searches; of `auto`, those of the method that it chooses."""
        if isinstance(self.optimizer, AutoSettings):
            return chosen_method(self.optimizer, self.design_space().box, self.budget)
        return self.optimizer

    @model_validator(mode="after")
    def _can_be_resumed(self) -> Self:
        name = self.optimizer.name
        if name != "auto" and METHODS[name].replays and self.budget > LONGEST_REPLAY:
            raise ValueError(
                f"iterations: {name} is replayed when a job is resumed, and so"
                f" judges {LONGEST_REPLAY} designs at most, not {self.budget}"
            )
        return self

    @model_validator(mode="after")
    def _can_be_told(self) -> Self:
        name = self.optimizer.name
        if name != "auto" and METHODS[name].multi_objective and not self.has_objective_vectors:
            raise ValueError(
                f"optimizer: {name} is multi-objective, and designs of this kind of job have no"
                " objectives to trade; choose another method"
            )
        return self

    @model_validator(mode="after")
    def _can_start(self) -> Self:
        self.start_positions()
        return self

    def start_positions(self) -> Floats:
        """Where the search begins.

        Returns:
            (k, d) positions; none while earlier jobs are named that were not looked up yet.

        Raises:
            ValueError: A start design is none of this job, or there are more than its budget; names
                the design and the variable. A spec that was validated raises nothing.
        """
        if isinstance(self.start, EarlierJobs) or not self.start:
            return np.empty((0, 0))
        if len(self.start) > self.budget:
            raise ValueError(
                f"start: {len(self.start)} designs are more than the budget of {self.budget}; give"
                " fewer, or more iterations"
            )
        space = self.design_space()
        try:
            return space.positions(self.start)
        except ValueError as error:
            raise ValueError(f"start.{error}") from error

    def create_search(self) -> Optimizer:
        """What asks for the job's designs, before its first ask."""
        box, start = self.design_space().box, self.start_positions()
        return create_search(self.search, box, self.budget, self.seed, start)

    @abstractmethod
    def design_space(self) -> DesignSpace:
        """The variables that are searched and the fixed ones, checked against the catalogue.

        Raises:
            ValueError: the choice makes no sense; names the variable. A spec that was validated
                raises nothing.
        """

    @abstractmethod
    def check_can_be_simulated(self) -> None:
        """Check what only the simulator can tell: whether designs can be run at all.

        Raises:
            InvalidRequest: bounds or values that nothing can run with, or a precision that this
                machine has not; names the field.
        """

    def check_precision(self) -> None:
        """Check that this machine has the precision.

        Raises:
            InvalidRequest: It has no compiled kernel; its field is `precision`.
        """
        try:
            for robot in self.described:
                check_precision(load_robot(robot), self.precision)
        except SimulationInputError as error:
            text = str(error).removeprefix("precision: ")
            raise InvalidRequest(text, field="precision") from error

    def check_optimizer(self) -> None:
        """Check that what the search method needs is installed here.

        Raises:
            InvalidRequest: A library is missing; its field is `optimizer`.
        """
        method = METHODS[self.search.name]
        if method.missing:
            raise InvalidRequest(
                f"{self.search.name} needs {', '.join(method.missing)}, not installed here:"
                f" {method.remedy}",
                field="optimizer",
            )

    def check_recordings(self, find: Callable[[str], RecordedWalk]) -> None:
        """Check that each recording is of the robot's joints and of a gait that its legs reach.

        Args:
            find: A recording's id -> the recorded walk; raises NotFound where there is none.

        Raises:
            InvalidRequest: A recording that cannot be fitted to; names its place in `recordings`.
        """
        joints = load_robot(self.robot).joint_names if self.recording_ids else ()
        for index, name in enumerate(self.recording_ids):
            field = f"recordings.{index}"
            try:
                walk = find(name)
                if walk.joints != joints:
                    raise InvalidRequest("recorded on other joints than the robot's", field=field)
                walk.check_reach(self.robot)
            except (NotFound, SimulationInputError) as error:
                raise InvalidRequest(str(error), field=field) from error

    @property
    @abstractmethod
    def objectives(self) -> tuple[Objective, ...]:
        """What is known of a design after one case: the m columns of its raw objectives."""

    @property
    @abstractmethod
    def case_names(self) -> tuple[str, ...]:
        """Names of the K cases that every design is put to, in order."""

    @abstractmethod
    def cases(self, recordings: Recordings) -> tuple[Case, ...]:
        """The cases that every design is put to.

        Args:
            recordings: those that `recording_ids` names, by id.

        Returns:
            K cases, in the order of `case_names`.
        """

    @property
    def search_libraries(self) -> dict[str, str]:
        """Versions of the libraries that the search computes with here, by name."""
        return METHODS[self.search.name].versions()

    @property
    def further_libraries(self) -> tuple[str, ...]:
        """Distributions that its walks compute with beside those of all walks."""
        return ()

    @property
    def described(self) -> tuple[RobotSource, ...]:
        """The robots that may walk, as they are described; `robot` alone for most kinds."""
        return (self.robot,)

    @property
    def recording_ids(self) -> tuple[str, ...]:
        """Ids of the recorded walks that the cases need."""
        return ()

    @abstractmethod
    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Say what designs are worth.

        Args:
            objectives: (n, K, m) raw objectives, in their units.
            failed: (n, K), true for a case without a result.

        Returns:
            Fitness and utilities of the n designs.
        """

    def told(self, objectives: Floats, failed: NDArray[np.bool_], fitness: Floats) -> Floats:
        """What the search is told of designs. It follows from what is stored of them.

        Args:
            objectives: (n, K, m) raw objectives, in their units; what is not finite may be NaN.
            failed: (n, K), true for a case without a result.
            fitness: (n,) as `judge` has it.

        Returns:
            The fitness; of a multi-objective method (n, M) objective vectors.
        """
        del objectives, failed  # Of use to kinds that have objective vectors.
        return fitness

    def figure_of_merit(self, fitness: float) -> float | None:  # noqa: ARG002 - kinds may have one
        """What a fitness is in a figure that is maximized, where the job has one.

        Args:
            fitness: of a design, minimized.

        Returns:
            The figure, None for a job that has none.
        """
        return None

    def as_good_as(self, fitness: float) -> float:
        """What may be worse than the best and still count as evidence that it is as good.

        Args:
            fitness: the best one.

        Returns:
            The greatest fitness of a design that counts as good as the best.
        """
        return fitness * (1.0 + DECISIVE)

    def in_double(self) -> Self:
        """The same job in double precision, in which its best design is judged."""
        return self.model_copy(update={"precision": "double"})

    @abstractmethod
    def resolved(self) -> Self:
        """The same job with presets written out, so that it stays what it was when they change.

        Scenarios, preference, variables and an `auto` optimizer are; robot and controller are not.
        """


def judge_outcomes(spec: Spec, outcomes: tuple[Outcome, ...]) -> Judgement:
    """Judge designs by what the simulator says of them."""
    return spec.judge(*by_design(outcomes))


def create_optimizer(spec: Spec) -> Optimizer:
    """Create the optimizer that a job asks for."""
    return spec.create_search()
