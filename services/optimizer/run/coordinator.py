"""What happens next in a job: a pure function of (state, event) -> (state, actions).

No I/O, clock or thread is in here; `services.optimizer.run.execution` executes the actions, in
order, and answers the last of them with an event. An action that raises voids those after it.

event                  in phase         actions                      phase after
Claimed                start            [Record, Begin,] Evaluate    evaluating
Claimed(changed)       start            Release(failed)              ended
Extended               evaluating       Begin, Evaluate              evaluating
Evaluated              evaluating       Commit                       committing
Evaluated(new best)    evaluating       Evaluate                     reevaluating
Evaluated              reevaluating     Commit                       committing
Committed(running)     committing       Evaluate                     evaluating
Committed(any other)   committing       -                            ended
Extended               committing       Commit                       committing
EvaluatorLost          [re]evaluating   Wait                         waiting
Waited                 waiting          Evaluate                     [re]evaluating, as before
EvaluationFailed       [re]evaluating   Release(failed)              ended
PauseSeen              waiting          Release(queued)              ended
StopRequested          any              Release(queued)              ended
LeaseWasLost           any              -                            ended

A new best is reevaluated where the search is in single precision: what is reported as best is
judged in double. It is committed with its iteration; what is asked next does not depend on it.

A pause that comes while walks are run is the store's to see: the commit then answers `paused`.
The store likewise pauses a pausing job that is released as queued.

Workers that are away are waited for without end, after pauses that grow to a bound.

A claim has changed if the numbers would depend on something else than those that the job has, and
nobody has accepted that.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from enum import StrEnum
from hashlib import blake2b
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.iteration import (
    Answered,
    Ask,
    CompletedIteration,
    Reevaluation,
)
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState, refusal
from gaitswarm.services.optimizer.jobs.judgement import by_design
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
from gaitswarm.services.optimizer.jobs.spec import Spec, judge_outcomes
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.services.optimizer.search.optimizer import Optimizer
from gaitswarm.sim.identification.recorded_walk import Recordings
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.provenance import Provenance


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


KEY_BYTES: Final = 16
"""Of 10^12 different designs, two have the same key with a chance of 10^-15."""


def walk_keys(
    spec: Spec, provenance: Provenance, simulated: NDArray[np.float64]
) -> tuple[bytes, ...]:
    """Name the outcomes of designs in all cases of a job.

    A key is a digest of all that an outcome depends on: the simulated design by name, the spec
    without its `outcome_independent_fields`, and the provenance. It depends neither on the order of
    variables nor on whether a variable is searched or fixed.
    """
    names = spec.design_space().names
    order = sorted(range(len(names)), key=names.__getitem__)
    document = spec.model_dump_json(exclude=set(spec.outcome_independent_fields))
    walked = [document, provenance.model_dump_json(), [names[j] for j in order]]
    common = blake2b(json.dumps(walked).encode(), digest_size=32).digest()
    rows = np.ascontiguousarray(simulated[:, order])
    return tuple(blake2b(common + row.tobytes(), digest_size=KEY_BYTES).digest() for row in rows)


class Phase(StrEnum):
    """What the coordinator waits for."""

    START = "start"
    EVALUATING = "evaluating"
    REEVALUATING = "reevaluating"
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
        best_fitness: Of the best committed design, in double precision; +inf if there is none.
        evaluations: Designs judged in committed iterations.
        ask: What is being evaluated.
        done: The iteration, once its ask is evaluated and until it is committed.
        following: Of a commit under way: the ask after it.
        failures: Of the workers, in a row.
    """

    backoff: Backoff = field(default_factory=Backoff)
    phase: Phase = Phase.START
    job: Job | None = None
    recordings: Recordings = field(default_factory=dict)
    provenance: JobProvenance | None = None
    answered: Answered | None = None
    best_fitness: float = math.inf
    evaluations: int = 0
    ask: Ask | None = None
    done: CompletedIteration | None = None
    following: Ask | None = None
    failures: int = 0


def handle(state: Coordination, event: Event) -> tuple[Coordination, tuple[Action, ...]]:
    """Answer one event."""
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
        case Phase.EVALUATING | Phase.REEVALUATING, (
            Evaluated() | EvaluatorLost() | EvaluationFailed()
        ):
            return _answer(state, event)
        case Phase.WAITING, Waited():
            return _walk(state)
        case Phase.COMMITTING, Committed(state=stored):
            return _go_on(state, stored)
        case Phase.COMMITTING, Extended(job=job):
            return _ask_anew(state, job)
        case phase, _:
            raise ValueError(f"{type(event).__name__} makes no sense while {phase}")


def _answer(
    state: Coordination, event: Evaluated | EvaluatorLost | EvaluationFailed
) -> tuple[Coordination, tuple[Action, ...]]:
    match event:
        case EvaluatorLost(reason=reason):
            return _try_again(state, reason)
        case EvaluationFailed(reason=reason):
            return _release(state, JobState.FAILED, reason)
        case Evaluated() if state.phase is Phase.REEVALUATING:
            return _reevaluated(state, event)
        case Evaluated():
            return _complete(state, event)


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
        best_fitness=math.inf if job.progress.best_fitness is None else job.progress.best_fitness,
        evaluations=job.progress.evaluations,
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
        came = state.answered.columns
        told = job.spec.search_feedback(came.objectives, came.failed, came.fitness)
        first = _following(job.spec, state.answered.ask, told)
    else:
        first = _ask(job.spec, job.spec.create_search())
    if first is None:
        raise ValueError(f"job {job.id} has spent its budget")
    state = replace(state, job=job, ask=first)
    return state, (Begin(first), _evaluate(state))


