"""A job with another budget: what is committed stays, and what follows is the same every time."""

from __future__ import annotations

import threading

import pytest

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import (
    LARGEST_BUDGET,
    Claim,
    Command,
    Job,
    JobState,
    extended,
)
from gaitswarm.services.optimizer.run.coordinator import (
    Claimed,
    Commit,
    Coordination,
    Evaluate,
    Evaluated,
    Extended,
    handle,
)
from gaitswarm.services.optimizer.run.execution import OnCommit, RunContext, run_claim
from gaitswarm.services.optimizer.store import Store
from tests.examples.jobs import Bits, history
from tests.optimizer.formula import HERE, FormulaEvaluator, job, walk
from tests.optimizer.formula import SPEC as LONGER

SPEC = LONGER.model_copy(update={"iterations": 4})
BUDGET = SPEC.iterations


class CrashError(Exception):
    """The process was killed after a commit."""


def run(store: Store, job_id: str, on_commit: OnCommit | None = None) -> Job:
    claim = store.claim("runner", lease_seconds=30.0, job_id=job_id)
    assert claim is not None
    return run_claim(claim, RunContext(store, FormulaEvaluator(), on_commit=on_commit))


def run_through_crashes(store: Store, job_id: str) -> Job:
    """A life for every iteration."""

    def crash(done: CompletedIteration, state: JobState) -> None:
        raise CrashError

    while not store.job(job_id).state.terminal:
        with pytest.raises(CrashError):
            run(store, job_id, crash)
    return store.job(job_id)


def queued(store: Store) -> str:
    return store.create_job(SPEC)[0].id


def finished(store: Store) -> str:
    job_id = queued(store)
    assert run(store, job_id).state is JobState.SUCCEEDED
    return job_id


def until(found: list[Bits], iterations: int) -> list[Bits]:
    return [row for row in found if row[0] < iterations]


def test_a_job_that_succeeded_continues_from_its_last_iteration(store: Store) -> None:
    job_id = finished(store)
    before = history(store, job_id)
    again = store.extend(job_id, BUDGET + 3)
    assert (again.state, again.finished_at) == (JobState.QUEUED, None)
    assert again.spec.iterations == BUDGET + 3
    done = run(store, job_id)
    assert (done.state, done.progress.iterations) == (JobState.SUCCEEDED, BUDGET + 3)
    after = history(store, job_id)
    assert until(after, BUDGET) == before
    assert len(after) == (BUDGET + 3) * SPEC.optimizer.particles


def test_a_job_that_is_extended_twice_has_the_same_bits_however_often_it_is_killed(
    store: Store,
) -> None:
    whole, killed = finished(store), queued(store)
    run_through_crashes(store, killed)
    for budget in (BUDGET + 1, BUDGET + 5):
        store.extend(whole, budget)
        assert run(store, whole).state is JobState.SUCCEEDED
        store.extend(killed, budget)
        assert run_through_crashes(store, killed).progress.iterations == budget
    assert history(store, killed) == history(store, whole)


def test_a_job_that_is_killed_before_its_first_walk_after_an_extension_has_the_same_bits(
    store: Store,
) -> None:
    whole, killed = finished(store), finished(store)
    for job_id in (whole, killed):
        store.extend(job_id, BUDGET + 2)
    claim = store.claim("runner", lease_seconds=30.0, job_id=killed)
    assert claim is not None and claim.ask is None
    stop = threading.Event()
    stop.set()
    stopped = run_claim(claim, RunContext(store, FormulaEvaluator()), stop)
    assert (stopped.state, stopped.progress.iterations) == (JobState.QUEUED, BUDGET)
    run(store, whole)
    run(store, killed)
    assert history(store, killed) == history(store, whole)


