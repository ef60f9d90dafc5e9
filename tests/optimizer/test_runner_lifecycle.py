"""A process's share of the queue: jobs side by side, a runner's end, what it says of itself."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from typing import cast

import pytest

from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.run.runner import STUCK_SECONDS, Runner
from gaitswarm.services.optimizer.store import Store
from tests.examples.jobs import history
from tests.examples.processes import eventually
from tests.optimizer.formula import SPEC, FormulaEvaluator, queue, run


def test_a_runner_runs_jobs_side_by_side_to_the_bits_of_jobs_run_alone(store: Store) -> None:
    specs = [SPEC, SPEC.model_copy(update={"seed": 12, "iterations": 9})]
    alone = []
    for spec in specs:
        job_id = queue(store, spec)
        run(store, FormulaEvaluator())
        alone.append(history(store, job_id))
    together = [queue(store, spec) for spec in specs]
    runner = Runner(store, FormulaEvaluator(), concurrency=2, poll_seconds=0.01)
    runner.start()
    eventually(lambda: all(store.job(j).state is JobState.SUCCEEDED for j in together))
    runner.stop()
    assert [history(store, job_id) for job_id in together] == alone


def test_a_runner_that_stops_returns_its_jobs_at_once(store: Store) -> None:
    jobs = [queue(store), queue(store), queue(store)]
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    runner = Runner(store, evaluator, concurrency=2, poll_seconds=0.01)
    runner.start()
    eventually(lambda: evaluator.calls == 2)
    begun = time.monotonic()
    runner.stop()
    assert time.monotonic() - begun < 10.0
    assert not runner.running
    assert {store.job(job_id).state for job_id in jobs} == {JobState.QUEUED}


def test_a_drained_runner_commits_iterations_in_progress_and_returns_its_jobs(
    store: Store,
) -> None:
    jobs = [queue(store), queue(store), queue(store)]
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    runner = Runner(store, evaluator, concurrency=2, poll_seconds=0.01)
    runner.start()
    eventually(lambda: evaluator.calls == 2)
    draining = threading.Thread(target=runner.drain, args=(60.0,))
    draining.start()
    eventually(lambda: not runner.running)
    evaluator.hold.clear()
    draining.join()
    assert [store.job(job_id).progress.iterations for job_id in jobs] == [1, 1, 0]
    assert {store.job(job_id).state for job_id in jobs} == {JobState.QUEUED}
    assert evaluator.calls == 2
    # Another runner has them at once, and repeats nothing.
    successor = Runner(store, evaluator, concurrency=3, poll_seconds=0.01)
    successor.start()
    eventually(lambda: all(store.job(j).state is JobState.SUCCEEDED for j in jobs))
    successor.stop()
    assert evaluator.calls == len(jobs) * SPEC.iterations


@pytest.mark.parametrize("hurried", [False, True])
def test_a_drain_ends_at_its_limit_or_on_request(store: Store, hurried: bool) -> None:
    job_id = queue(store)
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    runner = Runner(store, evaluator, poll_seconds=0.01)
    runner.start()
    evaluator.entered.wait()
    at_once = threading.Event()
    if hurried:
        at_once.set()
    begun = time.monotonic()
    runner.drain(600.0 if hurried else 0.2, at_once)
    assert time.monotonic() - begun < 20.0
    job = store.job(job_id)
    assert (job.state, job.progress.iterations) == (JobState.QUEUED, 0)


class BrokenStore:
    """`Store` whose claims do what a test says."""

    def __init__(self, store: Store, claim: Callable[[], None]) -> None:
        self.store = store
        self.before = claim

    def __getattr__(self, name: str) -> object:
        return getattr(self.store, name)

    def claim(self, *given: object, **options: object) -> None:
        self.before()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_runner_says_that_its_thread_has_ended(store: Store) -> None:
    runner = Runner(cast(Store, BrokenStore(store, sys.exit)), FormulaEvaluator())
    assert runner.trouble() is None
    runner.start()
    eventually(lambda: runner.trouble() is not None)
    assert "it has ended" in str(runner.trouble())
    runner.stop()


def test_a_runner_reports_that_its_thread_is_stuck_and_that_it_has_recovered(store: Store) -> None:
    now = [0.0]
    answers, asked = threading.Event(), threading.Event()

    def hang() -> None:
        asked.set()
        answers.wait()

    runner = Runner(
        cast(Store, BrokenStore(store, hang)),
        FormulaEvaluator(),
        poll_seconds=0.01,
        clock=lambda: now[0],
    )
    runner.start()
    asked.wait()
    assert runner.trouble() is None
    now[0] = STUCK_SECONDS + 30.0
    assert "for 150 s" in str(runner.trouble())
    answers.set()
    eventually(lambda: runner.trouble() is None)
    runner.stop()


def test_a_runner_that_is_busy_with_long_iterations_is_not_stuck(store: Store) -> None:
    queue(store)
    now = [0.0]
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    runner = Runner(store, evaluator, concurrency=1, poll_seconds=0.01, clock=lambda: now[0])
    runner.start()
    evaluator.entered.wait()
    now[0] = 10.0 * STUCK_SECONDS
    eventually(lambda: runner.trouble() is None)
    runner.stop()


def test_a_runner_outlives_a_machine_without_threads_to_spare(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    job_id = queue(store)
    refused: list[str] = []
    start = threading.Thread.start

    def start_unless_it_is_the_first_for_a_job(thread: threading.Thread) -> None:
        if thread.name == f"job-{job_id}" and not refused:
            refused.append(thread.name)
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", start_unless_it_is_the_first_for_a_job)
    runner = Runner(store, FormulaEvaluator(), poll_seconds=0.01)
    runner.start()
    eventually(lambda: store.job(job_id).state is JobState.SUCCEEDED)

    assert refused and runner.running
    runner.stop()
