"""Searches in single precision: their best designs are reevaluated in double"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, JobState, Progress
from gaitswarm.services.optimizer.jobs.provenance import with_record
from gaitswarm.services.optimizer.jobs.spec import judge_outcomes
from gaitswarm.services.optimizer.run.coordinator import (
    Begin,
    Claimed,
    Commit,
    Committed,
    Coordination,
    Evaluate,
    Evaluated,
    EvaluatorLost,
    Event,
    Phase,
    Signal,
    Wait,
    handle,
)
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import Outcome, Status
from tests.optimizer.formula import HERE, SINGLE, SPEC, FormulaEvaluator, job, queue, walk
from tests.optimizer.formula import run as run_job

Walks = Callable[[EvaluationRequest], tuple[Outcome, ...]]

IN_SINGLE = HERE.model_copy(
    update={"simulation": HERE.simulation.model_copy(update={"precision": "single"})}
)


class CrashError(Exception):
    """The process was killed."""


@dataclass
class Memory:
    """What a store would keep, and what was asked of the workers."""

    ask: Ask | None = None
    done: list[CompletedIteration] = field(default_factory=list)
    requests: list[EvaluationRequest] = field(default_factory=list)

    def claimed(self) -> Claimed:
        best = min((done.best[1] for done in self.done if done.best is not None), default=None)
        stored = replace(
            job(SINGLE),
            progress=Progress(iterations=len(self.done), best_fitness=best),
            provenance=with_record((), 0, IN_SINGLE),
        )
        return Claimed(Claim(stored, "runner", 1, self.ask), IN_SINGLE)


def run(memory: Memory, walks: Walks = walk, *, crash_before: int | None = None) -> None:
    """Execute actions as the runner does; crash before the so many-th of them."""
    state, actions = handle(Coordination(), memory.claimed())
    executed = 0
    while actions:
        event: Event | None = None
        for action in actions:
            if executed == crash_before:
                raise CrashError
            executed += 1
            match action:
                case Begin(ask=ask):
                    memory.ask = ask
                case Evaluate(request=request):
                    memory.requests.append(request)
                    event = Evaluated(walks(request), 0.5)
                case Commit(done=done, following=following):
                    memory.done.append(done)
                    memory.ask = following
                    event = Committed(JobState.SUCCEEDED if following is None else JobState.RUNNING)
        assert event is not None
        state, actions = handle(state, event)


def precision_of(request: EvaluationRequest) -> str:
    (precision,) = {case.precision for case in request.cases}
    assert request.provenance.precision == precision
    return precision


def falls_in_double(request: EvaluationRequest) -> tuple[Outcome, ...]:
    """Every reevaluated design fails."""
    outcomes = walk(request)
    if precision_of(request) == "single":
        return outcomes
    fell = np.full(len(request.designs), Status.FELL, dtype=np.uint8)
    return tuple(Outcome(np.full_like(o.objectives, np.nan), fell) for o in outcomes)


def better_in_double(request: EvaluationRequest) -> tuple[Outcome, ...]:
    """A reevaluated design is far better than any of single precision."""
    share = 1.0 if precision_of(request) == "single" else 0.01
    return tuple(Outcome(share * o.objectives, o.statuses) for o in walk(request))


def bits(memory: Memory) -> list[tuple[bytes, bytes, bytes]]:
    return [
        (
            done.designs.tobytes(),
            done.fitness.tobytes(),
            b"" if done.reevaluation is None else done.reevaluation.objectives.tobytes(),
        )
        for done in memory.done
    ]


def test_the_swarm_walks_in_single_and_only_new_bests_in_double() -> None:
    memory = Memory()
    run(memory)
    asked = [(precision_of(r), len(r.designs)) for r in memory.requests]
    assert asked.count(("single", 4)) == SINGLE.iterations
    assert set(asked) == {("single", 4), ("double", 1)}
    best = np.inf
    for done in memory.done:
        assert (done.reevaluation is not None) == bool(done.fitness.min() < best)
        if done.best is not None:
            best = min(best, done.best[1])
    assert 1 < asked.count(("double", 1)) < SINGLE.iterations


def test_a_new_best_is_committed_with_its_result_in_double() -> None:
    memory = Memory()
    run(memory)
    first, reevaluation = memory.done[0], memory.done[0].reevaluation
    assert reevaluation is not None
    assert reevaluation.particle == int(np.argmin(first.fitness))
    design = first.designs[reevaluation.particle : reevaluation.particle + 1]
    expected = walk(replace(memory.requests[0], cases=SPEC.cases({}), designs=design))
    np.testing.assert_array_equal(
        reevaluation.objectives, np.concatenate([o.objectives for o in expected])
    )
    assert reevaluation.fitness == judge_outcomes(SPEC, expected).fitness[0]
    assert reevaluation.fitness != first.fitness[reevaluation.particle], (
        "in single it is another number"
    )
    assert first.best == (reevaluation.particle, reevaluation.fitness)
    assert first.evaluate_seconds == 1.0


def test_a_search_in_double_reevaluates_nothing() -> None:
    state, actions = handle(Coordination(), Claimed(Claim(job(), "runner", 1, None), HERE))
    (evaluate,) = [action for action in actions if isinstance(action, Evaluate)]
    _, (commit,) = handle(state, Evaluated(walk(evaluate.request), 0.5))
    assert isinstance(commit, Commit) and commit.done.reevaluation is None
    assert commit.done.best is not None and commit.done.best[1] == commit.done.fitness.min()


def test_the_next_ask_depends_on_the_search_alone() -> None:
    usual, other = Memory(), Memory()
    run(usual)
    run(other, better_in_double)
    for one, same in zip(usual.done, other.done, strict=True):
        np.testing.assert_array_equal(one.designs, same.designs)
        np.testing.assert_array_equal(one.fitness, same.fitness)


def test_a_best_without_a_rival_is_the_only_one_reevaluated() -> None:
    memory = Memory()
    run(memory, better_in_double)
    assert [done.reevaluation is not None for done in memory.done] == [True, *5 * [False]]


def test_a_design_that_falls_in_double_is_no_best_and_the_next_one_is_tried() -> None:
    memory = Memory()
    run(memory, falls_in_double)
    assert all(done.best is None for done in memory.done)
    assert all(done.reevaluation is not None for done in memory.done)
    assert memory.done[0].reevaluation is not None
    assert memory.done[0].reevaluation.fitness == np.inf


def test_a_job_that_crashed_before_any_action_resumes_to_the_same_bits() -> None:
    whole = Memory()
    run(whole)
    actions = len(whole.requests) + len(whole.done) + 1
    for crash_before in range(actions):
        broken = Memory()
        with pytest.raises(CrashError):
            run(broken, crash_before=crash_before)
        run(broken)
        assert bits(broken) == bits(whole), crash_before


def test_lost_workers_repeat_only_the_reevaluation() -> None:
    state, actions = handle(Coordination(), Memory().claimed())
    (evaluate,) = [action for action in actions if isinstance(action, Evaluate)]
    state, (reevaluation,) = handle(state, Evaluated(walk(evaluate.request), 0.5))
    assert state.phase is Phase.REEVALUATING and isinstance(reevaluation, Evaluate)
    state, (wait,) = handle(state, EvaluatorLost("no route to host"))
    assert isinstance(wait, Wait)
    state, (again,) = handle(state, Signal.WAITED)
    assert isinstance(again, Evaluate) and precision_of(again.request) == "double"
    np.testing.assert_array_equal(again.request.designs, reevaluation.request.designs)
    _, (commit,) = handle(state, Evaluated(walk(again.request), 0.5))
    assert isinstance(commit, Commit) and commit.done.reevaluation is not None


def test_the_best_of_a_job_is_what_its_reevaluation_says(store: Store) -> None:
    job_id = queue(store, SINGLE)
    ended = run_job(store, FormulaEvaluator(), provenance=lambda _: IN_SINGLE)
    assert ended.state is JobState.SUCCEEDED
    best, listed = store.best(job_id), store.iterations(job_id).items
    assert best is not None and best.reevaluation is not None
    assert best.reevaluation.fitness == ended.progress.best_fitness == listed[-1].best_so_far
    assert best.reevaluation.particle == best.particle
    (alone,) = [e for e in store.evaluations(job_id, best.iteration) if e.particle == best.particle]
    assert alone.fitness == best.fitness != best.reevaluation.fitness
    np.testing.assert_array_equal(alone.objectives, best.objectives)


def test_a_spec_without_a_precision_is_in_double() -> None:
    document = SPEC.model_dump(mode="json")
    del document["precision"]
    assert SPECS.validate_python(document).precision == "double"
    assert SPEC.in_double() == SPEC == SINGLE.in_double()
