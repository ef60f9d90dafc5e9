"""Jobs, claims, their states, priorities, quotas and references"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, QuotaExceeded, Unreadable
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import Answered, Ask, JournalEntry
from gaitswarm.services.optimizer.jobs.labels import Labels
from gaitswarm.services.optimizer.jobs.provenance import (
    JobProvenance,
    ProvenanceRecords,
    changes_since,
)
from gaitswarm.services.optimizer.views import Finite, View

if TYPE_CHECKING:
    from gaitswarm.sim.identification import Recordings

DEFAULT_PRIORITY: Final = 0

LOWEST_PRIORITY: Final = -10
HIGHEST_PRIORITY: Final = 10


def check_priority(priority: int) -> None:
    """Check that a priority is within bounds."""
    if not LOWEST_PRIORITY <= priority <= HIGHEST_PRIORITY:
        raise InvalidRequest(
            f"must be from {LOWEST_PRIORITY} (last) to {HIGHEST_PRIORITY} (first), it is"
            f" {priority}",
            field="priority",
        )


def weight(priority: int) -> float:
    """Return the weight by which running jobs share slots; it doubles with each step."""
    return 2.0**priority


class Quota(NamedTuple):
    """Limits on the whole budgets of one owner's jobs that have not ended."""

    jobs: int
    seconds: float  # simulated time of all their simulations [s]

    def check(self, jobs: int, seconds: float, *, new_jobs: int, new_seconds: float) -> None:
        """Raise QuotaExceeded if new jobs or simulated time exceed the limits."""
        if new_jobs and jobs + new_jobs > self.jobs:
            raise QuotaExceeded(
                f"{jobs} unfinished jobs of this owner reach the limit of {self.jobs};"
                " wait until one ends, cancel one, or ask an admin"
            )
        if new_seconds > 0.0 and seconds + new_seconds > self.seconds:
            raise QuotaExceeded(
                f"the unfinished jobs of this owner take {seconds:.3g} simulated s, with this one"
                f" {seconds + new_seconds:.3g} s; the limit is {self.seconds:.3g} s. Use fewer"
                " iterations, wait until a job ends, cancel one, or ask an admin",
                field="iterations",
            )


class Submission(TypedDict, total=False):
    """What may accompany a new job; see `Store.create_job`."""

    idempotency_key: str | None
    owner: str | None
    notify_url: str | None
    quota: Quota | None
    priority: int


class JobState(StrEnum):
    """State of a job."""

    QUEUED = "queued"
    RUNNING = "running"
    PAUSING = "pausing"
    PAUSED = "paused"
    CANCELLED = "cancelled"
    FAILED = "failed"
    SUCCEEDED = "succeeded"

    @property
    def terminal(self) -> bool:
        return self in (JobState.CANCELLED, JobState.FAILED, JobState.SUCCEEDED)


ENDED: Final = frozenset(state for state in JobState if state.terminal)
"""States in which a job has ended."""

DELETABLE: Final = ENDED | {JobState.PAUSED}
"""States in which no runner holds the job."""


class Command(StrEnum):
    """A user's command to a job."""

    PAUSE = "pause"
    RESUME = "resume"
    CANCEL = "cancel"


class JobOrder(StrEnum):
    """Sort order of a list of jobs."""

    CREATED = "created"  # newest first
    FITNESS = "fitness"  # best fitness first, jobs without one last
    NAME = "name"  # case-insensitive, unnamed jobs last
    STATE = "state"  # unfinished jobs first
    EVALUATIONS = "evaluations"  # most evaluations first
    GAIN = "gain"  # greatest gain over the published design first, jobs without one last
    PRIORITY = "priority"  # most urgent first
    ITERATIONS = "iterations"  # most committed iterations first
    RATE = "rate"  # most evaluations per second first, jobs without a rate last
    TIME_LEFT = "time_left"  # least time to the end first, jobs with unknown time last


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
"""Transitions by users; the runner's are claim, pause and end."""