def _complete(state: Coordination, event: Evaluated) -> tuple[Coordination, tuple[Action, ...]]:
    job, ask = _current(state)
    fitness = judge_outcomes(job.spec, event.outcomes).fitness
    done = CompletedIteration(
        iteration=ask.iteration,
        designs=job.spec.design_space().designs(ask.positions),
        outcomes=event.outcomes,
        fitness=fitness,
        evaluate_seconds=event.seconds,
        precision=job.spec.precision,
        keys=event.keys,
    )
    state = replace(state, done=done, failures=0)
    if done.precision != "double" and fitness.min() < state.best_fitness:
        return _walk(state)
    return _commit(state, done)


def _reevaluated(state: Coordination, event: Evaluated) -> tuple[Coordination, tuple[Action, ...]]:
    job, _ = _current(state)
    done = _done(state)
    anew = Reevaluation(
        particle=int(np.argmin(done.fitness)),
        objectives=np.concatenate([outcome.objectives for outcome in event.outcomes]),
        statuses=np.concatenate([outcome.statuses for outcome in event.outcomes]),
        fitness=float(judge_outcomes(job.spec, event.outcomes).fitness[0]),
    )
    seconds = done.evaluate_seconds + event.seconds
    return _commit(
        replace(state, failures=0), replace(done, reevaluation=anew, evaluate_seconds=seconds)
    )


def _commit(
    state: Coordination, done: CompletedIteration
) -> tuple[Coordination, tuple[Action, ...]]:
    job, ask = _current(state)
    told = job.spec.search_feedback(*by_design(done.outcomes), done.fitness)
    following = _following(job.spec, ask, told)
    state = replace(state, phase=Phase.COMMITTING, done=done, following=following)
    return state, (Commit(done, following),)


def _ask_anew(state: Coordination, job: Job) -> tuple[Coordination, tuple[Action, ...]]:
    return _commit(replace(state, job=job), _done(state))


def _go_on(state: Coordination, stored: JobState) -> tuple[Coordination, tuple[Action, ...]]:
    if stored is not JobState.RUNNING or state.following is None:
        return replace(state, phase=Phase.ENDED), ()
    found = _done(state).best
    state = replace(
        state,
        best_fitness=min(state.best_fitness, math.inf if found is None else found[1]),
        evaluations=state.evaluations + len(_done(state).fitness),
        ask=state.following,
        following=None,
        done=None,
    )
    return _walk(state)


def _walk(state: Coordination) -> tuple[Coordination, tuple[Action, ...]]:
    """Have the ask evaluated, or what is done of it reevaluated."""
    if state.done is None:
        return replace(state, phase=Phase.EVALUATING), (_evaluate(state),)
    return replace(state, phase=Phase.REEVALUATING), (_reevaluate(state, state.done),)


def _try_again(state: Coordination, reason: str) -> tuple[Coordination, tuple[Action, ...]]:
    failures = state.failures + 1
    wait = Wait(state.backoff.pause(failures), reason)
    return replace(state, phase=Phase.WAITING, failures=failures), (wait,)


def _release(
    state: Coordination, released: JobState, error: str | None = None
) -> tuple[Coordination, tuple[Action, ...]]:
    return replace(state, phase=Phase.ENDED), (Release(released, error),)


def _evaluate(state: Coordination) -> Evaluate:
    job, ask = _current(state)
    return _walks_of(state, job.spec, job.spec.design_space().designs(ask.positions))


def _reevaluate(state: Coordination, done: CompletedIteration) -> Evaluate:
    """The best design of the iteration, in double precision."""
    job, _ = _current(state)
    best = int(np.argmin(done.fitness))
    return _walks_of(state, job.spec.in_double(), done.designs[best : best + 1])


def _walks_of(state: Coordination, spec: Spec, designs: NDArray[np.float64]) -> Evaluate:
    job, ask = _current(state)
    if state.provenance is None:
        raise ValueError(f"no job was claimed, while {state.phase}")
    asked = len(ask.positions)
    request = EvaluationRequest(
        job_id=job.id,
        cases=spec.cases(state.recordings),
        designs=spec.design_space().simulated(designs),
        provenance=state.provenance.simulation.model_copy(update={"precision": spec.precision}),
        # As many as there are if the next ones are as large as this one.
        iteration=ask.iteration,
        iterations_left=max(0, -(-(spec.budget - state.evaluations - asked) // asked)),
    )
    return Evaluate(request, walk_keys(spec, request.provenance, request.designs))


def _following(spec: Spec, ask: Ask, told: NDArray[np.float64]) -> Ask | None:
    """The ask after one that was answered; None at the end of the budget."""
    optimizer = spec.create_search()
    optimizer.load(ask.state)
    optimizer.tell(told)
    return _ask(spec, optimizer)


def _ask(spec: Spec, optimizer: Optimizer) -> Ask | None:
    """At most what is left of the budget; None at its end."""
    left = spec.budget - optimizer.evaluations
    if left <= 0:
        return None
    positions = optimizer.ask(left)
    return Ask(optimizer.iteration, positions, _as_stored(optimizer.dump()))


def _as_stored(state: dict[str, Any]) -> dict[str, Any]:
    """What the store will give back: a state that JSON would change is found out at once."""
    stored: dict[str, Any] = json.loads(json.dumps(state, allow_nan=False))
    return stored


def _done(state: Coordination) -> CompletedIteration:
    if state.done is None:
        raise ValueError(f"nothing was evaluated, while {state.phase}")
    return state.done


def _current(state: Coordination) -> tuple[Job, Ask]:
    if state.job is None or state.ask is None:
        raise ValueError(f"no job was claimed, while {state.phase}")
    return state.job, state.ask
