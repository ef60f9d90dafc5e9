"""Decisions about a running job: a pure function of (state, event) -> (state, actions).

There is no I/O, clock or thread here; `services.optimizer.run.execution` executes the actions in
order and answers the last one with an event. An action that raises cancels those after it.

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
WAITED                 waiting          Evaluate                     [re]evaluating, as before
EvaluationFailed       [re]evaluating   Release(failed)              ended
PAUSE_SEEN             waiting          Release(queued)              ended
STOP_REQUESTED         any              Release(queued)              ended
LEASE_LOST             any              -                            ended

A new best of a single-precision search is reevaluated in double precision and committed with its
iteration; the next ask does not depend on it.

The store handles a pause during evaluation: the commit then answers `paused`. It also pauses a
pausing job that is released as queued.

Unreachable workers are waited for indefinitely, with pauses that grow up to a limit.

A claim has changed if the provenance differs from that of the job's results, unless the user has
accepted the change.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from enum import StrEnum
from hashlib import blake2b
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.iteration import (
    Answered,
    Ask,
    CompletedIteration,
    EvaluationColumns,
    Reevaluation,
)
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState, refusal
from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec
from gaitswarm.services.optimizer.jobs.preference import by_design
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
from gaitswarm.services.optimizer.jobs.spec import Spec, judge_outcomes
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.services.optimizer.search.optimizer import Optimizer, stored_state
from gaitswarm.sim.identification import Recordings
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.provenance import Provenance


@dataclass(frozen=True, slots=True)
class Claimed:
    """The job was claimed by this process."""

    claim: Claim
    provenance: JobProvenance  # of results computed by this process
    accepts_changes: bool = False  # whether to continue under a changed provenance


@dataclass(frozen=True, slots=True, eq=False)
class Evaluated:
    """The ask was evaluated."""

    outcomes: tuple[Outcome, ...]
    seconds: float  # duration [s]
    keys: tuple[bytes | None, ...] = ()  # see `CompletedIteration`


@dataclass(frozen=True, slots=True)
class EvaluationFailed:
    """The simulation rejected the request or has a bug: a retry would not help."""

    reason: str


@dataclass(frozen=True, slots=True)
class EvaluatorLost:
    """The workers could not be reached: a retry may help."""

    reason: str


@dataclass(frozen=True, slots=True)
class Committed:
    """The iteration is stored; the job is in `state` now."""

    state: JobState


@dataclass(frozen=True, slots=True)
class Extended:
    """Nothing was stored: the job has another budget, under which to ask again."""

    job: Job


class Signal(StrEnum):
    """Event without content."""

    WAITED = "waited"  # the pause is over
    PAUSE_SEEN = "pause seen"  # by a heartbeat: the job is to pause
    STOP_REQUESTED = "stop requested"  # this process is to end; another one continues the job
    LEASE_LOST = "lease lost"  # the job was cancelled, or belongs to another runner


Event = Claimed | Evaluated | EvaluationFailed | EvaluatorLost | Committed | Extended | Signal


@dataclass(frozen=True, slots=True)
class Record:
    """Store the provenance of the next iterations."""

    provenance: JobProvenance


@dataclass(frozen=True, slots=True)
class Begin:
    """Store the first ask."""

    ask: Ask


@dataclass(frozen=True, slots=True)
class Evaluate:
    """Evaluate the stored ask."""

    request: EvaluationRequest
    keys: tuple[bytes, ...] = ()  # of its designs, see `walk_keys`


@dataclass(frozen=True, slots=True)
class Commit:
    """Store the iteration and the next ask."""

    done: CompletedIteration
    following: Ask | None  # None at the end of the budget


@dataclass(frozen=True, slots=True)
class Wait:
    """Pause."""

    seconds: float  # [s]
    reason: str


@dataclass(frozen=True, slots=True)
class Release:
    """Give up the lease."""

    state: JobState  # in which the job is left
    error: str | None = None  # cause of failure, for people; None if it did not fail


Action = Record | Begin | Evaluate | Commit | Wait | Release


def iteration_of(action: Action) -> int | None:
    """Return the iteration that an action concerns."""
    match action:
        case Begin(part) | Evaluate(part) | Commit(part):
            return part.iteration
    return None


KEY_BYTES: Final = 16
"""Among 10^12 different designs, two share a key with a probability of 10^-15."""


def walk_keys(
    spec: Spec, provenance: Provenance | JobProvenance, simulated: NDArray[np.float64]
) -> tuple[bytes, ...]:
    """Return the cache keys of designs' outcomes in all cases of a job.

    A key is a digest of the design by name, the spec without its `outcome_independent_fields`, and
    the provenance.
    """
    names = spec.design_space().names
    order = sorted(range(len(names)), key=names.__getitem__)
    document = spec.model_dump_json(exclude=set(spec.outcome_independent_fields))
    determinants = [document, provenance.model_dump_json(), [names[j] for j in order]]
    common = blake2b(json.dumps(determinants).encode(), digest_size=32).digest()
    rows = np.ascontiguousarray(simulated[:, order])
    return tuple(blake2b(common + row.tobytes(), digest_size=KEY_BYTES).digest() for row in rows)


class Phase(StrEnum):
    """The coordinator's expected event."""

    START = "start"
    EVALUATING = "evaluating"
    REEVALUATING = "reevaluating"
    WAITING = "waiting"
    COMMITTING = "committing"
    ENDED = "ended"


