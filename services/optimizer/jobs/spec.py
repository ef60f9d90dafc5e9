"""Specs of jobs: variables, robot, budget, seed and fitness

Spec
├── WalksSpec            designs are simulated in scenarios and judged by a preference
│   ├── JobSpec          (kind `tuning`) tunes a controller
│   └── CertificateSpec  (kind `certificate`) simulates a design in many perturbed models
├── IdentificationSpec   (kind `identification`) fits robot parameters to measured walks
├── CalibrationSpec      (kind `calibration`) fits robot and conventions to tables of results
└── PreferencesSpec      (kind `preferences`) judges preferences by the optima of a tuning job
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound, simulation_errors
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.preference import Judgement, by_design
from gaitswarm.services.optimizer.search.optimizer import Optimizer, SearchSettings
from gaitswarm.services.optimizer.search.registry import (
    DEFAULT_METHOD,
    LONGEST_REPLAY,
    METHODS,
    OPTIMIZERS,
    AutoSettings,
    OptimizerName,
    OptimizerSettings,
    chosen_method,
    create_search,
)
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import Line
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import Objective, Outcome
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotSource, load_robot
from gaitswarm.sim.variables import VariableChoice, VariableName, VariableValue

if TYPE_CHECKING:
    from gaitswarm.sim.case import Case
    from gaitswarm.sim.identification import RecordedWalk, Recordings


def optimizer_settings(choice: object) -> object:
    """Resolve a name to settings, and insert the default method if none is given."""
    if isinstance(choice, Mapping):
        name = choice.get("name", DEFAULT_METHOD)
        if isinstance(name, str):
            if name not in METHODS:
                raise ValueError(f"unknown method {name!r}; {METHODS.instead_of(name, METHODS)}")
            _check_known(choice, METHODS[name].settings)
        return {"name": name, **choice}
    if not isinstance(choice, str):
        return choice
    if choice in OPTIMIZERS:
        return OPTIMIZERS[choice]
    reason = OPTIMIZERS.unknown(choice)
    otherwise = "; or pass an object with settings" if "known are" in reason else ""
    raise ValueError(f"{reason}{otherwise}")


def with_settings(choice: object, settings: Mapping[str, Any]) -> object:
    """Apply settings on top of those of an optimizer."""
    with suppress(ValueError):
        choice = optimizer_settings(choice)
    if isinstance(choice, SearchSettings):
        choice = choice.model_dump()
    if not isinstance(choice, Mapping):
        return choice
    name = settings.get("name", choice.get("name"))
    return {**choice, **settings} if name == choice.get("name") else dict(settings)


def _check_known(settings: Mapping[Any, Any], model: type[SearchSettings]) -> None:
    """Raise ValidationError for unknown settings, with suggestions."""
    setting_names = [name for name in model.model_fields if name != "name"]
    problems = [
        InitErrorDetails(
            type=PydanticCustomError(
                "unknown_setting",
                "no setting of {method}; {known}",
                {
                    "method": model.model_fields["name"].default,
                    "known": instead_of(str(key), setting_names),
                },
            ),
            loc=(str(key),),
            input=value,
        )
        for key, value in settings.items()
        if key not in model.model_fields
    ]
    if problems:
        raise ValidationError.from_exception_data(model.__name__, problems)


OptimizerChoice = Annotated[
    OptimizerSettings,
    BeforeValidator(optimizer_settings, json_schema_input_type=OptimizerName | OptimizerSettings),
]
"""Choice of a search method; validation replaces a name by settings."""


_DESIGNS: Final = "<designs>"
_JOBS: Final = "<jobs>"

StartDesign = Annotated[
    dict[VariableName, VariableValue],
    Field(
        min_length=1,
        max_length=128,
        description="Value of every searched variable, by name; a categorical one by a"
        " choice's name or index. Fixed variables may be omitted.",
        examples=[{"FI1R": 4380.5, "FO2R": 231.0}],
    ),
]


class EarlierJobs(BaseModel):
    """The best designs of earlier jobs, looked up once, at submission."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    jobs: tuple[Annotated[str, Field(min_length=1, max_length=64)], ...] = Field(
        min_length=1,
        max_length=100,
        description="Job identifiers; the best design of each comes first, then the second ones.",
        examples=[["k2q7zr5dm9xw"]],
    )
    count: int = Field(
        default=5, ge=1, le=10_000, description="Maximum number of distinct designs in total [1]."
    )


def _tag(value: Any) -> str | None:
    if isinstance(value, Mapping | EarlierJobs):
        return _JOBS
    return _DESIGNS if isinstance(value, list | tuple) else None


StartChoice = Annotated[
    Annotated[tuple[StartDesign, ...], Field(max_length=10_000, fail_fast=True), Tag(_DESIGNS)]
    | Annotated[EarlierJobs, Tag(_JOBS)],
    Discriminator(
        _tag,
        custom_error_type="no_choice",
        custom_error_message="must be a list of designs, or an object that names earlier jobs",
    ),
]