def commanded(state: JobState, command: Command) -> JobState:
    """Return the state after a command. Raises Conflict."""
    try:
        return TRANSITIONS[state, command]
    except KeyError:
        possible = [c.value for (s, c) in TRANSITIONS if s is state]
        hint = f"possible now: {', '.join(possible)}" if possible else "it has ended"
        raise Conflict(f"cannot {command} a job that is {state}; {hint}") from None


QUARANTINE_AFTER: Final = 5
"""Consecutive crashes of runner processes before a job is quarantined."""

LONGEST_LEASE_SECONDS: Final = 3600.0
"""Upper bound on leases."""

LARGEST_BUDGET: Final = 1_000_000
"""In iterations, as in a spec."""


def extended(state: JobState, committed: int, iterations: int) -> JobState:
    """Return the state of a job after its budget was changed. Raises Conflict, InvalidRequest."""
    if state is JobState.CANCELLED:
        raise Conflict("cannot extend a cancelled job; submit its spec as a new job")
    if not committed < iterations <= LARGEST_BUDGET:
        raise InvalidRequest(
            f"must exceed the {committed} committed iterations and be at most {LARGEST_BUDGET};"
            " it is the total, not the number to add",
            field="iterations",
        )
    return JobState.QUEUED if state is JobState.SUCCEEDED else state


class Progress(NamedTuple):
    """Committed iterations of a job."""

    iterations: int = 0
    evaluations: int = 0
    best_fitness: float | None = None  # in double precision; None while every design has failed
    best_iteration: int | None = None
    best_particle: int | None = None
    compute_seconds: float = 0.0  # time spent evaluating [s]
    evaluations_saved: int = 0  # designs whose outcome was cached
    infeasible: int = 0  # designs that violate a constraint and have not failed
    least_violation: float | None = None  # as in `Iteration`, of all iterations
    # moving average of the time per design [s], see `recent_pace`; None if unknown
    recent_seconds: float | None = None
    head: str | None = None  # digest of the last iteration; None if there is none

    @property
    def evaluations_walked(self) -> int:
        """Designs simulated for this job."""
        return self.evaluations - self.evaluations_saved


class UnreadableSpec(NamedTuple):
    """What is known of a stored spec that this version cannot read."""

    reason: str  # why it cannot be read
    name: str = ""  # "" if unknown
    iterations: int = 0  # the current budget, 0 if unknown
    particles: int = 0  # 0 if unknown


ReferenceKind = Literal["published", "start", "job", "design"]

GIVEN: Final = "given design"


class Reference(NamedTuple):
    """A design that others are compared with, evaluated in the cases of a job."""

    # study or preference for which it was published, `start design`, a job's id, or `GIVEN`; None
    # if there is none
    name: str | None
    fitness: float | None  # by the job's measure, in double precision; None if it fails in a case
    kind: ReferenceKind = "published"
    results: bytes = b""  # (K, m) raw objectives, NaN where it fails, as little-endian float64

    def objectives(self, cases: int) -> NDArray[np.float64]:
        """Return the (K, m) raw objectives, columns as in the objectives of the job."""
        return np.frombuffer(self.results, "<f8").reshape(cases, -1)

    @property
    def title(self) -> str:
        """The design in a sentence."""
        before = {"published": "published", "job": "the best design of job"}.get(self.kind, "the")
        return f"{before} {self.name}"

    def gain(self, fitness: float | None) -> float | None:
        """Return the relative improvement of a fitness over the reference."""
        if fitness is None or self.fitness is None or not self.fitness > 0.0:
            return None
        return 1.0 - fitness / self.fitness


class ReferenceView(View):
    """The design that a job's best is compared with."""

    name: str = Field(examples=["A"])
    """Study or preference for which it was published, `start design`, the id of a job, or `given
    design`."""
    kind: ReferenceKind = "published"
    """`published`, or without one `start`: the middle of the job's bounds; on request `job`, the
    best design of another one, or `design`."""
    fitness: Finite = Field(examples=[20.72])
    """By the job's measure, in double precision [1]; null if it fails."""

    @classmethod
    def from_reference(cls, reference: Reference | None) -> ReferenceView | None:
        if reference is None or reference.name is None:
            return None
        return cls.model_validate(reference)


