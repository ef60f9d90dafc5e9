"""Jobs and their progress, and what a job would cost."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.services.optimizer.analysis.evaluations import ObjectiveView
from gaitswarm.services.optimizer.analysis.reference import ReferenceView
from gaitswarm.services.optimizer.errors import Unreadable
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.estimate import Estimate, time_left
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.job import (
    LARGEST_BUDGET,
    Job,
    JobState,
    UnreadableSpec,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.labels import FacetCounts, preference_name, robot_name
from gaitswarm.services.optimizer.jobs.priority import HIGHEST, LOWEST
from gaitswarm.services.optimizer.jobs.provenance import ProvenanceRecord
from gaitswarm.services.optimizer.views import View, finite
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.views.base import job_links
from gaitswarm.views.history import BestView


@dataclass(frozen=True, slots=True)
class Spent:
    """How much of a budget is spent. Its text is `12 of 25 iterations`.

    Attributes:
        done: Units that are committed.
        planned: Units of the whole budget.
        unit: `iterations` where each of them has as many designs as it may have; else `designs`,
            as there may be many more and smaller iterations than the budget names.
    """

    done: int
    planned: int
    unit: Literal["iterations", "designs"]

    def __str__(self) -> str:
        return f"{self.done} of {self.planned} {self.unit}"


def budget_spent(
    iterations: int,
    evaluations: int,
    *,
    particles: int,
    iterations_planned: int,
    evaluations_planned: int,
) -> Spent:
    """Say how much of a job's budget is spent."""
    whole = iterations <= iterations_planned and evaluations == iterations * particles
    if particles == 0 or whole:
        return Spent(iterations, iterations_planned, "iterations")
    return Spent(evaluations, evaluations_planned, "designs")


class EstimateView(View):
    """Estimated cost of a job."""

    evaluations: int = Field(description="Designs that are judged [1].", examples=[625])
    walks: int = Field(description="Each design in each scenario [1].", examples=[3750])
    simulated_seconds: float = Field(
        description="Length of all walks together [s]; less for designs that fall.",
        examples=[20250.0],
    )
    seconds: float | None = Field(
        description="Wall time once it runs and has the machine to itself [s]; null"
        " if that is unknown.",
        examples=[21.5],
    )
    basis: str = Field(
        description="Basis of the estimate.",
        examples=["the rate of 2 earlier jobs with similar simulations: 942 simulated s/s"],
    )

    @classmethod
    def from_estimate(cls, estimate: Estimate) -> EstimateView:
        """Make a view of an estimate."""
        return cls(
            evaluations=estimate.evaluations,
            walks=estimate.walks,
            simulated_seconds=estimate.simulated_seconds,
            seconds=estimate.seconds,
            basis=estimate.basis,
        )


JobKind = Literal["tuning", "identification", "calibration", "certificate"]


