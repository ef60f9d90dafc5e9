"""Jobs that compare search methods: every design of such a job is one run of one method."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Union

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.judgement import Judgement
from gaitswarm.services.optimizer.jobs.kinds.problem import ProblemChoice, TuningProblem
from gaitswarm.services.optimizer.jobs.kinds.race_case import SEED, RaceCase, settings_of_run
from gaitswarm.services.optimizer.jobs.optimizer_choice import OptimizerChoice
from gaitswarm.services.optimizer.jobs.provenance import optimizer_digest
from gaitswarm.services.optimizer.jobs.spec import Spec, create_optimizer
from gaitswarm.services.optimizer.search.method import missing_of, versions_of
from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.random_search import RandomSearchSettings
from gaitswarm.services.optimizer.tournament.methods import (
    extra_of,
    libraries_of,
    method_names,
    named_settings,
    settings_models,
    settings_variables,
    why_unknown,
)
from gaitswarm.services.optimizer.tournament.race import Terms, default_checkpoints
from gaitswarm.sim.case import Case
from gaitswarm.sim.identification.recorded_walk import Recordings
from gaitswarm.sim.outcome import Objective
from gaitswarm.sim.robot import RobotSource

Floats = NDArray[np.float64]

MOST_EVALUATIONS: Final = 100_000
"""Of one run."""

_COUNT: Final = TypeAdapter(int)


def _method_settings(choice: object) -> object:
    """Settings of a method that is named."""
    if isinstance(choice, str):
        return named_settings(choice)
    name = choice.get("name") if isinstance(choice, Mapping) else None
    if isinstance(name, str) and name not in settings_models():
        raise ValueError(why_unknown(name, settings_models()))
    return choice


def _method_tag(settings: Any) -> str | None:
    if isinstance(settings, BaseModel):
        return f"<{getattr(settings, 'name', '')}>"
    return f"<{settings.get('name')}>" if isinstance(settings, Mapping) else None


if TYPE_CHECKING:
    MethodChoice = SearchSettings
else:
    _Settings = Annotated[
        Union[tuple(Annotated[m, Tag(f"<{name}>")] for name, m in settings_models().items())],  # noqa: UP007 - of a tuple
        Discriminator(
            _method_tag,
            custom_error_type="no_choice",
            custom_error_message="must be a name or an object: settings of a method",
        ),
    ]
    MethodChoice = Annotated[
        _Settings,
        BeforeValidator(
            _method_settings, json_schema_input_type=Literal[method_names()] | _Settings
        ),
    ]
    """How a tournament names a method: once it is read, a name has become settings."""


class TournamentSpec(Spec):
    """A method's part in a tournament: runs of it on several problems.

    A design is a run: its seed, and settings that are drawn. A case is a problem. The job's own
    optimizer draws `iterations` times its `particles` runs at random.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "kind": "tournament",
                    "method": "pso",
                    "problems": [{"function": "D7C0R0I1"}],
                    "evaluations": 625,
                    "iterations": 20,
                }
            ]
        },
    )

    # A run depends on the code of searches, too.
    unwalked = None

    searches = False

    kind: Literal["tournament"] = Field(description="Run a search method many times.")
    method: MethodChoice = Field(
        description="Search method and its settings, of the registry or of another library."
    )
    problems: tuple[ProblemChoice, ...] = Field(
        min_length=1, max_length=64, description="What each run is repeated on."
    )
    evaluations: int = Field(
        default=625, ge=1, le=MOST_EVALUATIONS, description="Budget of each run."
    )
    checkpoints: tuple[int, ...] = Field(
        default=(),
        max_length=100,
        description="Evaluations, ascending, after which the best so far is kept; the budget is the"
        " last. Default: ten in each decade.",
    )
    stops_at_target: bool = Field(
        default=False, description="Whether a run ends when it has reached its problem's target."
    )
    optimizer: OptimizerChoice = Field(
        default=RandomSearchSettings(particles=1),
        description="What draws the runs: `random`, whose `particles` are an iteration's.",
    )

    @model_validator(mode="before")
    @classmethod
    def _write_out_checkpoints(cls, document: Any) -> Any:
        if not isinstance(document, dict) or document.get("checkpoints"):
            return document
        try:
            default = cls.model_fields["evaluations"].default
            # Read as the field reads it: 625.0 is a count, too.
            budget = _COUNT.validate_python(document.get("evaluations", default))
        except ValidationError:
            return document
        if not 1 <= budget <= MOST_EVALUATIONS:
            return document
        return {**document, "checkpoints": default_checkpoints(budget)}

    @model_validator(mode="after")
    def _can_be_run(self) -> TournamentSpec:
        if self.precision != "double":
            raise ValueError("precision: that of a search is given in its problem's job")
        if self.optimizer.name != "random":
            raise ValueError("optimizer: runs are drawn by random; what races is `method`")
        names = self.case_names
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"problems: {name!r} is named twice")
        steps = self.checkpoints
        if list(steps) != sorted(set(steps)) or steps[:1] < (1,) or steps[-1] != self.evaluations:
            raise ValueError(
                f"checkpoints: must ascend from 1 or more to the budget of {self.evaluations}"
            )
        self.design_space()
        return self

    def design_space(self) -> DesignSpace:
        """The seed, and settings of the method that are drawn."""
        known = settings_variables(type(self.method))
        return DesignSpace.build(
            required=(SEED,), optional=known, chosen=self.variables, fixed=self.fixed
        )

    def check_can_be_simulated(self) -> None:
        """Check that the method is installed and takes what is drawn, and every problem.

        Raises:
            InvalidRequest: Something cannot be run; names the field.
        """
        missing = missing_of(libraries_of(self.method))
        if missing:
            raise InvalidRequest(
                f"{self.method.name} needs {', '.join(missing)}, not installed here:"
                f" pip install 'gaitswarm[{extra_of(self.method)}]'",
                field="method",
            )
        for index, problem in enumerate(self.problems):
            if isinstance(problem, TuningProblem):
                try:
                    problem.job.check_can_be_simulated()
                except InvalidRequest as error:
                    text = str(error).removeprefix(f"{error.field}: ")
                    field = f"problems.{index}.job.{error.field}"
                    raise InvalidRequest(text, field=field) from error
        self._check_settings()

    def _check_settings(self) -> None:
        """All runs are known beforehand, as `random` listens to nobody."""
        optimizer, space = create_optimizer(self), self.design_space()
        while optimizer.evaluations < self.budget:
            positions = optimizer.ask(self.budget - optimizer.evaluations)
            for row in space.simulated(space.designs(positions)).tolist():
                try:
                    settings_of_run(self.method, space.names, row)
                except ValueError as error:
                    values = ", ".join(f"{n} {v:g}" for n, v in zip(space.names, row, strict=True))
                    raise InvalidRequest(
                        f"{self.method.name} refuses what is drawn ({values}): {error}",
                        field="variables",
                    ) from error
            optimizer.tell(np.zeros(len(positions)))

    @property
    def search_libraries(self) -> dict[str, str]:
        """Versions of the libraries that runs of the method compute with."""
        return versions_of(libraries_of(self.method))

    @property
    def described(self) -> tuple[RobotSource, ...]:
        """The robots of all problems."""
        robots: list[RobotSource] = []
        for problem in self.problems:
            robots += [robot for robot in problem.robots if robot not in robots]
        return tuple(robots)

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """The best at each checkpoint, then `evaluations_to_best` and `evaluations_to_target`."""
        return (
            *(
                Objective(f"best_{count}", "1", f"Least fitness after {count} evaluations.")
                for count in self.checkpoints
            ),
            Objective("evaluations_to_best", "1", "Evaluations until the best was found."),
            Objective("evaluations_to_target", "1", "Evaluations until the target was reached."),
        )

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of the problems, in order."""
        return tuple(problem.name for problem in self.problems)

    @property
    def further_libraries(self) -> tuple[str, ...]:
        """Those of the jobs that are among its problems."""
        jobs = (problem.job for problem in self.problems if isinstance(problem, TuningProblem))
        return tuple(dict.fromkeys(name for job in jobs for name in job.further_libraries))

    def cases(self, recordings: Recordings) -> tuple[Case, ...]:  # noqa: ARG002 - needs none
        """One for each problem.

        Args:
            recordings: None are needed.

        Returns:
            Cases in the order of `case_names`.
        """
        names, robots = self.design_space().names, self.described
        digest = optimizer_digest()
        return tuple(
            RaceCase(
                problem,
                self.method,
                Terms(self.evaluations, self.checkpoints, problem.target, self.stops_at_target),
                names,
                robots,
                self.objectives,
                digest,
            )
            for problem in self.problems
        )

    def judge(self, objectives: Floats, failed: NDArray[np.bool_]) -> Judgement:
        """Judge runs by the best that they found.

        Args:
            objectives: (n, K, m) as of `objectives`.
            failed: (n, K), true for a run without a result.

        Returns:
            Fitness is the mean of the best of all problems, utilities are the best of each.
        """
        best = objectives[:, :, len(self.checkpoints) - 1]
        best = np.where(failed | np.isnan(best), np.inf, best)
        fitness = [math.fsum(row) / len(row) for row in best.tolist()]
        with np.errstate(divide="ignore", invalid="ignore"):
            return Judgement(np.array(fitness), np.log(np.maximum(best, 0.0)))

    def resolved(self) -> TournamentSpec:
        """The same job with its variables, and those of its problems, written out."""
        space = self.design_space()
        problems = tuple(
            problem.model_copy(update={"job": problem.job.resolved()})
            if isinstance(problem, TuningProblem)
            else problem
            for problem in self.problems
        )
        return self.model_copy(
            update={
                "variables": space.variables,
                "fixed": space.shown_fixed,
                "problems": problems,
            }
        )