@dataclass(frozen=True, slots=True)
class Coordination:
    """State of one run of one job. Immutable; the stored ask creates the optimizer if needed."""

    backoff: Backoff = field(default_factory=Backoff)
    phase: Phase = Phase.START
    job: Job | None = None
    recordings: Recordings = field(default_factory=dict)
    provenance: JobProvenance | None = None
    answered: Answered | None = None  # the last answered ask, if the claim had no open one
    # of the best committed design, in double precision; +inf if there is none
    best_fitness: float = math.inf
    ask: Ask | None = None
    done: CompletedIteration | None = None  # the evaluated iteration until it is committed
    following: Ask | None = None  # the ask after the commit in progress
    failures: int = 0  # consecutive failures of the workers


Decision = tuple[Coordination, tuple[Action, ...]]


def handle(state: Coordination, event: Event) -> Decision:  # noqa: C901, PLR0911 - the table
    """Return the next state and the actions for an event."""
    match state.phase, event:
        case Phase.ENDED, _:
            return state, ()
        case _, Signal.LEASE_LOST:
            return replace(state, phase=Phase.ENDED), ()
        case (_, Signal.STOP_REQUESTED) | (Phase.WAITING, Signal.PAUSE_SEEN):
            return _release(state, JobState.QUEUED)
        case Phase.START, Claimed():
            return _start(state, event)
        case Phase.EVALUATING, Extended(job=job):
            return _begin(state, job)
        case Phase.EVALUATING, Evaluated():
            return _complete(state, event)
        case Phase.REEVALUATING, Evaluated():
            return _reevaluated(state, event)
        case ((Phase.EVALUATING | Phase.REEVALUATING), EvaluatorLost(reason=reason)):
            failures = state.failures + 1
            wait = Wait(state.backoff.pause(failures), reason)
            return replace(state, phase=Phase.WAITING, failures=failures), (wait,)
        case ((Phase.EVALUATING | Phase.REEVALUATING), EvaluationFailed(reason=reason)):
            return _release(state, JobState.FAILED, reason)
        case Phase.WAITING, Signal.WAITED:
            return _evaluate(state)
        case Phase.COMMITTING, Committed(state=stored):
            return _continue(state, stored)
        case Phase.COMMITTING, Extended(job=job):
            return _commit(replace(state, job=job), _done(state))
        case phase, _:
            name = event if isinstance(event, Signal) else type(event).__name__
            raise ValueError(f"unexpected {name} while {phase}")


def _start(state: Coordination, event: Claimed) -> Decision:
    claim, job = event.claim, event.claim.job
    refused = refusal(job, event.provenance)
    if refused is not None and not (event.accepts_changes or job.accepts_changes):
        return _release(state, JobState.FAILED, refused)
    state = replace(
        state,
        job=job,
        recordings=claim.recordings,
        provenance=event.provenance,
        answered=claim.answered,
        best_fitness=math.inf if job.progress.best_fitness is None else job.progress.best_fitness,
        ask=claim.ask,
    )
    is_recorded = job.provenance and refused is None and not job.accepts_changes
    record = () if is_recorded else (Record(event.provenance),)
    state, actions = _begin(state, job) if claim.ask is None else _evaluate(state)
    return state, (*record, *actions)


def _begin(state: Coordination, job: Job) -> Decision:
    if state.answered is not None:
        first = _following(job.spec, state.answered.ask, state.answered.columns)
    else:
        first = _ask(job.spec, job.spec.create_search())
    if first is None:
        raise ValueError(f"job {job.id} has spent its budget")
    state, actions = _evaluate(replace(state, job=job, ask=first))
    return state, (Begin(first), *actions)