def test_a_running_job_that_is_extended_runs_on_and_so_does_one_that_is_killed_then(
    store: Store,
) -> None:
    unextended, running, killed = finished(store), queued(store), queued(store)

    def extend(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 2:
            store.extend(running, BUDGET + 4)

    def extend_and_crash(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 2:
            store.extend(killed, BUDGET + 4)
            raise CrashError

    assert run(store, running, extend).progress.iterations == BUDGET + 4
    with pytest.raises(CrashError):
        run(store, killed, extend_and_crash)
    assert run_through_crashes(store, killed).progress.iterations == BUDGET + 4
    found = history(store, running)
    assert history(store, killed) == found
    # The iteration that was asked already is as it was; later ones follow the new schedule.
    assert until(found, 4) == until(history(store, unextended), 4)
    assert until(found, 5) != until(history(store, unextended), 5)


def test_a_job_that_is_extended_between_claim_and_first_ask_is_asked_under_the_later_budget(
    store: Store,
) -> None:
    before, between = finished(store), finished(store)
    store.extend(before, BUDGET + 5)
    run(store, before)
    store.extend(between, BUDGET + 1)
    claim = store.claim("runner", lease_seconds=30.0, job_id=between)
    assert claim is not None and claim.ask is None
    store.extend(between, BUDGET + 5)
    done = run_claim(claim, RunContext(store, FormulaEvaluator()))
    assert (done.state, done.progress.iterations) == (JobState.SUCCEEDED, BUDGET + 5)
    assert history(store, between) == history(store, before)


def test_a_running_job_that_is_extended_in_its_last_iteration_does_not_end(store: Store) -> None:
    running, at_once = queued(store), finished(store)

    def extend(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == BUDGET - 2:
            store.extend(running, BUDGET + 2)

    seen = run(store, running, extend)
    assert (seen.state, seen.progress.iterations) == (JobState.SUCCEEDED, BUDGET + 2)
    store.extend(at_once, BUDGET + 2)
    run(store, at_once)
    assert history(store, running) == history(store, at_once)


def test_a_smaller_budget_ends_a_job_earlier(store: Store) -> None:
    job_id = queued(store)

    def shorten(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 1:
            store.extend(job_id, 3)

    done = run(store, job_id, shorten)
    assert (done.state, done.progress.iterations) == (JobState.SUCCEEDED, 3)


def test_a_job_that_pauses_in_the_iteration_in_which_it_is_extended_is_paused(
    store: Store,
) -> None:
    job_id = queued(store)

    def pause(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 1:
            store.command(job_id, Command.PAUSE)
            store.extend(job_id, BUDGET + 1)

    paused = run(store, job_id, pause)
    assert (paused.state, paused.progress.iterations) == (JobState.PAUSED, 3)


def test_the_next_ask_is_repeated_when_the_budget_changed_under_a_commit() -> None:
    state, actions = handle(Coordination(), Claimed(Claim(job(), "runner", 1, None), HERE))
    evaluate = actions[-1]
    assert isinstance(evaluate, Evaluate)
    state, (stale,) = handle(state, Evaluated(walk(evaluate.request), 0.5))
    longer = job(SPEC.model_copy(update={"iterations": 3 * BUDGET}))
    state, (fresh,) = handle(state, Extended(longer))
    assert isinstance(stale, Commit) and isinstance(fresh, Commit)
    assert fresh.done is stale.done
    assert stale.following is not None and fresh.following is not None
    assert fresh.following.iteration == stale.following.iteration == 1
    assert (fresh.following.positions != stale.following.positions).any()


@pytest.mark.parametrize("state", [s for s in JobState if s is not JobState.CANCELLED])
def test_only_a_job_that_has_succeeded_changes_its_state(state: JobState) -> None:
    after = JobState.QUEUED if state is JobState.SUCCEEDED else state
    assert extended(state, 5, 6) is after


def test_a_job_that_was_cancelled_cannot_be_extended() -> None:
    with pytest.raises(Conflict, match="cancelled"):
        extended(JobState.CANCELLED, 5, 6)


@pytest.mark.parametrize("iterations", [-1, 0, 4, 5, LARGEST_BUDGET + 1])
def test_a_spent_or_excessive_budget_is_refused_by_name(iterations: int) -> None:
    with pytest.raises(InvalidRequest, match="it is the total") as refused:
        extended(JobState.PAUSED, 5, iterations)
    assert refused.value.field == "iterations"
