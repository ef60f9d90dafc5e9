"""Jobs and what is remembered of them: the domain objects of the service."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Final

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, Unreadable
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import Answered, Ask
from gaitswarm.services.optimizer.jobs.labels import Labels
from gaitswarm.services.optimizer.jobs.provenance import (
    JobProvenance,
    ProvenanceRecords,
    changes_since,
)
from gaitswarm.services.optimizer.jobs.reference import Reference
from gaitswarm.sim.identification.recorded_walk import Recordings


class JobState(StrEnum):
    """Where a job is in its life."""

    QUEUED = "queued"
    RUNNING = "running"
    PAUSING = "pausing"
    PAUSED = "paused"
    CANCELLED = "cancelled"
    FAILED = "failed"
    SUCCEEDED = "succeeded"

    @property
    def terminal(self) -> bool:
        """Nothing more happens to it by itself."""
        return self in (JobState.CANCELLED, JobState.FAILED, JobState.SUCCEEDED)


ENDED: Final = frozenset(state for state in JobState if state.terminal)
"""The states in which nothing more happens to a job by itself."""


DELETABLE: Final = ENDED | {JobState.PAUSED}
"""The states in which nobody works at a job."""


class Command(StrEnum):
    """What a user may ask of a job."""

    PAUSE = "pause"
    RESUME = "resume"
    CANCEL = "cancel"


class JobOrder(StrEnum):
    """How a list of jobs is sorted."""

    CREATED = "created"
    """Newest first."""
    FITNESS = "fitness"
    """Best fitness first, jobs without one last."""
    NAME = "name"
    """By name whatever its case, jobs without one last."""
    STATE = "state"
    """Those that wait or run first, then those that have ended."""
    EVALUATIONS = "evaluations"
    """Most evaluations first."""
    GAIN = "gain"
    """Greatest gain over the published design first, jobs without one last."""
    PRIORITY = "priority"
    """Most urgent first."""
    ITERATIONS = "iterations"
    """Most committed iterations first."""
    RATE = "rate"
    """Most evaluations a second first, jobs without one last."""
    TIME_LEFT = "time_left"
    """Those that end soonest first, jobs of which that is not known last."""


TRANSITIONS: Final[dict[tuple[JobState, Command], JobState]] = {
    (JobState.QUEUED, Command.PAUSE): JobState.PAUSED,
    (JobState.RUNNING, Command.PAUSE): JobState.PAUSING,
    (JobState.PAUSED, Command.RESUME): JobState.QUEUED,
    (JobState.PAUSING, Command.RESUME): JobState.RUNNING,
    (JobState.FAILED, Command.RESUME): JobState.QUEUED,
    (JobState.QUEUED, Command.CANCEL): JobState.CANCELLED,
    (JobState.RUNNING, Command.CANCEL): JobState.CANCELLED,
    (JobState.PAUSING, Command.CANCEL): JobState.CANCELLED,
    (JobState.PAUSED, Command.CANCEL): JobState.CANCELLED,
    (JobState.FAILED, Command.CANCEL): JobState.CANCELLED,
}
"""Every transition that a user can ask for; the runner's own are claim, pause, end."""


def commanded(state: JobState, command: Command) -> JobState:
    """The state after a command."""
    try:
        return TRANSITIONS[state, command]
    except KeyError:
        possible = [c.value for (s, c) in TRANSITIONS if s is state]
        hint = f"possible now: {', '.join(possible)}" if possible else "it has ended"
        raise Conflict(f"cannot {command} a job that is {state}; {hint}") from None


QUARANTINE_AFTER: Final = 5
"""Runner processes in a row that go down with a job before it is quarantined."""

LONGEST_LEASE_SECONDS: Final = 3600.0
"""No lease lasts longer; one that ends later was written by a clock that is wrong."""

LARGEST_BUDGET: Final = 1_000_000
"""Iterations, as in a spec."""