class JobSummaryView(View):
    """A job and its progress."""

    id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    name: str = Field(
        description="Name, given with the spec or later.",
        examples=["chapter 4, preference A"],
    )
    kind: JobKind | None = Field(
        description="Kind of job: tunes a drive, fits parameters of the robot to recordings, fits"
        " robot and conventions to a table of results, or tests a design in many worlds; null if"
        " its spec cannot be read.",
        examples=["tuning"],
    )
    state: JobState = Field(
        description="queued, running, pausing (ends its iteration first), paused, cancelled,"
        " failed or succeeded.",
        examples=["running"],
    )
    error: str | None = Field(
        description="Why it failed, or why its spec cannot be read; null if neither is so.",
        examples=[None],
    )
    controller: str | None = Field(
        description="Motor controller that it tunes; null for a job that tunes none.",
        examples=["fuzzy-pi"],
    )
    scenarios: list[str] = Field(
        description="Scenarios in which every design walks, or recordings or walks that it is"
        " fitted to;"
        " empty if the spec cannot be read.",
        examples=[["normal-fast", "turn-right-fast"]],
    )
    precision: Precision | None = Field(
        description="Of the search's numbers; what is reported as best is judged in double. Null if"
        " the spec cannot be read.",
        examples=["double"],
    )
    optimizer: str | None = Field(
        description="Search method; null if the spec cannot be read.", examples=["pso"]
    )
    particles: int = Field(
        description="Designs of one iteration, at most [1]; 0 if the spec cannot be read.",
        examples=[25],
    )
    iterations: int = Field(
        description="Iterations committed so far [1]; a method that asks for fewer designs at once"
        " takes more of them than are planned.",
        examples=[12],
    )
    iterations_planned: int = Field(
        description="Budget in iterations of `particles` designs each [1]; 0 if the spec cannot be"
        " read.",
        examples=[25],
    )
    evaluations: int = Field(
        description="Designs judged so far, each in every scenario [1].", examples=[300]
    )
    evaluations_saved: int = Field(
        description="Of the designs judged, those whose results were already known: proposed"
        " twice, or simulated before by this or another job of the database [1].",
        examples=[25],
    )
    evaluations_planned: int = Field(
        description="Designs that the whole budget will judge [1].", examples=[625]
    )
    best_fitness: float | None = Field(
        description="Least fitness so far, in double precision [1]; null while every design has"
        " failed.",
        examples=[21.3],
    )
    reference: ReferenceView | None = Field(
        default=None,
        description="Published design of its controller and preference in the same walks; null"
        " where there is none, and until the job has ended or `/v1/jobs/{job_id}/reference` was"
        " requested.",
    )
    gain: float | None = Field(
        default=None,
        description="Share by which `best_fitness` is less than that of `reference` [1]; null"
        " where one of them is not known.",
        examples=[0.39],
    )
    best_iteration: int | None = Field(
        description="Iteration that found it, from 0.", examples=[11]
    )
    compute_seconds: float = Field(
        description="Time spent in evaluating committed iterations [s].", examples=[14.8]
    )
    evaluations_per_second: float | None = Field(
        description="Designs judged per second of that time [1/s]; null before the first.",
        examples=[20.3],
    )
    simulations_per_second: float | None = Field(
        description="Walks (designs x scenarios, but for saved ones) simulated per second of that"
        " time [1/s].",
        examples=[121.6],
    )
    evaluated_on: str | None = Field(
        default=None,
        description="Where its last iteration was simulated: threads of a process, or workers and"
        " nodes of Ray; null before the first.",
        examples=["ray: 4 workers on 2 nodes"],
    )
    waiting: str | None = Field(
        default=None,
        description="What a running job waits for, such as unreachable workers; it continues"
        " when they are back. Null for nothing.",
        examples=[None],
    )
    eta_seconds: float | None = Field(
        description="Estimated time to the end of the budget at the pace of the last iterations"
        " [s]: 0 for a job that succeeded, null unless it runs, waits for nothing and has committed"
        " an iteration.",
        examples=[16.1],
    )
    eta_basis: str = Field(
        default="",
        description="Basis of `eta_seconds`, or why it is unknown.",
        examples=["at the pace of the last iterations, 1.23 s each"],
    )
    lineage: Lineage | None = Field(
        default=None,
        description="Of a job that was forked from another one: from which, and what it took over;"
        " null for any other. Forks of a job are listed by `/v1/jobs?parent=`.",
    )
    robot: str | None = Field(
        default=None,
        description="Name of its robot, of one of its user's that in robot.toml, or `own`; null if"
        " the spec cannot be read, or names none.",
        examples=["szabadka2-reconstructed"],
    )
    preference: str | None = Field(
        default=None,
        description="Name of the preference that it tunes by, `own` for any other; null for a job"
        " that tunes nothing.",
        examples=["A"],
    )
    note: str = Field(default="", description="Note, free text.")
    tags: list[str] = Field(default_factory=list, description="Tags.", examples=[["thesis"]])
    archived: bool = Field(default=False, description="Whether lists leave it out.")
    owner: str | None = Field(
        default=None,
        description="Name of the token that it was submitted with; null for none.",
        examples=["ci"],
    )
    kept: bool = Field(default=False, description="Whether it is protected from deletion.")
    priority: int = Field(
        default=0,
        description="Priority: of waiting jobs the one of highest priority runs first,"
        " and of running jobs one that is a step higher has twice the share of the workers [1].",
        examples=[0],
    )
    created_at: datetime = Field(description="When it was submitted, UTC.")
    updated_at: datetime = Field(description="When its state or progress last changed, UTC.")
    started_at: datetime | None = Field(description="When it was first claimed, UTC.")
    finished_at: datetime | None = Field(description="When it ended, UTC.")
    links: dict[str, str] = Field(
        description="Links: `self`, `iterations`, `events`; where the spec can be read,"
        " `best`, `distribution`, `particles`, `export`; for a job that tunes a drive `ranking`"
        " (POST) and, once it has a best design, `scenarios`, `preferences` (POST), `firmware`;"
        " `evidence` and `verify` (POST) once an iteration is committed; `parent` of a fork; those"
        " of `pause`, `resume`, `cancel`, `extend`, `fork` (POST), `keep` (PUT, DELETE),"
        " `priority` (PUT) and `delete` (DELETE) that its state allows.",
        examples=[{"self": "/v1/jobs/k2q7zr5dm9xw", "pause": "/v1/jobs/k2q7zr5dm9xw/pause"}],
    )

    @property
    def last_iteration(self) -> int | None:
        """Index of the last committed iteration; None before the first."""
        return self.iterations - 1 if self.iterations else None

    @property
    def spent(self) -> Spent:
        """How much of its budget it has spent."""
        return budget_spent(
            self.iterations,
            self.evaluations,
            particles=self.particles,
            iterations_planned=self.iterations_planned,
            evaluations_planned=self.evaluations_planned,
        )

    @classmethod
    def from_job(cls, job: Job) -> JobSummaryView:
        """Make a summary without a further query.

        Args:
            job: as it was read.
        """
        return cls.model_validate(_summary(job))


