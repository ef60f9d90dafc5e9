"""The coordinator, without a store, workers, clock or threads."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, JobState
from gaitswarm.services.optimizer.jobs.spec import judge_outcomes
from gaitswarm.services.optimizer.run.coordinator import (
    Action,
    Begin,
    Claimed,
    Commit,
    Committed,
    Coordination,
    Evaluate,
    Evaluated,
    EvaluationFailed,
    EvaluatorLost,
    Event,
    Phase,
    Release,
    Signal,
    Wait,
    handle,
)
from gaitswarm.services.optimizer.run.outage import Backoff
from tests.optimizer.formula import HERE, SPEC, job, walk


def claimed(ask: Ask | None = None) -> Claimed:
    return Claimed(Claim(job(), "runner", 1, ask), HERE)


def begin() -> tuple[Coordination, tuple[Action, ...]]:
    return handle(Coordination(backoff=Backoff(first=1.0, longest=4.0)), claimed())


def evaluated(actions: tuple[Action, ...]) -> Evaluated:
    (evaluate,) = [action for action in actions if isinstance(action, Evaluate)]
    return Evaluated(walk(evaluate.request), 0.5)


@dataclass
class Memory:
    """What a store would keep: the asks and the iterations, in order."""

    ask: Ask | None = None
    done: list[CompletedIteration] = field(default_factory=list)


class CrashError(Exception):
    """The process was killed."""


def run(memory: Memory, *, crash_before: int | None = None) -> None:
    """Execute actions as the runner does; crash before the so many-th of them."""
    state, actions = handle(Coordination(), claimed(memory.ask))
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
                    event = Evaluated(walk(request), 0.5)
                case Commit(done=done, following=following):
                    memory.done.append(done)
                    memory.ask = following
                    event = Committed(JobState.SUCCEEDED if following is None else JobState.RUNNING)
        assert event is not None
        state, actions = handle(state, event)


def bits(memory: Memory) -> list[tuple[int, bytes, bytes, bytes]]:
    return [
        (
            done.iteration,
            done.designs.tobytes(),
            done.fitness.tobytes(),
            b"".join(outcome.objectives.tobytes() for outcome in done.outcomes),
        )
        for done in memory.done
    ]


def test_a_job_runs_through_its_budget_and_ends() -> None:
    memory = Memory()
    run(memory)
    assert [done.iteration for done in memory.done] == list(range(SPEC.iterations))
    assert memory.ask is None


def test_the_ask_is_stored_before_it_is_sent_out() -> None:
    _, actions = begin()
    assert [type(action) for action in actions] == [Begin, Evaluate]
    first, sent = actions
    assert isinstance(first, Begin) and isinstance(sent, Evaluate)
    np.testing.assert_array_equal(
        sent.request.designs, SPEC.design_space().designs(first.ask.positions)
    )
    assert sent.request.cases == SPEC.cases({})
    assert sent.request.iteration == first.ask.iteration == 0


@pytest.mark.parametrize("crash_before", range(2 * SPEC.iterations + 1))
def test_a_job_that_crashed_before_any_action_resumes_to_the_same_bits(crash_before: int) -> None:
    whole, broken = Memory(), Memory()
    run(whole)
    with pytest.raises(CrashError):
        run(broken, crash_before=crash_before)
    run(broken)
    assert bits(broken) == bits(whole)


def test_a_job_that_crashes_at_every_step_resumes_to_the_same_bits() -> None:
    whole, broken = Memory(), Memory()
    run(whole)
    crashes = 0
    while len(broken.done) < SPEC.iterations:
        try:
            # Two actions a life, the first of which repeats what the last life did not commit.
            run(broken, crash_before=2)
        except CrashError:
            crashes += 1
    assert crashes >= SPEC.iterations - 1
    assert bits(broken) == bits(whole)


def test_the_committed_fitness_is_by_the_preference() -> None:
    state, actions = begin()
    event = evaluated(actions)
    _, (commit,) = handle(state, event)
    assert isinstance(commit, Commit)
    expected = judge_outcomes(SPEC, event.outcomes).fitness
    np.testing.assert_array_equal(commit.done.fitness, expected)
    assert commit.done.evaluate_seconds == 0.5
    assert commit.following is not None and commit.following.iteration == 1


def test_a_pause_takes_effect_when_the_iteration_is_committed() -> None:
    state, actions = begin()
    state, _ = handle(state, evaluated(actions))
    state, actions = handle(state, Committed(JobState.PAUSED))
    assert (state.phase, actions) == (Phase.ENDED, ())


def test_unreachable_workers_are_retried_indefinitely_after_growing_bounded_pauses() -> None:
    state, _ = begin()
    delays = []
    for _ in range(100):
        state, (wait,) = handle(state, EvaluatorLost("no route to host"))
        assert isinstance(wait, Wait) and wait.reason == "no route to host"
        delays.append(wait.seconds)
        state, (again,) = handle(state, Signal.WAITED)
        assert isinstance(again, Evaluate)
    assert delays[:4] == [1.0, 2.0, 4.0, 4.0]
    assert set(delays[4:]) == {4.0}


def test_a_successful_iteration_resets_the_pauses() -> None:
    state, actions = begin()
    state, _ = handle(state, EvaluatorLost("gone"))
    state, actions = handle(state, Signal.WAITED)
    state, _ = handle(state, evaluated(actions))
    state, _ = handle(state, Committed(JobState.RUNNING))
    _, (wait,) = handle(state, EvaluatorLost("gone"))
    assert isinstance(wait, Wait) and wait.seconds == 1.0


def test_a_pause_does_not_wait_for_workers() -> None:
    state, _ = begin()
    state, _ = handle(state, EvaluatorLost("gone"))
    _, actions = handle(state, Signal.PAUSE_SEEN)
    # The store pauses a pausing job that is given back.
    assert actions == (Release(JobState.QUEUED),)


def test_a_failed_simulation_fails_the_job_with_its_reason() -> None:
    state, _ = begin()
    state, actions = handle(state, EvaluationFailed("torque table: broken"))
    assert actions == (Release(JobState.FAILED, "torque table: broken"),)
    assert state.phase is Phase.ENDED


def test_a_stop_returns_the_job_to_the_queue() -> None:
    state, _ = begin()
    assert handle(state, Signal.STOP_REQUESTED)[1] == (Release(JobState.QUEUED),)


def test_after_the_lease_is_lost_nothing_is_written() -> None:
    state, actions = begin()
    late = evaluated(actions)
    state, actions = handle(state, Signal.LEASE_LOST)
    assert actions == ()
    assert handle(state, late) == (state, ())


def test_an_unexpected_event_is_refused() -> None:
    state, _ = begin()
    with pytest.raises(ValueError, match="unexpected Committed while evaluating"):
        handle(state, Committed(JobState.RUNNING))
