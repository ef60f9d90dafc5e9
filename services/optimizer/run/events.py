"""What the coordinator is told, and what it answers: events and actions of a job's run."""

from __future__ import annotations

from dataclasses import dataclass

from services.optimizer.jobs.job import Ask, Claim, CompletedIteration, Job, JobState
from services.optimizer.jobs.provenance import JobProvenance
from services.optimizer.run.evaluator import EvaluationRequest
from sim.outcome import Outcome


@dataclass(frozen=True, slots=True)
class Claimed:
    """The job is ours.

    provenance: what numbers that are computed from here depend on. accepts_changes: whether whoever
        runs the job goes on although that has changed.
    """

    claim: Claim
    provenance: JobProvenance
    accepts_changes: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Evaluated:
    """The ask was evaluated. outcomes: one per case; seconds: how long it took."""

    outcomes: tuple[Outcome, ...]
    seconds: float


@dataclass(frozen=True, slots=True)
class EvaluationFailed:
    """The simulation refused the request, or has a bug: trying again would not help."""

    reason: str


@dataclass(frozen=True, slots=True)
class EvaluatorLost:
    """The workers could not be reached: trying again may help."""

    reason: str


@dataclass(frozen=True, slots=True)
class Waited:
    """The delay is over."""


@dataclass(frozen=True, slots=True)
class Committed:
    """The iteration is stored. state: the job's state after it."""

    state: JobState


@dataclass(frozen=True, slots=True)
class Extended:
    """Nothing is stored: the job has another budget, under which what follows is to be asked."""

    job: Job


@dataclass(frozen=True, slots=True)
class PauseSeen:
    """A heartbeat saw that the job is to pause."""


@dataclass(frozen=True, slots=True)
class StopRequested:
    """This process is to end; the job is to go on elsewhere."""


@dataclass(frozen=True, slots=True)
class LeaseWasLost:
    """The job was cancelled, or belongs to another runner."""


Event = (
    Claimed
    | Evaluated
    | EvaluationFailed
    | EvaluatorLost
    | Waited
    | Committed
    | Extended
    | PauseSeen
    | StopRequested
    | LeaseWasLost
)


@dataclass(frozen=True, slots=True)
class Record:
    """Store what the next iterations depend on."""

    provenance: JobProvenance


@dataclass(frozen=True, slots=True)
class Begin:
    """Store the first ask."""

    ask: Ask


@dataclass(frozen=True, slots=True)
class Evaluate:
    """Run the walks of the stored ask."""

    request: EvaluationRequest


@dataclass(frozen=True, slots=True)
class Commit:
    """Store the iteration and the ask that follows it, None at the end of the budget."""

    done: CompletedIteration
    following: Ask | None


@dataclass(frozen=True, slots=True)
class Wait:
    """Let this many seconds pass."""

    seconds: float
    reason: str


@dataclass(frozen=True, slots=True)
class Release:
    """Give up the lease."""

    state: JobState
    error: str | None = None


Action = Record | Begin | Evaluate | Commit | Wait | Release