class JobView(JobSummaryView):
    """A job in full: spec, progress and best design so far."""

    model_config = ConfigDict(serialize_by_alias=True)

    best: BestView | None = Field(
        description="Best design so far, judged in double precision; null while there is none that"
        " walks in every scenario."
    )
    objectives: list[ObjectiveView] = Field(
        description="What every case of this job yields; columns of its results."
    )
    stored_spec: AnySpec | None = Field(
        alias="spec",
        description="Spec, with scenarios, preference and variables resolved as they"
        " were on submission; robot and controller as they were named. Null if this version cannot"
        " read it, and `error` says why.",
    )
    provenance: list[ProvenanceRecord] = Field(
        description="What its numbers depend on besides the spec: code, libraries, content of the"
        " robot, backend, precision. One entry since submission, and one for every change that was"
        " accepted, the last of an iteration counting."
    )
    head: str | None = Field(
        default=None,
        description="Digest of the last committed iteration, chained to all before it and"
        " the spec: with a copy of it, `verify` detects later changes"
        " (POST /v1/jobs/{job_id}/verify). Null before the first.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )

    @property
    def spec(self) -> AnySpec:
        """The spec.

        Raises:
            Unreadable: This version cannot read it; says why, and what to do.
        """
        if self.stored_spec is None:
            raise Unreadable(f"job {self.id}: {self.error}")
        return self.stored_spec

    @classmethod
    def from_job_and_best(cls, job: Job, best: Evaluation | None) -> JobView:
        """Make a view of a job in full.

        Args:
            job: as it was read.
            best: its best design so far, if there is one; not shown if the spec cannot be read.
        """
        view, objectives, spec = None, [], None
        if job.readable:
            spec = job.spec
            view = None if best is None else BestView.from_evaluation(best, spec)
            objectives = [ObjectiveView.model_validate(o) for o in spec.objectives]
        return cls.model_validate(
            {
                **_summary(job),
                "best": view,
                "objectives": objectives,
                "spec": spec,
                "provenance": job.provenance,
                "head": job.progress.head,
            }
        )


class StateView(View):
    """A change of a job's state, as sent in the event stream."""

    id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    state: JobState = Field(description="The state that it is in now.", examples=["succeeded"])
    error: str | None = Field(description="Why it failed; null if it did not.", examples=[None])
    iterations: int = Field(description="Iterations committed so far [1].", examples=[25])
    evaluations: int = Field(description="Designs judged in them [1].", examples=[625])
    waiting: str | None = Field(
        default=None,
        description="What a running job waits for, such as unreachable workers; null for nothing.",
        examples=[None],
    )

    @classmethod
    def from_job(cls, job: Job) -> StateView:
        """Make a view of a job's present state.

        Args:
            job: as it was read.
        """
        return cls(
            id=job.id,
            state=job.state,
            error=job.error,
            iterations=job.progress.iterations,
            evaluations=job.progress.evaluations,
            waiting=job.waiting,
        )


def _summary(job: Job) -> dict[str, object]:
    progress = job.progress
    rates = time_left(job, datetime.now(UTC))
    return {
        "id": job.id,
        "state": job.state,
        "error": job.error or _why_unreadable(job.stored_spec),
        **_asked(job.stored_spec),
        "iterations": progress.iterations,
        "evaluations": progress.evaluations,
        "evaluations_saved": progress.evaluations_saved,
        "best_fitness": finite(progress.best_fitness),
        "reference": ReferenceView.from_reference(job.reference),
        "gain": finite(job.gain),
        "best_iteration": progress.best_iteration,
        "compute_seconds": progress.compute_seconds,
        "evaluations_per_second": rates.evaluations_per_second,
        "simulations_per_second": rates.simulations_per_second,
        "evaluated_on": job.evaluated_on,
        "waiting": job.waiting,
        "eta_seconds": rates.eta_seconds,
        "eta_basis": rates.basis,
        "lineage": job.lineage,
        "owner": job.owner,
        "kept": job.kept,
        "priority": job.priority,
        "name": job.name,
        "note": job.labels.note,
        "tags": job.labels.tags,
        "archived": job.archived,
        "created_at": job.created_at,
        "updated_at": job.updated_at,
        "started_at": job.started_at,
        "finished_at": job.finished_at,
        "links": job_links(job),
    }


def _why_unreadable(spec: AnySpec | UnreadableSpec) -> str | None:
    return spec.reason if isinstance(spec, UnreadableSpec) else None


def _walked(spec: AnySpec) -> list[str]:
    """Names of the cases; of a tuning in many worlds each scenario once."""
    if isinstance(spec, JobSpec):
        return [scenario.name for scenario in spec.resolved_scenarios()]
    return list(spec.case_names)


def _asked(spec: AnySpec | UnreadableSpec) -> dict[str, object]:
    """Fields of a summary that come from the spec."""
    if isinstance(spec, UnreadableSpec):
        kind, scenarios, particles = None, [], spec.particles
    else:
        kind, scenarios, particles = spec.kind, _walked(spec), spec.optimizer.particles
    return {
        "kind": kind,
        "robot": robot_name(getattr(spec, "robot", None)),
        "preference": preference_name(getattr(spec, "preference", None)),
        "controller": spec.controller if isinstance(spec, JobSpec) else None,
        "scenarios": scenarios,
        "precision": None if isinstance(spec, UnreadableSpec) else spec.precision,
        "optimizer": None if isinstance(spec, UnreadableSpec) else spec.optimizer.name,
        "particles": particles,
        "iterations_planned": spec.iterations,
        "evaluations_planned": spec.iterations * particles
        if isinstance(spec, UnreadableSpec)
        else spec.budget,
    }


class ExtensionRequest(BaseModel):
    """New budget of a job."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    iterations: int = Field(
        ge=1,
        le=LARGEST_BUDGET,
        description="Budget in all, in iterations of `particles` designs each: more than the job"
        " has spent [1].",
        examples=[50],
    )


class ResumeRequest(BaseModel):
    """Options for resuming a job."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    accept_changes: bool = Field(
        default=False,
        description="Whether to continue although its provenance changed, which is"
        " then recorded in its `provenance`. Otherwise such a job fails and says what has changed.",
        examples=[True],
    )


class PriorityRequest(BaseModel):
    """New priority of a job."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    priority: int = Field(
        ge=LOWEST, le=HIGHEST, description="Higher runs sooner; the default is 0 [1].", examples=[5]
    )


class JobFacetsView(View):
    """Counts of jobs; those without robot, controller or preference count in the total only."""

    total: int = Field(description="Jobs in all [1].", examples=[1000])
    states: dict[str, int] = Field(description="By state [1].", examples=[{"succeeded": 12}])
    robots: dict[str, int] = Field(description="By name of the robot [1].")
    controllers: dict[str, int] = Field(description="By motor controller [1].")
    preferences: dict[str, int] = Field(description="By preference, `own` for any other [1].")
    tags: dict[str, int] = Field(description="By tag [1].", examples=[{"thesis": 3}])

    @classmethod
    def from_counts(cls, counts: FacetCounts) -> JobFacetsView:
        """Make a view of counts."""
        return cls(
            total=counts.total,
            states=counts.states,
            robots=counts.robots,
            controllers=counts.controllers,
            preferences=counts.preferences,
            tags=counts.tags,
        )
