"""What search methods are compared on: test functions, and jobs that tune a drive."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    FieldSerializationInfo,
    FiniteFloat,
    Tag,
    field_serializer,
    model_validator,
)

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import judge_outcomes
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.services.optimizer.tournament.functions import ACCEPTANCE, FUNCTIONS, draw
from gaitswarm.sim.case import run_together
from gaitswarm.sim.robot import RobotSource

Floats = NDArray[np.float64]

_OF_A_RUN: Final = ("optimizer", "iterations", "seed", "start")
"""Fields of a job that tunes, which a tournament gives each run."""

_SECONDS_OF_A_FUNCTION: Final = 0.01
"""What an evaluation of a test function counts [simulated s], beside walks of some hundred."""

ProblemName = Annotated[
    str,
    Field(
        min_length=1,
        max_length=40,
        pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$",
        description="Name of the problem, which no other one of the job has.",
        examples=["chapter-4.A"],
    ),
]


class FunctionProblem(BaseModel):
    """A test function of thesis 3.2.1."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    function: Literal[tuple(FUNCTIONS)] = Field(  # type: ignore[valid-type]
        description="Name of the function, by its tags.", examples=["D7C0R0I1"]
    )
    target: FiniteFloat | None = Field(
        default=ACCEPTANCE, description="Value that counts as solved; null: none."
    )

    @property
    def name(self) -> str:
        """That of the function."""
        return str(self.function)

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        """None."""
        return ()

    @property
    def duration(self) -> float:
        """What an evaluation counts [simulated s]."""
        return _SECONDS_OF_A_FUNCTION

    @property
    def space(self) -> Space:
        """The function's box."""
        function = FUNCTIONS[self.name]
        rows = zip(function.low, function.high, function.integer, strict=True)
        return Space(
            [Axis(float(a), float(b), "integer" if i else "continuous") for a, b, i in rows]
        )

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:
        """Values of the function, with random numbers of the run where it has a random part."""
        function = FUNCTIONS[self.name]
        numbers = np.zeros(len(designs))
        if function.is_random:
            numbers = draw(seed, first=first, count=len(designs))
        return function.value(designs, numbers)

    def final(self, designs: Floats, fitness: Floats) -> Floats:  # noqa: ARG002
        """What the search was told."""
        return fitness


class TuningProblem(BaseModel):
    """A job that tunes a drive, without its optimizer, budget and seed: those are the run's."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: ProblemName
    job: JobSpec = Field(
        description="Robot, controller, scenarios, preference, variables, and the precision of the"
        " search; what is reported of it is judged in double."
    )
    target: FiniteFloat | None = Field(
        default=None, description="Fitness that counts as solved; null: none."
    )

    @model_validator(mode="before")
    @classmethod
    def _has_no_run_of_its_own(cls, document: Any) -> Any:
        job = document.get("job") if isinstance(document, Mapping) else None
        for field in _OF_A_RUN:
            if isinstance(job, Mapping) and field in job:
                raise ValueError(f"job.{field}: is the tournament's to say; leave it out")
        return document

    @field_serializer("job")
    def _without_a_run(self, job: JobSpec, info: FieldSerializationInfo) -> dict[str, Any]:
        mode = "json" if info.mode == "json" else "python"
        return job.model_dump(mode=mode, exclude=set(_OF_A_RUN))

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        """The robot that is tuned."""
        return (self.job.robot,)

    @property
    def duration(self) -> float:
        """Simulated time of one evaluation [s]."""
        return sum(case.duration for case in self.job.cases({}))

    @property
    def space(self) -> Space:
        """The box of the job's variables."""
        return self.job.design_space().box

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:  # noqa: ARG002
        """What designs are worth in the precision of the search."""
        return _fitness(self.job, designs)

    def final(self, designs: Floats, fitness: Floats) -> Floats:
        """What designs are worth in double precision."""
        if self.job.precision == "double":
            return fitness
        return _fitness(self.job.in_double(), designs)


def _fitness(job: JobSpec, designs: Floats) -> Floats:
    space = job.design_space()
    walked = space.simulated(space.designs(space.box.positions(designs)))
    cases = job.cases({})
    return judge_outcomes(job, run_together(cases, [walked] * len(cases))).fitness


def _problem_tag(value: Any) -> str | None:
    if isinstance(value, Mapping):
        return "<function>" if "function" in value else "<tuning>"
    if isinstance(value, BaseModel):
        return "<function>" if isinstance(value, FunctionProblem) else "<tuning>"
    return None


ProblemChoice = Annotated[
    Annotated[FunctionProblem, Tag("<function>")] | Annotated[TuningProblem, Tag("<tuning>")],
    Discriminator(
        _problem_tag,
        custom_error_type="no_choice",
        custom_error_message="must be an object: a test function, or a job that tunes a drive",
    ),
]
"""How a tournament names a problem."""
