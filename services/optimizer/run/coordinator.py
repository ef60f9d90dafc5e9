"""What happens next in a job: a pure function of (state, event) -> (state, actions).

No I/O, clock or thread is in here; `services.optimizer.run.runner` executes the actions, in order,
and answers the last of them with an event. An action that raises voids those after it.

event                  in phase     actions                        phase after
Claimed                start        [Record, Begin,] Evaluate      evaluating
Claimed(changed)       start        Release(failed)                ended
Extended               evaluating   Begin, Evaluate                evaluating
Evaluated              evaluating   Commit                         committing
Committed(running)     committing   Evaluate                       evaluating
Committed(any other)   committing   -                              ended
Extended               committing   Commit                         committing
EvaluatorLost          evaluating   Wait, or Release(failed)       waiting, or ended
Waited                 waiting      Evaluate                       evaluating
EvaluationFailed       evaluating   Release(failed)                ended
PauseSeen              waiting      Release(queued)                ended
StopRequested          any          Release(queued)                ended
LeaseWasLost           any          -                              ended

A pause that comes while walks are run is the store's to see: the commit then answers `paused`.
The store likewise pauses a pausing job that is released as queued.

A claim has changed if the numbers would depend on something else than those that the job has, and
nobody has accepted that.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from services.optimizer.jobs.iteration import Answered, Ask, CompletedIteration
from services.optimizer.jobs.job import Job, JobState, refusal
from services.optimizer.jobs.provenance import JobProvenance
from services.optimizer.jobs.spec import Spec, create_optimizer, judge_outcomes
from services.optimizer.run.evaluator import EvaluationRequest
from services.optimizer.run.events import (
    Action,
    Begin,
    Claimed,
    Commit,
    Committed,
    Evaluate,
    Evaluated,
    EvaluationFailed,
    EvaluatorLost,
    Event,
    Extended,
    LeaseWasLost,
    PauseSeen,
    Record,
    Release,
    StopRequested,
    Wait,
    Waited,
)
from services.optimizer.search.optimizer import Optimizer
from sim.identification.recorded_walk import Recordings


@dataclass(frozen=True, slots=True)
class Backoff:
    """Exponential backoff: `first` [s], doubled at each attempt up to `longest` [s].

    Attributes:
        first: The first delay [s].
        longest: No delay is longer [s].
        attempts: How often a failure is answered by another try before giving up.
    """

    first: float = 1.0
    longest: float = 60.0
    attempts: int = 8

    def delay(self, failures: int) -> float | None:
        """How long to wait before the next attempt.

        Args:
            failures: In a row, so far (>= 1).

        Returns:
            Seconds to wait; None: give up.
        """
        if failures > self.attempts:
            return None
        # The exponent is bounded, so that a long row of attempts cannot overflow.
        return float(min(self.first * 2.0 ** min(failures - 1, 60), self.longest))


class Phase(StrEnum):
    """What the coordinator waits for."""

    START = "start"
    EVALUATING = "evaluating"
    WAITING = "waiting"
    COMMITTING = "committing"
    ENDED = "ended"


@dataclass(frozen=True, slots=True)
class Coordination:
    """Where one run of one job is. Never changed, only replaced.

    The optimizer is not kept: it is made from the stored ask whenever it is needed, so that going
    on and resuming are one and the same path.

    Attributes:
        backoff: How to wait for workers.
        phase: What is waited for.
        job: As it was last read.
        recordings: Recorded walks that its cases need.
        provenance: What its numbers depend on.
        answered: The last answered ask, where the claim brought no other to go on with.
        ask: What is being evaluated.
        done: Of a commit under way: the iteration.
        following: Of a commit under way: the ask after it.
        failures: Of the workers, in a row.
    """

    backoff: Backoff = field(default_factory=Backoff)
    phase: Phase = Phase.START
    job: Job | None = None
    recordings: Recordings = field(default_factory=dict)
    provenance: JobProvenance | None = None
    answered: Answered | None = None
    ask: Ask | None = None
    done: CompletedIteration | None = None
    following: Ask | None = None
    failures: int = 0


def handle(state: Coordination, event: Event) -> tuple[Coordination, tuple[Action, ...]]:
    """Answer one event.

    Args:
        state: Where the run is.
        event: What has happened.

    Returns:
        Where the run is then, and what is to be done, in order; nothing when it has ended.

    Raises:
        ValueError: The event makes no sense in this phase.
    """
    match state.phase, event:
        case Phase.ENDED, _:
            return state, ()
        case _, LeaseWasLost():
            return replace(state, phase=Phase.ENDED), ()
        case (_, StopRequested()) | (Phase.WAITING, PauseSeen()):
            return _release(state, JobState.QUEUED)
        case _:
            return _proceed(state, event)


def _proceed(state: Coordination, event: Event) -> tuple[Coordination, tuple[Action, ...]]:
    match state.phase, event:
        case Phase.START, Claimed():
            return _start(state, event)
        case Phase.EVALUATING, Extended(job=job):
            return _begin(state, job)
        case Phase.EVALUATING, Evaluated():
            return _complete(state, event)
        case Phase.EVALUATING, EvaluatorLost(reason=reason):
            return _try_again(state, reason)
        case Phase.EVALUATING, EvaluationFailed(reason=reason):
            return _release(state, JobState.FAILED, reason)
        case Phase.WAITING, Waited():
            return replace(state, phase=Phase.EVALUATING), (_evaluate(state),)
        case Phase.COMMITTING, Committed(state=stored):
            return _go_on(state, stored)
        case Phase.COMMITTING, Extended(job=job):
            return _ask_anew(state, job)
        case phase, _:
            raise ValueError(f"{type(event).__name__} makes no sense while {phase}")


def _start(state: Coordination, event: Claimed) -> tuple[Coordination, tuple[Action, ...]]:
    claim, job = event.claim, event.claim.job
    refused = refusal(job, event.provenance)
    if refused is not None and not (event.accepts_changes or job.accepts_changes):
        return _release(state, JobState.FAILED, refused)
    state = replace(
        state,
        phase=Phase.EVALUATING,
        job=job,
        recordings=claim.recordings,
        provenance=event.provenance,
        answered=claim.answered,
        ask=claim.ask,
    )
    is_known = job.provenance and refused is None and not job.accepts_changes
    record = () if is_known else (Record(event.provenance),)
    if claim.ask is not None:
        return state, (*record, _evaluate(state))
    state, actions = _begin(state, job)
    return state, (*record, *actions)


def _begin(state: Coordination, job: Job) -> tuple[Coordination, tuple[Action, ...]]:
    """From the last answered ask if there is one, under the job's present budget."""
    if state.answered is not None:
        first = _following(job.spec, state.answered.ask, state.answered.fitness)
    else:
        first = _ask(create_optimizer(job.spec))
    if first is None:
        raise ValueError(f"job {job.id} has spent its budget")
    state = replace(state, job=job, ask=first)
    return state, (Begin(first), _evaluate(state))