@dataclass(frozen=True, slots=True)
class Job:
    """A job as stored; times are UTC."""

    id: str  # twelve letters and digits
    # resolved; its `iterations` are the current budget. An `UnreadableSpec` if this version cannot
    # read it
    stored_spec: AnySpec | UnreadableSpec
    state: JobState
    created_at: datetime
    updated_at: datetime  # time of the last change of state, progress or `waiting`
    started_at: datetime | None = None
    finished_at: datetime | None = None
    error: str | None = None
    progress: Progress = field(default_factory=Progress)
    provenance: ProvenanceRecords = ()  # provenance of the results, by first iteration
    # whether the user has accepted a changed provenance; cleared by the claim
    accepts_changes: bool = False
    lineage: Lineage | None = None  # origin of a fork
    owner: str | None = None
    kept: bool = False
    submitted_iterations: int = 0
    # reason for waiting while running, such as unreachable workers; None if it does not wait
    waiting: str | None = None
    priority: int = 0  # see `priority.py`
    labels: Labels = field(default_factory=Labels)
    archived: bool = False
    reference: Reference | None = None  # None until determined
    evaluated_on: str | None = None  # where the last iteration was simulated; None if unknown

    @property
    def gain(self) -> float | None:
        """Relative improvement of the best design over the reference [1]; None if unknown."""
        if self.reference is None:
            return None
        return self.reference.gain(self.progress.best_fitness)

    @property
    def name(self) -> str:
        """Name set by a label, else the spec's; "" for neither."""
        return self.labels.name or self.stored_spec.name

    @property
    def spec(self) -> AnySpec:
        """The spec. Raises Unreadable."""
        if isinstance(self.stored_spec, UnreadableSpec):
            raise Unreadable(f"job {self.id}: {self.stored_spec.reason}")
        return self.stored_spec

    @property
    def spent(self) -> int:
        """Iterations of the budget that are spent, of `particles` designs each."""
        return math.ceil(self.progress.evaluations / self.spec.optimizer.particles)

    @property
    def own_evaluations(self) -> int:
        """Evaluations without those that a fork has taken over."""
        return self.progress.evaluations - (self.lineage.evaluations if self.lineage else 0)

    @property
    def readable(self) -> bool:
        """Whether this version can read the spec."""
        return not isinstance(self.stored_spec, UnreadableSpec)


def refusal(job: Job, now: JobProvenance) -> str | None:
    """Return why a job requires consent to continue, and how to give it; None if it does not."""
    changes = changes_since(job.provenance, now)
    if not changes:
        return None
    return (
        f"the provenance of its results has changed: {'; '.join(changes)}. Resume it in the"
        " original environment, or accept the change, which is recorded from iteration"
        f" {job.progress.iterations} on: `gaitswarm optimize --resume {job.id} --accept-changes`,"
        f" `gaitswarm resume {job.id} --accept-changes`, `accept_changes=True` in Python, or"
        ' {"accept_changes": true} over HTTP'
    )


@dataclass(frozen=True, slots=True)
class Claim:
    """A lease on a job."""

    job: Job
    runner: str
    token: int  # fencing token: the store rejects writes under an older one
    # the stored ask to continue with; None for a new job or one extended after its budget was spent
    ask: Ask | None
    recordings: Recordings = field(default_factory=dict)
    answered: Answered | None = None  # the last committed ask, if there is no open one
    taken_from: str | None = None  # previous runner, whose lease had expired; None for a queued job
    journal: tuple[JournalEntry, ...] = ()  # what an earlier run has stored of the ask's evaluation


class Renewal(NamedTuple):
    """Result of renewing a claim."""

    state: JobState
    priority: int = 0
