"""Comparison of jobs: convergence, distributions and differences of specs."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.views import View
from gaitswarm.views.catalogue import ReferenceView


class ConvergenceView(View):
    """Convergence of a job: some of its iterations, the last among them."""

    id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    iterations: list[int] = Field(description="Index of each of them, from 0.", examples=[[0, 24]])
    evaluations: list[int] = Field(description="Designs judged by then [1].", examples=[[25, 625]])
    seconds: list[float] = Field(
        description="Time spent in evaluating by then [s].", examples=[[0.6, 14.8]]
    )
    best_so_far: list[float | None] = Field(
        description="Least fitness by then; null while every design has failed.",
        examples=[[31.0, 17.2]],
    )


class ConvergencesView(View):
    """Convergence of several jobs."""

    items: list[ConvergenceView] = Field(
        description="Jobs in the requested order; deleted ones are left out."
    )


class ComparedJobView(View):
    """One of several jobs."""

    id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    name: str = Field(description="Name of the job.", examples=["chapter 4, preference A"])
    state: JobState = Field(description="The state that it is in.", examples=["succeeded"])
    best_fitness: float | None = Field(
        description="Least fitness so far; null while every design has failed.", examples=[17.2]
    )
    reference: ReferenceView | None = Field(
        default=None,
        description="Published design that it is compared with; null where there is none, and"
        " until it is known.",
    )
    gain: float | None = Field(
        default=None,
        description="Share by which `best_fitness` is less than that of `reference` [1]; null"
        " where one of them is not known.",
        examples=[0.39],
    )
    evaluations: int = Field(description="Designs judged so far [1].", examples=[625])
    failed: int = Field(description="Of these, those that failed [1].", examples=[12])
    convergence: ConvergenceView = Field(description="Its convergence.")
    shares: list[float] = Field(
        description="Shares of its designs that walk in every case, rising from 0 to 1 [1].",
        examples=[[0.0, 0.5, 1.0]],
    )
    fitness: list[float] = Field(
        description="Fitness that each of these shares is within: its distribution function.",
        examples=[[17.2, 25.1, 310.0]],
    )


class SpecDifferenceView(View):
    """A difference between the specs of jobs, names aside."""

    field: str = Field(
        description="Path of the field. A variable is one, as is a scenario that some specs lack.",
        examples=["optimizer.particles"],
    )
    values: list[str | None] = Field(
        description="As JSON, of each job in its order; null where a spec has none. Of a variable"
        " its bounds and unit, or its choices, in words, as `1500 to 6000 counts`; of a scenario"
        " that some specs lack what is not as it is by default.",
        examples=[["25", "50"]],
    )


class JobComparisonView(View):
    """Comparison of jobs, without simulation."""

    jobs: list[ComparedJobView] = Field(description="In the requested order.")
    differences: list[SpecDifferenceView] = Field(description="Fields whose values differ.")
    comparable: bool = Field(
        description="Whether all judge by the same measure: kind, robot, scenarios, preference and"
        " worlds. If not, their fitness is not the same quantity."
    )
