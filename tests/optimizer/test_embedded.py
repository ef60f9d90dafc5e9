"""Jobs run by the calling process, next to other runners of the same store"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, cast

import pytest

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, StoreReplaced
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Command, JobState, Renewal
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    Evaluator,
)
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.run.runner import EMBEDDED_LEASE_SECONDS, run_embedded
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.sim.outcome import Outcome
from tests.optimizer.formula import SPEC as LONGER
from tests.optimizer.formula import FormulaEvaluator

SPEC = LONGER.model_copy(update={"iterations": 3})
ALL = list(range(SPEC.iterations))


class Clock:
    """The machine's, until it is put forward."""

    def __init__(self) -> None:
        self.ahead = timedelta()

    def __call__(self, connection: object) -> datetime:
        return datetime.now(UTC) + self.ahead

    def advance(self, seconds: float) -> None:
        self.ahead += timedelta(seconds=seconds)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def store(tmp_path: Path, clock: Clock) -> Iterator[Store]:
    opened = open_store(f"sqlite:///{tmp_path}/jobs.db", clock=clock)
    yield opened
    opened.close()


def submitted(store: Store) -> Claim:
    return JobService(store).submit_embedded(SPEC)


def held_by_another(store: Store, *, lease_seconds: float = 60.0) -> Claim:
    return store.create_claimed_job(SPEC, "another", lease_seconds=lease_seconds)


def no_workers() -> Evaluator:
    raise AssertionError("a job that another process runs needs no workers")


@contextmanager
def clock_ahead(clock: Clock, seconds: float) -> Iterator[None]:
    clock.advance(seconds)
    yield
    clock.advance(-seconds)


@contextmanager
def running(store: Store, claim: Claim, *, after: threading.Event) -> Iterator[None]:
    """Another process, which runs its job to the end once something has happened."""

    def run() -> None:
        after.wait()
        run_claim(claim, RunContext(store, FormulaEvaluator()))

    thread = threading.Thread(target=run)
    thread.start()
    yield
    thread.join()


class Reports:
    """Calls of an embedded run's callbacks."""

    def __init__(self) -> None:
        self.iterations: list[int] = []
        self.news: list[str] = []
        self.any_news = threading.Event()

    def callbacks(self) -> dict[str, Any]:
        def news(sentence: str) -> None:
            self.news.append(sentence)
            self.any_news.set()

        return {
            "on_iteration": lambda iteration: self.iterations.append(iteration.index),
            "on_news": news,
        }


@pytest.fixture
def reports() -> Reports:
    return Reports()


def test_a_job_that_was_submitted_for_itself_runs_to_its_end(
    store: Store, reports: Reports
) -> None:
    job = run_embedded(store, FormulaEvaluator(), submitted(store), **reports.callbacks())
    assert job.state is JobState.SUCCEEDED
    assert (reports.iterations, reports.news) == (ALL, [])


def test_a_job_is_kept_while_its_workers_are_opened_however_long_that_takes(
    store: Store, clock: Clock
) -> None:
    claim = submitted(store)
    renewed = threading.Event()

    class Watched:
        def __getattr__(self, name: str) -> Any:
            return getattr(store, name)

        def renew(
            self, claim: Claim, *, lease_seconds: float, waiting: str | None = None
        ) -> Renewal:
            renewal = store.renew(claim, lease_seconds=lease_seconds, waiting=waiting)
            renewed.set()
            return renewal

    def opened() -> Evaluator:
        for _ in range(2):
            clock.advance(EMBEDDED_LEASE_SECONDS - 2.0)
            renewed.clear()
            assert renewed.wait(timeout=10.0)
            assert store.claim("another", lease_seconds=60.0) is None
        return FormulaEvaluator()

    assert run_embedded(cast("Store", Watched()), opened, claim).state is JobState.SUCCEEDED