def extended(state: JobState, committed: int, iterations: int) -> JobState:
    """The state of a job after it got another budget."""
    if state is JobState.CANCELLED:
        raise Conflict("cannot extend a job that is cancelled; submit its spec as a new one")
    if not committed < iterations <= LARGEST_BUDGET:
        raise InvalidRequest(
            f"must be more than the {committed} that the job has committed, and at most"
            f" {LARGEST_BUDGET}; it is the number in all, not of further ones",
            field="iterations",
        )
    return JobState.QUEUED if state is JobState.SUCCEEDED else state


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a job is, by its committed iterations.

    Attributes:
        iterations: how many there are.
        evaluations: designs judged in them.
        best_fitness: least fitness so far, in double precision; None while every design has failed.
        best_iteration: iteration that found it.
        best_particle: particle that found it.
        compute_seconds: time that evaluating them took [s].
        evaluations_saved: of the designs, those whose outcome was known without a walk.
        recent_seconds: that a design took in the last iterations, as `recent_pace` weighs them [s];
            None if that was not noted.
        head: digest of the last iteration; None where there is none.
    """

    iterations: int = 0
    evaluations: int = 0
    best_fitness: float | None = None
    best_iteration: int | None = None
    best_particle: int | None = None
    compute_seconds: float = 0.0
    evaluations_saved: int = 0
    recent_seconds: float | None = None
    head: str | None = None

    @property
    def evaluations_walked(self) -> int:
        """Designs that walked for this job."""
        return self.evaluations - self.evaluations_saved


@dataclass(frozen=True, slots=True)
class UnreadableSpec:
    """What can be said of a spec that this version cannot read; the stored one stays as it is.

    Attributes:
        reason: What cannot be read.
        name: Of the job, "" if that is not known either.
        iterations: The present budget, 0 if it is not known.
        particles: Size of the swarm, 0 if it is not known.
    """

    reason: str
    name: str = ""
    iterations: int = 0
    particles: int = 0


@dataclass(frozen=True, slots=True)
class Job:
    """A job as stored; times are UTC.

    Attributes:
        id: twelve letters and digits.
        stored_spec: resolved, as `Spec.resolved` has it; its `iterations` are the present budget.
            An `UnreadableSpec` if this version cannot read it.
        state: where it is in its life.
        created_at: when it was submitted.
        updated_at: when its state or progress last changed.
        started_at: when it was first claimed.
        finished_at: when it ended.
        error: why it failed.
        progress: how far it is.
        provenance: what its numbers depend on, since which iteration.
        accepts_changes: whether its user has said that it may go on although that has changed;
            until it is claimed.
        lineage: where it comes from, if it was forked from another job.
        owner: name of the token that it was submitted with, if any.
        kept: whether it is protected from deletion.
        submitted_iterations: budget that it was submitted with.
        waiting: what it waits for while it runs, such as workers that are away; None if nothing.
        priority: the higher, the sooner it is claimed and the more slots its walks get; see
            `priority.py`.
        labels: what people have written on it.
        archived: whether it is out of the way in lists.
        reference: what its best is measured against; None while nobody has found that out.
    """

    id: str
    stored_spec: AnySpec | UnreadableSpec
    state: JobState
    created_at: datetime
    updated_at: datetime
    started_at: datetime | None = None
    finished_at: datetime | None = None
    error: str | None = None
    progress: Progress = field(default_factory=Progress)
    provenance: ProvenanceRecords = ()
    accepts_changes: bool = False
    lineage: Lineage | None = None
    owner: str | None = None
    kept: bool = False
    submitted_iterations: int = 0
    waiting: str | None = None
    priority: int = 0
    labels: Labels = field(default_factory=Labels)
    archived: bool = False
    reference: Reference | None = None

    @property
    def gain(self) -> float | None:
        """By which share its best is better than its reference [1]; None if not known."""
        if self.reference is None:
            return None
        return self.reference.gain(self.progress.best_fitness)

    @property
    def name(self) -> str:
        """What it is called: by its user since, or else by its spec; "" for neither."""
        return self.labels.name or self.stored_spec.name

    @property
    def spec(self) -> AnySpec:
        """The spec of a job that can be read."""
        if isinstance(self.stored_spec, UnreadableSpec):
            raise Unreadable(f"job {self.id}: {self.stored_spec.reason}")
        return self.stored_spec

    @property
    def spent(self) -> int:
        """Iterations of its budget that are spent: whole ones of `particles` designs each."""
        return math.ceil(self.progress.evaluations / self.spec.optimizer.particles)

    @property
    def own_evaluations(self) -> int:
        """Designs that were judged for it; a fork has taken over the others."""
        return self.progress.evaluations - (self.lineage.evaluations if self.lineage else 0)

    @property
    def readable(self) -> bool:
        """Whether this version can read the spec."""
        return not isinstance(self.stored_spec, UnreadableSpec)


def refusal(job: Job, now: JobProvenance) -> str | None:
    """Why a job must not go on without its user's consent, and how it does with it."""
    changes = changes_since(job.provenance, now)
    if not changes:
        return None
    return (
        f"what its numbers depend on is not what it was: {'; '.join(changes)}. Resume it where that"
        f" is as before, or accept the change: `gaitswarm optimize --resume {job.id}"
        f" --accept-changes`, `gaitswarm resume {job.id} --accept-changes`, `accept_changes=True`"
        ' in Python, or {"accept_changes": true} over HTTP'
        f" goes on and records it from iteration {job.progress.iterations} on"
    )


@dataclass(frozen=True, slots=True)
class Claim:
    """A lease on a job.

    Attributes:
        job: as it was when it was claimed.
        runner: name of who holds it.
        token: fences: a store refuses writes under an older one.
        ask: the stored one to go on with; None for a job that has not begun, or was extended after
            its budget was spent.
        recordings: those that the job's spec names, by id.
        answered: the last committed one, where there is no other to go on with.
        taken_from: name of another runner whose lease had run out; None for a job that was queued.
    """

    job: Job
    runner: str
    token: int
    ask: Ask | None
    recordings: Recordings = field(default_factory=dict)
    answered: Answered | None = None
    taken_from: str | None = None


@dataclass(frozen=True, slots=True)
class Renewal:
    """What a runner hears when it renews its claim on a job.

    Attributes:
        state: of the job, so that a pause is seen.
        priority: of the job, which its user may have changed.
    """

    state: JobState
    priority: int = 0