def _complete(state: Coordination, event: Evaluated) -> tuple[Coordination, tuple[Action, ...]]:
    job, ask = _current(state)
    fitness = judge_outcomes(job.spec, event.outcomes).fitness
    following = _following(job.spec, ask, fitness)
    done = CompletedIteration(
        iteration=ask.iteration,
        designs=job.spec.design_space().designs(ask.positions),
        outcomes=event.outcomes,
        fitness=fitness,
        evaluate_seconds=event.seconds,
    )
    state = replace(state, phase=Phase.COMMITTING, done=done, following=following, failures=0)
    return state, (Commit(done, following),)


def _ask_anew(state: Coordination, job: Job) -> tuple[Coordination, tuple[Action, ...]]:
    _, ask = _current(state)
    if state.done is None:
        raise ValueError(f"nothing was evaluated, while {state.phase}")
    following = _following(job.spec, ask, state.done.fitness)
    return replace(state, job=job, following=following), (Commit(state.done, following),)


def _go_on(state: Coordination, stored: JobState) -> tuple[Coordination, tuple[Action, ...]]:
    if stored is not JobState.RUNNING or state.following is None:
        return replace(state, phase=Phase.ENDED), ()
    state = replace(state, phase=Phase.EVALUATING, ask=state.following, following=None, done=None)
    return state, (_evaluate(state),)


def _try_again(state: Coordination, reason: str) -> tuple[Coordination, tuple[Action, ...]]:
    failures = state.failures + 1
    delay = state.backoff.delay(failures)
    if delay is None:
        return _release(
            state,
            JobState.FAILED,
            f"the workers could not be reached in {failures} attempts: {reason};"
            " resume the job when they can",
        )
    return replace(state, phase=Phase.WAITING, failures=failures), (Wait(delay, reason),)


def _release(
    state: Coordination, released: JobState, error: str | None = None
) -> tuple[Coordination, tuple[Action, ...]]:
    return replace(state, phase=Phase.ENDED), (Release(released, error),)


def _evaluate(state: Coordination) -> Evaluate:
    job, ask = _current(state)
    if state.provenance is None:
        raise ValueError(f"no job was claimed, while {state.phase}")
    space = job.spec.design_space()
    return Evaluate(
        EvaluationRequest(
            job_id=job.id,
            cases=job.spec.cases(state.recordings),
            designs=space.simulated(space.designs(ask.positions)),
            provenance=state.provenance.simulation,
        )
    )


def _following(spec: Spec, ask: Ask, fitness: NDArray[np.float64]) -> Ask | None:
    """The ask after one that was answered; None at the end of the budget."""
    optimizer = create_optimizer(spec)
    optimizer.load(ask.state)
    optimizer.tell(fitness)
    return _ask(optimizer) if optimizer.iteration < spec.iterations else None


def _ask(optimizer: Optimizer) -> Ask:
    positions = optimizer.ask()
    return Ask(optimizer.iteration, positions, _as_stored(optimizer.dump()))


def _as_stored(state: dict[str, Any]) -> dict[str, Any]:
    """What the store will give back: a state that JSON would change is found out at once."""
    stored: dict[str, Any] = json.loads(json.dumps(state, allow_nan=False))
    return stored


def _current(state: Coordination) -> tuple[Job, Ask]:
    if state.job is None or state.ask is None:
        raise ValueError(f"no job was claimed, while {state.phase}")
    return state.job, state.ask