def test_a_job_whose_workers_cannot_be_opened_is_queued(store: Store) -> None:
    def opened() -> Evaluator:
        raise EvaluatorUnavailable("no cluster there")

    claim = submitted(store)
    with pytest.raises(EvaluatorUnavailable):
        run_embedded(store, opened, claim)
    assert store.job(claim.job.id).state is JobState.QUEUED


def test_a_run_that_is_asked_to_stop_while_its_workers_are_opened_leaves_the_job_queued(
    store: Store,
) -> None:
    stop = threading.Event()

    def opened() -> Evaluator:
        stop.set()
        raise EvaluationStopped

    job = run_embedded(store, opened, submitted(store), stop=stop)
    assert (job.state, job.progress.iterations) == (JobState.QUEUED, 0)


def test_a_job_that_another_process_runs_is_followed_to_its_end(
    store: Store, reports: Reports
) -> None:
    claim = held_by_another(store)
    with running(store, claim, after=reports.any_news):
        job = run_embedded(store, no_workers, claim.job.id, **reports.callbacks())
    assert job.state is JobState.SUCCEEDED
    assert reports.iterations == ALL
    assert len(reports.news) == 1 and "another process runs" in reports.news[0]


def test_following_begins_after_the_iterations_that_the_caller_knows_of(
    store: Store, reports: Reports
) -> None:
    first, stop = held_by_another(store), threading.Event()
    run_claim(first, RunContext(store, FormulaEvaluator(), on_commit=lambda *_: stop.set()), stop)
    claim = store.claim("another", lease_seconds=60.0)
    assert claim is not None and claim.job.progress.iterations == 1
    with running(store, claim, after=reports.any_news):
        run_embedded(store, no_workers, claim.job.id, followed_iterations=0, **reports.callbacks())
    assert reports.iterations == ALL


