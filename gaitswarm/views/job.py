"""Jobs, their iterations and designs, and what a job would cost."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any, Final, Literal, NamedTuple

from pydantic import ConfigDict, Field

from gaitswarm.services.optimizer.analysis.bounds import ClosestView
from gaitswarm.services.optimizer.analysis.evaluations import (
    EvaluationView,
    ObjectiveView,
    evaluation_views,
)
from gaitswarm.services.optimizer.errors import Unreadable
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.job import (
    DELETABLE,
    TRANSITIONS,
    Job,
    JobState,
    ReferenceView,
    UnreadableSpec,
)
from gaitswarm.services.optimizer.jobs.labels import preference_name, robot_name
from gaitswarm.services.optimizer.jobs.provenance import ProvenanceRecord
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.jobs.time_left import time_left
from gaitswarm.services.optimizer.views import Finite, IterationIndex, JobName, View, fields_of
from gaitswarm.sim.kernel import Precision
from gaitswarm.views.base import PREFIX


class SearchView(View):
    """Fitness in single precision of a design that is judged in double."""

    precision: Precision = Field(description="Of the search.", examples=["single"])
    fitness: float = Field(examples=[20.8712])
    """Of the design in that precision; units as of `fitness`."""
    difference: float = Field(examples=[0.00006])
    """By how much that is more than in double precision, relative [1]."""


class BestView(EvaluationView):
    """The best design that a job has found so far, always judged in double precision."""

    fitness: float = Field(description="As of any evaluation; never null.", examples=[20.87])
    search: SearchView | None = None
    """Fitness that a search in single precision was given."""

    @classmethod
    def from_evaluation(cls, evaluation: Evaluation, spec: Spec) -> BestView:
        """Make a view of a design that did not fail, by its reevaluation if there is one."""
        search, reevaluation = None, evaluation.reevaluation
        if reevaluation is not None:
            found = evaluation.fitness
            search = SearchView(
                precision=spec.precision,
                fitness=found,
                difference=found / reevaluation.fitness - 1.0 if reevaluation.fitness else 0.0,
            )
            evaluation = evaluation._replace(
                objectives=reevaluation.objectives,
                statuses=reevaluation.statuses,
                fitness=reevaluation.fitness,
            )
        (view,) = evaluation_views([evaluation], spec)
        return cls.model_validate({**dict(view), "search": search})


class IterationView(View):
    """Summary of one committed iteration. Fitness is minimized; null if every design failed."""

    index: IterationIndex
    designs: int = Field(description="Designs of the iteration [1].", examples=[25])
    best: Finite = Field(description="Least fitness of this iteration [1].", examples=[21.3])
    mean: Finite = Field(description="Mean of its finite fitnesses [1].", examples=[25.2])
    median: Finite = Field(description="Median of them [1].", examples=[23.9])
    worst: Finite = Field(description="Greatest of them [1].", examples=[41.7])
    best_so_far: Finite = Field(examples=[20.9])
    """Least fitness of this and all earlier iterations [1]."""
    failed: int = Field(description="Designs that failed in some scenario [1].", examples=[2])
    infeasible: int = Field(examples=[0])
    """Designs that did not fail and violate a constraint [1]."""
    least_violation: Finite = Field(examples=[None])
    """Least violation of its designs, 0 for a feasible one [1]; null without constraints, or if
    every design failed."""
    evaluate_seconds: float = Field(description="Time of its evaluation [s].", examples=[1.23])
    committed_at: datetime = Field(description="When it was committed, UTC.")
    digest: str | None = Field(
        default=None,
        description="SHA-256 of it, the spec and all iterations before it.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )


class HistoryIterationView(IterationView):
    """One committed iteration with every design."""

    evaluations: list[EvaluationView] = Field(description="Every design, in order.")


class Spent(NamedTuple):
    """How much of a budget is spent. Its text is `12 of 25 iterations`."""

    done: int
    planned: int
    unit: Literal["iterations", "designs"]  # designs if an iteration has fewer than it may have

    def __str__(self) -> str:
        return f"{self.done} of {self.planned} {self.unit}"


JobKind = Literal["tuning", "identification", "calibration", "certificate", "preferences"]


class JobSummaryView(View):
    """A job and its progress. What depends on the spec is null, 0 or empty if it is unreadable."""

    id: JobName
    name: str = Field(description="Name, given with the spec or later.", examples=["chapter 4"])
    kind: JobKind | None = Field(description="What it tunes, fits or tests.", examples=["tuning"])
    state: JobState = Field(examples=["running"])
    """State; a pausing job finishes its iteration first."""
    error: str | None = Field(description="Why it failed, or why its spec cannot be read.")
    controller: str | None = Field(examples=["fuzzy-pi"])
    """Motor controller that it tunes; null for none."""
    scenarios: list[str] = Field(examples=[["normal-fast", "turn-right-fast"]])
    """Scenarios of every design, or recordings or walks that it is fitted to."""
    precision: Precision | None = Field(examples=["double"])
    """Precision of the search; the best is judged in double."""
    optimizer: str | None = Field(description="Search method.", examples=["pso"])
    particles: int = Field(description="Most designs of one iteration [1].", examples=[25])
    iterations: int = Field(description="Iterations committed so far [1].", examples=[12])
    iterations_planned: int = Field(examples=[25])
    """Budget in iterations of `particles` designs each [1]."""
    evaluations: int = Field(description="Designs judged so far [1].", examples=[300])
    evaluations_saved: int = Field(examples=[25])
    """Of these, designs whose results were already known [1]."""
    evaluations_planned: int = Field(examples=[625])
    """Designs that the whole budget will judge [1]."""
    best_fitness: Finite = Field(examples=[21.3])
    """Least fitness so far, in double precision [1]; null while every design has failed or violates
    a constraint."""
    infeasible: int = 0
    """Designs that did not fail and violate a constraint [1]."""
    least_violation: Finite = None
    """Least violation of the constraints so far, 0 once a design is feasible [1]; null without
    constraints, or while every design has failed."""
    reference: ReferenceView | None = None
    """Published design of its controller and preference in the same walks; null without one, and
    until the job has ended or `/v1/jobs/{job_id}/verdict` was requested."""
    gain: Finite = Field(default=None, examples=[0.39])
    """Share by which `best_fitness` is less than that of `reference` [1]."""
    best_iteration: int | None = Field(examples=[11])
    """Iteration that found it, from 0."""
    compute_seconds: float = Field(examples=[14.8])
    """Time spent in evaluating committed iterations [s]."""
    evaluations_per_second: float | None = Field(examples=[20.3])
    """Designs judged per second of that time [1/s]."""
    simulations_per_second: float | None = Field(examples=[121.6])
    """Simulations that were not saved, per second of that time [1/s]."""
    evaluated_on: str | None = Field(default=None, examples=["ray: 4 workers on 2 nodes"])
    """Where its last iteration was simulated: threads, or workers of Ray."""
    waiting: str | None = None
    """What a running job waits for, such as unreachable workers."""
    eta_seconds: float | None = Field(examples=[16.1])
    """Estimated time to the end of the budget [s]; null if unknown."""
    eta_basis: str = Field(default="", examples=["at the pace of the last iterations, 1.23 s each"])
    """Basis of `eta_seconds`, or why it is unknown."""
    lineage: Lineage | None = None
    """Parent of a fork, and what it took over."""
    robot: str | None = Field(default=None, examples=["szabadka2-reconstructed"])
    """Name of its robot; of a custom one that in robot.toml, or `own`."""
    preference: str | None = Field(default=None, examples=["A"])
    """Name of the preference that it tunes by, `own` for a custom one."""
    note: str = Field(default="", description="Note, free text.")
    tags: list[str] = Field(default_factory=list, description="Tags.", examples=[["thesis"]])
    archived: bool = Field(default=False, description="Whether lists leave it out.")
    owner: str | None = Field(default=None, examples=["ci"])
    """Name of the token that submitted it."""
    kept: bool = Field(default=False, description="Whether it is protected from deletion.")
    priority: int = Field(default=0, examples=[0])
    """Priority: the highest one runs first; each step doubles the share of workers [1]."""
    created_at: datetime = Field(description="When it was submitted, UTC.")
    updated_at: datetime
    """When its state, progress or waiting last changed, UTC."""
    started_at: datetime | None = Field(description="When it was first claimed, UTC.")
    finished_at: datetime | None = Field(description="When it ended, UTC.")
    links: dict[str, str] = Field(
        description="Paths of the job and of the commands that its state allows.",
        examples=[{"self": "/v1/jobs/k2q7zr5dm9xw", "pause": "/v1/jobs/k2q7zr5dm9xw/pause"}],
    )

    @property
    def last_iteration(self) -> int | None:
        """Index of the last committed iteration; None before the first."""
        return self.iterations - 1 if self.iterations else None

    @property
    def spent(self) -> Spent:
        """How much of its budget it has spent."""
        whole = self.evaluations == self.iterations * self.particles
        if self.particles == 0 or (whole and self.iterations <= self.iterations_planned):
            return Spent(self.iterations, self.iterations_planned, "iterations")
        return Spent(self.evaluations, self.evaluations_planned, "designs")

    @classmethod
    def from_job(cls, job: Job) -> JobSummaryView:
        return cls.model_validate(_summary(job))


class JobView(JobSummaryView):
    """A job in full: spec, progress and best design so far."""

    model_config = ConfigDict(serialize_by_alias=True)

    best: BestView | None
    """Best design so far, judged in double precision; null while none walks in every scenario and
    keeps the constraints."""
    closest: ClosestView | None = None
    """Design of least violation; null without constraints, and once a design is feasible."""
    objectives: list[ObjectiveView] = Field(description="What its designs minimize.")
    measurements: list[ObjectiveView] = Field(default_factory=list)
    """Further columns of its results."""
    stored_spec: AnySpec | None = Field(
        alias="spec",
        description="Spec, with scenarios, preference and variables as they were on submission;"
        " null if this version cannot read it.",
    )
    provenance: list[ProvenanceRecord]
    """What its numbers depend on besides the spec; one entry since submission, and one for every
    change that was accepted."""
    head: str | None = Field(
        default=None,
        description="Digest of the last committed iteration, chained to all before it and"
        " the spec, for POST /v1/jobs/{job_id}/verify.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )

    @property
    def spec(self) -> AnySpec:
        if self.stored_spec is None:
            raise Unreadable(f"job {self.id}: {self.error}")
        return self.stored_spec

    @classmethod
    def from_job_and_best(
        cls, job: Job, best: Evaluation | None, closest: ClosestView | None = None
    ) -> JobView:
        """Make a view of a job; its best design is not shown if the spec cannot be read."""
        view, spec = None, None
        columns: dict[str, list[ObjectiveView]] = {"objectives": [], "measurements": []}
        if job.readable:
            spec = job.spec
            view = None if best is None else BestView.from_evaluation(best, spec)
            columns = {
                name: [ObjectiveView.model_validate(c) for c in getattr(spec, name)]
                for name in columns
            }
        return cls.model_validate(
            {
                **_summary(job),
                "best": view,
                "closest": closest,
                **columns,
                "spec": spec,
                "provenance": job.provenance,
                "head": job.progress.head,
            }
        )


class StateView(View):
    """A change of a job's state, as sent in the event stream."""

    id: JobName
    state: JobState = Field(description="The present state.", examples=["succeeded"])
    error: str | None = Field(description="Why it failed; null if it did not.")
    iterations: int = Field(description="Iterations committed so far [1].", examples=[25])
    evaluations: int = Field(description="Designs judged in them [1].", examples=[625])
    waiting: str | None = None
    """What a running job waits for, such as unreachable workers."""

    @classmethod
    def from_job(cls, job: Job) -> StateView:
        return cls(**fields_of(cls, job.progress, job))