def _evaluate(state: Coordination) -> Decision:
    """Evaluate the ask, or its best design in double precision once the ask is evaluated."""
    job, ask, provenance = _current(state)
    if state.done is None:
        phase, spec = Phase.EVALUATING, job.spec
        designs = spec.design_space().designs(ask.positions)
    else:
        phase, spec = Phase.REEVALUATING, job.spec.in_double()
        best = int(np.argmin(state.done.fitness))
        designs = state.done.designs[best : best + 1]
    request = EvaluationRequest(
        job_id=job.id,
        cases=spec.cases(state.recordings),
        designs=spec.design_space().simulated(designs),
        provenance=provenance.simulation.model_copy(update={"precision": spec.precision}),
        iteration=ask.iteration,
    )
    # The optimum of a preference depends on the code of searches, too.
    determinants = provenance if isinstance(spec, PreferencesSpec) else request.provenance
    keys = walk_keys(spec, determinants, request.designs)
    return replace(state, phase=phase), (Evaluate(request, keys),)


def _complete(state: Coordination, event: Evaluated) -> Decision:
    job, ask, _ = _current(state)
    results = by_design(event.outcomes)
    fitness = job.spec.judge(*results).fitness
    done = CompletedIteration(
        iteration=ask.iteration,
        designs=job.spec.design_space().designs(ask.positions),
        outcomes=event.outcomes,
        fitness=fitness,
        evaluate_seconds=event.seconds,
        precision=job.spec.precision,
        keys=event.keys,
        violations=job.spec.violations(*results),
    )
    state = replace(state, done=done, failures=0)
    if done.precision != "double" and fitness.min() < state.best_fitness:
        return _evaluate(state)
    return _commit(state, done)


def _reevaluated(state: Coordination, event: Evaluated) -> Decision:
    job, _, _ = _current(state)
    done = _done(state)
    reevaluation = Reevaluation(
        particle=int(np.argmin(done.fitness)),
        objectives=np.concatenate([outcome.objectives for outcome in event.outcomes]),
        statuses=np.concatenate([outcome.statuses for outcome in event.outcomes]),
        fitness=float(judge_outcomes(job.spec, event.outcomes).fitness[0]),
    )
    seconds = done.evaluate_seconds + event.seconds
    return _commit(
        replace(state, failures=0),
        done._replace(reevaluation=reevaluation, evaluate_seconds=seconds),
    )


def _commit(state: Coordination, done: CompletedIteration) -> Decision:
    job, ask, _ = _current(state)
    following = _following(job.spec, ask, done.columns)
    state = replace(state, phase=Phase.COMMITTING, done=done, following=following)
    return state, (Commit(done, following),)


def _continue(state: Coordination, stored: JobState) -> Decision:
    if stored is not JobState.RUNNING or state.following is None:
        return replace(state, phase=Phase.ENDED), ()
    best = _done(state).best
    best_fitness = min(state.best_fitness, math.inf if best is None else best[1])
    state = replace(state, ask=state.following, following=None, done=None)
    return _evaluate(replace(state, best_fitness=best_fitness))


def _release(state: Coordination, released: JobState, error: str | None = None) -> Decision:
    return replace(state, phase=Phase.ENDED), (Release(released, error),)


def _following(spec: Spec, ask: Ask, columns: EvaluationColumns) -> Ask | None:
    """Return the ask after an answered one; None at the end of the budget."""
    optimizer = spec.create_search()
    optimizer.load(ask.state)
    optimizer.tell(spec.search_feedback(columns.objectives, columns.failed, columns.fitness))
    return _ask(spec, optimizer)


def _ask(spec: Spec, optimizer: Optimizer) -> Ask | None:
    """Ask for at most the remaining budget; None at its end."""
    left = spec.budget - optimizer.evaluations
    if left <= 0:
        return None
    positions = optimizer.ask(left)
    return Ask(optimizer.iteration, positions, stored_state(optimizer))


def _done(state: Coordination) -> CompletedIteration:
    if state.done is None:
        raise ValueError(f"nothing was evaluated, while {state.phase}")
    return state.done


def _current(state: Coordination) -> tuple[Job, Ask, JobProvenance]:
    if state.job is None or state.ask is None or state.provenance is None:
        raise ValueError(f"no job was claimed, while {state.phase}")
    return state.job, state.ask, state.provenance