DECISIVE: Final = 0.05
"""Relative distance from the best fitness within which designs count as equally good."""


class Spec(BaseModel):
    """An optimization job: variables, robot, method, budget and seed."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    outcome_independent_fields: ClassVar[frozenset[str]] = frozenset(
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
    """Fields on which the outcome of a given design does not depend."""

    searches: ClassVar[bool] = True
    """Whether designs are searched for, so that the best ones of another job are a start; else they
    are sampled, and statistics hold for samples only.
    """

    has_objective_vectors: ClassVar[bool] = False
    """Whether designs have several objectives, returned by `search_feedback`."""

    schema_version: Literal[1] = Field(default=1, description="Version of this schema.")
    name: Line = Field(default="", max_length=200, description="Display name; need not be unique.")
    robot: RobotSource = Field(
        default=DEFAULT_ROBOT,
        description="Robot to simulate: a name, a variant with another friction law or with"
        " backlash, or the text of custom model files.",
    )
    variables: tuple[VariableChoice, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=128,
        description="Variables to search: names (with the catalogue's bounds) or variables with"
        " custom bounds. Default: all that the job requires, except those in `fixed`.",
    )
    fixed: dict[VariableName, VariableValue] = Field(
        default_factory=dict,
        description="Variables held constant, by name; a categorical one by a choice's name or"
        " index.",
        examples=[{"FOMF": 2, "stride": 0.15}],
    )
    optimizer: OptimizerChoice = Field(
        default=OPTIMIZERS[DEFAULT_METHOD],
        description="Search method: a name (see /v1/optimizers), or an object with a name and"
        " settings.",
    )
    iterations: Annotated[int, Field(ge=1, le=1_000_000)] = Field(
        default=25,
        description="Budget: the job evaluates this many times the optimizer's `particles`"
        " designs. A method with fewer designs per iteration takes more iterations.",
    )
    seed: int = Field(
        default=1,
        ge=0,
        lt=2**63,
        description="Seed of all random numbers; results repeat bit for bit.",
    )
    start: StartChoice = Field(
        default=(),
        description="Designs to evaluate first, and to start the search from if the method"
        " supports it: a list, or the best of earlier jobs, looked up at submission. They count"
        " towards the budget.",
        examples=[{"jobs": ["k2q7zr5dm9xw"], "count": 5}],
    )
    precision: Precision = Field(
        default="double",
        description="Floating-point precision of the search's simulations: `double`, or `single`,"
        " which is about twice as fast and requires a C compiler. The best design is always"
        " reevaluated in double precision.",
    )

    @property
    def budget(self) -> int:
        """Designs that the job evaluates in total."""
        return self.iterations * self.optimizer.particles

    def with_budget(self, iterations: int) -> Self:
        """Return the job with another budget.

        Args:
            iterations: Of `particles` designs each.
        """
        return self.model_copy(update={"iterations": iterations})

    @property
    def search(self) -> OptimizerSettings:
        """Settings of the search method; for `auto`, of the method that it selects."""
        if isinstance(self.optimizer, AutoSettings):
            space, starts = self.design_space().box, bool(self.start)
            return chosen_method(self.optimizer, space, self.budget, starts=starts)
        return self.optimizer

    @model_validator(mode="after")
    def _can_search(self) -> Self:
        name = self.optimizer.name
        if METHODS[name].replays and self.budget > LONGEST_REPLAY:
            raise ValueError(
                f"iterations: {name} is replayed when a job is resumed, so it"
                f" evaluates {LONGEST_REPLAY} designs at most, not {self.budget}"
            )
        if METHODS[name].multi_objective and not self.has_objective_vectors:
            raise ValueError(
                f"optimizer: {name} is multi-objective, and designs of this kind of job have no"
                " separate objectives; choose another method"
            )
        self.start_positions()
        return self

    def start_positions(self) -> Floats:
        """Return the (k, d) start positions; none while earlier jobs are not looked up yet."""
        if isinstance(self.start, EarlierJobs) or not self.start:
            return np.empty((0, 0))
        if len(self.start) > self.budget:
            raise ValueError(
                f"start: {len(self.start)} designs are more than the budget of {self.budget}; pass"
                " fewer, or more iterations"
            )
        space = self.design_space()
        try:
            return space.positions(self.start)
        except ValueError as error:
            raise ValueError(f"start.{error}") from error

    def create_search(self) -> Optimizer:
        """Create the optimizer, before its first ask."""
        box, start = self.design_space().box, self.start_positions()
        return create_search(self.search, box, self.budget, self.seed, start)

    @abstractmethod
    def design_space(self) -> DesignSpace:
        """Return searched and fixed variables, checked against the catalogue."""

    def check_can_be_simulated(self) -> None:
        """Check what only the simulator can decide: whether designs can be simulated."""
        from gaitswarm.sim.assembly import check_precision

        method = METHODS[self.search.name]
        if method.missing:
            raise InvalidRequest(
                f"{self.search.name} needs {', '.join(method.missing)}, not installed here:"
                f" {method.remedy}",
                field="optimizer",
            )
        with simulation_errors("precision"):
            for robot in self.robot_sources:
                check_precision(load_robot(robot), self.precision)

    def check_recordings(self, find: Callable[[str], RecordedWalk]) -> None:
        """Check that the robot has the joints of each recording, and reaches its gait.

        Args:
            find: Returns the recorded walk of an id; raises NotFound.

        Raises:
            InvalidRequest: A recording does not fit; names its index in `recordings`.
        """
        joints = load_robot(self.robot).joint_names if self.recording_ids else ()
        for index, name in enumerate(self.recording_ids):
            field = f"recordings.{index}"
            try:
                walk = find(name)
                if walk.joints != joints:
                    raise InvalidRequest("recorded joints differ from the robot's", field=field)
                walk.check_reach(self.robot)
            except (NotFound, SimulationInputError) as error:
                raise InvalidRequest(str(error), field=field) from error

    @property
    @abstractmethod
    def objectives(self) -> tuple[Objective, ...]:
        """What designs minimize in one case: the first columns of its raw results."""

    @property
    def measurements(self) -> tuple[Objective, ...]:
        """Further columns of a design's raw results in one case, which are not minimized."""
        return ()

    @property
    def columns(self) -> tuple[Objective, ...]:
        """The m columns of a design's raw results in one case."""
        return (*self.objectives, *self.measurements)

    @property
    @abstractmethod
    def case_names(self) -> tuple[str, ...]:
        """Names of the K cases in which every design is evaluated, in order."""

    @abstractmethod
    def cases(self, recordings: Recordings) -> tuple[Case, ...]:
        """Return the K cases, in the order of `case_names`."""

    @property
    def search_libraries(self) -> dict[str, str]:
        """Versions of the libraries that the search uses, by name."""
        return METHODS[self.search.name].versions()

    @property
    def further_libraries(self) -> tuple[str, ...]:
        """Distributions that the simulations use besides the common ones."""
        return ()

    @property
    def robot_sources(self) -> tuple[RobotSource, ...]:
        """Robots that are simulated; `robot` alone for most kinds."""
        return (self.robot,)

    @property
    def recording_ids(self) -> tuple[str, ...]:
        """Ids of the recorded walks that the cases require."""
        return ()

    @abstractmethod
    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Return fitness and utilities of n designs from (n, K, m) results, (n, K) failed."""

    def violations(self, results: Floats, failed: NDArray[np.bool_]) -> Floats | None:
        """Return by how much n designs violate the job's constraints (n,).

        0 for a feasible design, +inf for one without fitness. None for a job without constraints.

        Args:
            results: (n, K, m) raw results.
            failed: (n, K), true for a case without a result.
        """
        del results, failed  # Used by kinds with constraints.
        return None

    def search_feedback(
        self, objectives: Floats, failed: NDArray[np.bool_], fitness: Floats
    ) -> Floats:
        """Return the values that the search learns from, a function of what is stored.

        Args:
            objectives: (n, K, m) raw objectives; non-finite ones may be NaN.
            failed: (n, K), true for a case without a result.
            fitness: (n,) of `judge`.

        Returns:
            The fitness; for a multi-objective method (n, M) objective vectors.
        """
        del objectives, failed  # Used by kinds with objective vectors.
        return fitness

    def figure_of_merit(self, fitness: float) -> float | None:  # noqa: ARG002 - kinds may have one
        """Return a fitness as a figure that is maximized; None for jobs without one.

        Args:
            fitness: Minimized.
        """
        return None

    def as_good_as(self, fitness: float) -> float:
        """Return the greatest fitness that counts as equally good.

        Args:
            fitness: The best one.
        """
        return fitness * (1.0 + DECISIVE)

    def in_double(self) -> Self:
        """Return the job in double precision, in which its best design is reevaluated."""
        return self.model_copy(update={"precision": "double"})

    def resolved(self) -> Self:
        """Return the job with presets written out, so that later changes of them do not affect it.

        Scenarios, preference, variables and an `auto` optimizer are; robot and controller are not.
        """
        space = self.design_space()
        chosen = {"variables": space.variables, "fixed": space.shown_fixed}
        return self.model_copy(update=chosen | {"optimizer": self.search})


def judge_outcomes(spec: Spec, outcomes: tuple[Outcome, ...]) -> Judgement:
    return spec.judge(*by_design(outcomes))
