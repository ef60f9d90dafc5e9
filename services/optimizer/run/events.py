"""What the coordinator is told, and what it answers: events and actions of a job's run."""

from __future__ import annotations

from dataclasses import dataclass

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.sim.outcome import Outcome


@dataclass(frozen=True, slots=True)
class Claimed:
    """The job is ours.

    Attributes:
        claim: With the job as it was when it was claimed.
        provenance: What numbers that are computed from here depend on.
        accepts_changes: Whether whoever runs the job goes on although that has changed.
    """

    claim: Claim
    provenance: JobProvenance
    accepts_changes: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Evaluated:
    """The ask was evaluated.

    Attributes:
        outcomes: One per case, of all designs.
        seconds: How long it took [s].
        keys: As in `CompletedIteration`.
    """

    outcomes: tuple[Outcome, ...]
    seconds: float
    keys: tuple[bytes | None, ...] = ()


@dataclass(frozen=True, slots=True)
class EvaluationFailed:
    """The simulation refused the request, or has a bug: trying again would not help.

    Attributes:
        reason: For people.
    """

    reason: str


@dataclass(frozen=True, slots=True)
class EvaluatorLost:
    """The workers could not be reached: trying again may help.

    Attributes:
        reason: For people.
    """

    reason: str


@dataclass(frozen=True, slots=True)
class Waited:
    """The delay is over."""


@dataclass(frozen=True, slots=True)
class Committed:
    """The iteration is stored.

    Attributes:
        state: Of the job after it.
    """

    state: JobState


@dataclass(frozen=True, slots=True)
class Extended:
    """Nothing is stored: the job has another budget, under which what follows is to be asked.

    Attributes:
        job: With that budget.
    """

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
    """Store what the next iterations depend on.

    Attributes:
        provenance: Of the process that runs the job.
    """

    provenance: JobProvenance


@dataclass(frozen=True, slots=True)
class Begin:
    """Store the first ask.

    Attributes:
        ask: What is to be evaluated first.
    """

    ask: Ask


@dataclass(frozen=True, slots=True)
class Evaluate:
    """Run the walks of the stored ask.

    Attributes:
        request: Its designs and cases.
        keys: Of its designs, as `walk_keys` gives them.
    """

    request: EvaluationRequest
    keys: tuple[bytes, ...] = ()


@dataclass(frozen=True, slots=True)
class Commit:
    """Store the iteration and the ask that follows it.

    Attributes:
        done: The iteration, with what it came to.
        following: The next ask; None at the end of the budget.
    """

    done: CompletedIteration
    following: Ask | None


@dataclass(frozen=True, slots=True)
class Wait:
    """Let some time pass.

    Attributes:
        seconds: How long [s].
        reason: Why, for people.
    """

    seconds: float
    reason: str


@dataclass(frozen=True, slots=True)
class Release:
    """Give up the lease.

    Attributes:
        state: In which the job is left.
        error: Why it failed, for people; None if it did not.
    """

    state: JobState
    error: str | None = None


Action = Record | Begin | Evaluate | Commit | Wait | Release


def iteration_of(action: Action) -> int | None:
    """Which iteration an action is about."""
    match action:
        case Begin(ask=ask):
            return ask.iteration
        case Evaluate(request=request):
            return request.iteration
        case Commit(done=done):
            return done.iteration
        case _:
            return None