def _summary(job: Job) -> dict[str, Any]:
    rates, spec = time_left(job, datetime.now(UTC)), job.stored_spec
    readable: dict[str, Any] = {}
    if not isinstance(spec, UnreadableSpec):
        readable = {
            "kind": spec.kind,
            "scenarios": list(spec.case_names),
            "precision": spec.precision,
            "optimizer": spec.optimizer.name,
            "particles": spec.optimizer.particles,
            "evaluations_planned": spec.budget,
        }
        if spec.kind == "tuning":
            # Its cases are each scenario in every world.
            readable["scenarios"] = [scenario.name for scenario in spec.resolved_scenarios()]
            readable["controller"] = spec.controller
    particles = getattr(spec, "particles", 0)
    return {
        **dict.fromkeys(("kind", "precision", "optimizer", "controller")),
        **fields_of(JobSummaryView, job.labels, job.progress, rates, job),
        "scenarios": [],
        "particles": particles,
        "iterations_planned": spec.iterations,
        "evaluations_planned": spec.iterations * particles,
        **readable,
        "error": job.error or getattr(spec, "reason", None),
        "robot": robot_name(getattr(spec, "robot", None)),
        "preference": preference_name(getattr(spec, "preference", None)),
        "reference": ReferenceView.from_reference(job.reference),
        "eta_basis": rates.basis,
        "links": _links(job),
    }


_COMMANDS: Final = {
    state: [(c.value, after) for (before, c), after in TRANSITIONS.items() if before is state]
    for state in JobState
}
"""Commands by state, each with the state after it."""


def _links(job: Job) -> dict[str, str]:
    here = f"{PREFIX}/jobs/{job.id}"
    names = [
        command
        for command, after in _COMMANDS[job.state]
        if job.readable or after is not JobState.QUEUED
    ]
    if job.readable and job.state is not JobState.CANCELLED:
        names.append("extend")
    if job.readable and job.progress.iterations:
        names.append("fork")
    if not job.state.terminal:
        names.append("priority")
    links = {"self": here} | {name: f"{here}/{name}" for name in (*names, "keep")}
    if job.state in DELETABLE and not job.kept:
        links["delete"] = here
    return links