def test_a_job_released_by_another_process_continues_here(store: Store, reports: Reports) -> None:
    claim = held_by_another(store)
    stop = threading.Event()

    def give_back(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 1:
            stop.set()

    def run() -> None:
        reports.any_news.wait()
        run_claim(claim, RunContext(store, FormulaEvaluator(), on_commit=give_back), stop)

    another = threading.Thread(target=run)
    another.start()
    job = run_embedded(store, FormulaEvaluator(), claim.job.id, **reports.callbacks())
    another.join()
    assert job.state is JobState.SUCCEEDED
    assert reports.iterations == ALL
    assert "continuing it here" in reports.news[-1]


def test_a_job_whose_process_was_killed_continues_here_when_its_lease_has_expired(
    store: Store, reports: Reports
) -> None:
    claim = held_by_another(store, lease_seconds=0.4)
    job = run_embedded(store, FormulaEvaluator(), claim.job.id, **reports.callbacks())
    assert job.state is JobState.SUCCEEDED
    assert "killed" in reports.news[0] and "continuing it here" in reports.news[1]


def test_a_job_lost_to_another_process_is_followed_there_and_nothing_is_reported_twice(
    store: Store, clock: Clock, reports: Reports
) -> None:
    mine = submitted(store)
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    ended = []
    here = threading.Thread(
        target=lambda: ended.append(run_embedded(store, evaluator, mine, **reports.callbacks()))
    )
    here.start()
    assert evaluator.entered.wait(timeout=10.0)
    theirs = None
    while theirs is None:
        # As after a sleep of the machine. A heartbeat may just have come in between.
        clock.advance(EMBEDDED_LEASE_SECONDS + 1.0)
        theirs = store.claim("another", lease_seconds=60.0)
    with running(store, theirs, after=reports.any_news):
        here.join()
    assert [job.state for job in ended] == [JobState.SUCCEEDED]
    assert "lost its lease" in reports.news[0]
    assert reports.iterations == ALL


class Asleep(FormulaEvaluator):
    """Workers on a machine that sleeps in the first call, until another has run the job."""

    def __init__(self, store: Store, clock: Clock) -> None:
        super().__init__()
        self.store = store
        self.clock = clock

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        theirs = None
        while theirs is None:
            # A heartbeat may just have come in between.
            self.clock.advance(EMBEDDED_LEASE_SECONDS + 1.0)
            theirs = self.store.claim("another", lease_seconds=60.0)
        run_claim(theirs, RunContext(self.store, FormulaEvaluator()))
        return super().evaluate(request, should_stop)


def test_a_job_ended_unnoticed_by_another_process_is_reported_to_its_end(
    store: Store, clock: Clock, reports: Reports
) -> None:
    job = run_embedded(store, Asleep(store, clock), submitted(store), **reports.callbacks())
    assert job.state is JobState.SUCCEEDED
    assert reports.iterations == ALL
    assert len(reports.news) == 1 and "lost its lease" in reports.news[0]


def test_a_job_that_is_cancelled_while_it_is_followed_is_returned_cancelled(
    store: Store, reports: Reports
) -> None:
    claim = held_by_another(store)
    callbacks = reports.callbacks()
    callbacks["on_news"] = lambda _: store.command(claim.job.id, Command.CANCEL)
    job = run_embedded(store, no_workers, claim.job.id, **callbacks)
    assert job.state is JobState.CANCELLED


@pytest.mark.parametrize("command", [Command.PAUSE, Command.CANCEL])
def test_a_job_that_is_not_under_way_is_returned_as_it_is(store: Store, command: Command) -> None:
    job, _ = store.create_job(SPEC)
    store.command(job.id, command)
    assert run_embedded(store, no_workers, job.id) == store.job(job.id)


def test_a_run_that_is_asked_to_stop_leaves_the_job_queued(store: Store) -> None:
    stop = threading.Event()
    claim = submitted(store)
    job = run_embedded(
        store, FormulaEvaluator(), claim, on_iteration=lambda _: stop.set(), stop=stop
    )
    assert (job.state, job.progress.iterations) == (JobState.QUEUED, 1)


def test_a_job_whose_process_was_killed_with_its_clock_ahead_is_taken_over(
    store: Store, clock: Clock, reports: Reports
) -> None:
    with clock_ahead(clock, 86400.0):
        claim = held_by_another(store)
    job = run_embedded(store, FormulaEvaluator(), claim.job.id, **reports.callbacks())
    assert (job.state, reports.iterations) == (JobState.SUCCEEDED, ALL)


def test_a_run_ends_when_its_database_file_is_removed(store: Store, tmp_path: Path) -> None:
    def remove(*_: object) -> None:
        (tmp_path / "jobs.db").unlink()

    with pytest.raises(StoreReplaced, match="restart"):
        run_embedded(store, FormulaEvaluator(), submitted(store), on_iteration=remove)


def test_a_run_that_is_asked_to_stop_before_it_begins_leaves_the_job_queued(store: Store) -> None:
    stop = threading.Event()
    stop.set()
    assert run_embedded(store, no_workers, submitted(store), stop=stop).state is JobState.QUEUED


def test_a_run_that_is_asked_to_stop_leaves_a_job_alone_that_another_process_took(
    store: Store, clock: Clock
) -> None:
    stop = threading.Event()
    stop.set()
    mine = submitted(store)
    clock.advance(EMBEDDED_LEASE_SECONDS + 1.0)
    assert store.claim("another", lease_seconds=60.0) is not None
    assert run_embedded(store, no_workers, mine, stop=stop).state is JobState.RUNNING


class NeverWaitedFor(threading.Event):
    """Waiting holds the lock that a signal handler in the same thread needs."""

    def wait(self, timeout: float | None = None) -> bool:
        raise AssertionError(f"waited {timeout} s for what a handler is to set")


def test_who_follows_a_job_looks_whether_to_stop_and_never_waits_for_it(store: Store) -> None:
    stop, claim = NeverWaitedFor(), held_by_another(store)
    later = threading.Timer(0.1, stop.set)
    later.start()
    job = run_embedded(store, no_workers, claim.job.id, stop=stop)
    later.join()
    assert job.state is JobState.RUNNING
