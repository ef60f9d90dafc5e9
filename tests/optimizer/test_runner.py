"""Running claimed jobs: a real store, walks by formula, and clocks that do not wait."""

from __future__ import annotations

import errno
import logging
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partialmethod
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, KilledWorker, StoreUnavailable
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobState
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.jobs.time_left import time_left
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.sim.errors import KernelBuildError, SimulationInputError
from gaitswarm.sim.outcome import Outcome
from tests.examples.jobs import Bits, history
from tests.examples.processes import eventually
from tests.optimizer.formula import BRISK, SINGLE, SPEC, FormulaEvaluator, queue, run
from tests.store.examples import Clock


@pytest.fixture(scope="module")
def undisturbed(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Bits]:
    """The history of a job that nothing disturbed."""
    path = Path(shutil.copy(empty_database, tmp_path_factory.mktemp("undisturbed") / "jobs.db"))
    with closing(open_store(str(path))) as store:
        job_id = queue(store)
        run(store, FormulaEvaluator())
        return history(store, job_id)


def test_a_claimed_job_runs_to_its_end(store: Store) -> None:
    job_id = queue(store)
    seen: list[tuple[int, JobState]] = []

    def note(done: CompletedIteration, state: JobState) -> None:
        seen.append((done.iteration, state))

    job = run(store, FormulaEvaluator(), on_commit=note)
    assert job.state is JobState.SUCCEEDED
    assert job.progress.iterations == SPEC.iterations
    assert len(history(store, job_id)) == SPEC.iterations * SPEC.optimizer.particles
    running = [(k, JobState.RUNNING) for k in range(SPEC.iterations - 1)]
    assert seen == [*running, (SPEC.iterations - 1, JobState.SUCCEEDED)]


def test_a_pause_waits_for_the_iteration_and_resuming_changes_no_bit(
    store: Store, undisturbed: list[Bits]
) -> None:
    paused = queue(store)

    def pause(done: CompletedIteration, state: JobState) -> None:
        if done.iteration == 2:
            store.command(paused, Command.PAUSE)

    job = run(store, FormulaEvaluator(), on_commit=pause)
    assert (job.state, job.progress.iterations) == (JobState.PAUSED, 4)
    store.command(paused, Command.RESUME)
    assert run(store, FormulaEvaluator()).state is JobState.SUCCEEDED
    assert history(store, paused) == undisturbed


def test_a_cancellation_drops_the_walks_under_way(store: Store) -> None:
    job_id = queue(store)
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    canceller = threading.Thread(
        target=lambda: (evaluator.entered.wait(), store.command(job_id, Command.CANCEL))
    )
    canceller.start()
    assert run(store, evaluator, lease_seconds=BRISK).state is JobState.CANCELLED
    canceller.join()
    assert history(store, job_id) == []


class StandingStore:
    """A store whose clock stands until leases are to be outlived."""

    def __init__(self, database: Path) -> None:
        self._clock = Clock()
        self.store = open_store(str(database), clock=self._clock)
        self._renew = self.store.renew
        self._renewed = 0
        self.store.renew = self._counted  # type: ignore[method-assign]

    def _counted(self, *arguments: Any, **options: Any) -> Any:
        renewal = self._renew(*arguments, **options)
        self._renewed += 1
        return renewal

    def outlive(self, lease_seconds: float) -> None:
        """Let two lease times pass, with renewals in time."""
        for _ in range(4):
            self._clock.advance(0.5 * lease_seconds)
            # One may have been under way, by the time before.
            wanted = self._renewed + 2
            eventually(lambda wanted=wanted: self._renewed >= wanted)  # type: ignore[misc]


@pytest.fixture
def standing(database: Path) -> Iterator[StandingStore]:
    opened = StandingStore(database)
    yield opened
    opened.store.close()


def test_a_job_longer_than_its_lease_is_kept_by_its_heartbeat(standing: StandingStore) -> None:
    store = standing.store
    job_id = queue(store)
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    thread = threading.Thread(target=run, args=(store, evaluator), kwargs={"lease_seconds": BRISK})
    thread.start()
    evaluator.entered.wait()
    standing.outlive(BRISK)
    assert store.claim("thief", lease_seconds=1.0, job_id=job_id) is None
    evaluator.hold.clear()
    thread.join()
    assert store.job(job_id).state is JobState.SUCCEEDED


def set_after(awaited: threading.Event, following: threading.Event) -> None:
    awaited.wait()
    following.set()


def test_a_stopped_run_gives_its_job_back_for_another_to_finish(
    store: Store, undisturbed: list[Bits]
) -> None:
    job_id = queue(store)
    evaluator = FormulaEvaluator()
    evaluator.hold.set()
    stop = threading.Event()
    threading.Thread(target=set_after, args=(evaluator.entered, stop)).start()
    assert run(store, evaluator, stop).state is JobState.QUEUED
    assert run(store, FormulaEvaluator()).state is JobState.SUCCEEDED
    assert history(store, job_id) == undisturbed


def test_workers_out_of_reach_delay_a_job_and_change_no_bit(
    store: Store, undisturbed: list[Bits]
) -> None:
    job_id = queue(store)
    now = [0.0]
    gone = EvaluatorUnavailable("no route to host")
    job = run(
        store,
        FormulaEvaluator([None, gone, gone, gone, None, gone]),
        clock=lambda: now[0],
        sleep=lambda seconds: now.__setitem__(0, now[0] + seconds),
        lease_seconds=1e6,
    )
    assert job.state is JobState.SUCCEEDED
    assert now[0] == pytest.approx(1 + 2 + 4 + 1)
    assert history(store, job_id) == undisturbed


def test_a_job_outlives_workers_that_are_away_for_days(
    store: Store, undisturbed: list[Bits]
) -> None:
    job_id = queue(store)
    now = [0.0]
    gone = EvaluatorUnavailable("no route to host")
    job = run(
        store,
        FormulaEvaluator([None, *[gone] * 100]),
        clock=lambda: now[0],
        sleep=lambda seconds: now.__setitem__(0, now[0] + 36_000.0 * seconds),
        lease_seconds=1e6,
        backoff=Backoff(longest=3600.0),
    )
    assert now[0] > 3 * 86_400.0
    assert (job.state, job.error) == (JobState.SUCCEEDED, None)
    assert history(store, job_id) == undisturbed


class AwayEvaluator(FormulaEvaluator):
    """Out of reach in its second call and all later ones, until it is back."""

    def __init__(self) -> None:
        super().__init__()
        self.back = threading.Event()

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        if self.calls and not self.back.is_set():
            self.calls += 1
            raise EvaluatorUnavailable("no route to host")
        return super().evaluate(request, should_stop)


def test_a_waiting_job_says_why_keeps_its_lease_and_continues_automatically(
    standing: StandingStore,
) -> None:
    store = standing.store
    job_id = queue(store)
    evaluator = AwayEvaluator()
    brisk = {"backoff": Backoff(0.01, longest=0.1), "lease_seconds": BRISK}
    thread = threading.Thread(target=run, args=(store, evaluator), kwargs=brisk)
    thread.start()
    eventually(lambda: store.job(job_id).waiting == "no route to host")
    waiting = store.job(job_id)
    assert waiting.state is JobState.RUNNING
    assert time_left(waiting, waiting.updated_at).eta_seconds is None
    standing.outlive(BRISK)
    assert store.claim("thief", lease_seconds=1.0, job_id=job_id) is None
    evaluator.back.set()
    thread.join()
    ended = store.job(job_id)
    assert (ended.state, ended.waiting) == (JobState.SUCCEEDED, None)


def test_a_job_that_waits_can_be_cancelled(store: Store) -> None:
    job_id = queue(store)
    ended: list[Job] = []
    thread = threading.Thread(
        target=lambda: ended.append(run(store, AwayEvaluator(), backoff=Backoff(first=600.0)))
    )
    thread.start()
    eventually(lambda: store.job(job_id).waiting is not None)
    store.command(job_id, Command.CANCEL)
    thread.join()
    assert (ended[0].state, ended[0].waiting) == (JobState.CANCELLED, None)


def kernel_not_stored() -> Exception:
    error = KernelBuildError("the kernel cannot be stored")
    error.__cause__ = OSError(errno.EACCES, "Permission denied")
    return error


@pytest.mark.variants("OSError*", "MemoryError*", "KernelBuildError*")
@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"),
        MemoryError(),
        RuntimeError("can't start new thread"),
        ImportError("_ufuncs.so: failed to map segment from shared object"),
        ImportError("_ufuncs.so: cannot open shared object file: Too many open files"),
        kernel_not_stored(),
        KernelBuildError("cc did not compile: cannot write: No space left on device"),
        StoreUnavailable("database is locked"),
    ],
    ids=lambda error: f"{type(error).__name__}: {error}",
)
def test_what_the_machine_lacks_delays_a_job_with_one_line_in_the_log_for_all_attempts(
    store: Store, error: Exception, caplog: pytest.LogCaptureFixture
) -> None:
    queue(store)
    evaluator = FormulaEvaluator([None, error, error, error])
    with caplog.at_level(logging.WARNING):
        job = run(store, evaluator, backoff=Backoff(first=0.001, longest=0.01))
    assert (job.state, job.error) == (JobState.SUCCEEDED, None)
    assert evaluator.calls == SPEC.iterations + 3
    (record,) = caplog.records
    assert record.exc_info is None and str(error) in record.getMessage()


def test_a_machine_without_memory_for_what_precedes_the_walks_delays_a_job(store: Store) -> None:
    queue(store)
    lacks = [MemoryError(), OSError(errno.EMFILE, "Too many open files")]

    def provenance(spec: Spec) -> JobProvenance:
        if lacks:
            raise lacks.pop()
        return job_provenance(spec)

    job = run(store, FormulaEvaluator(), provenance=provenance, backoff=Backoff(first=0.001))
    assert job.state is JobState.SUCCEEDED
    assert not lacks


def test_walks_that_kill_worker_after_worker_fail_their_job_with_the_reason(store: Store) -> None:
    queue(store)
    killed = KilledWorker("3 workers died of designs 4 to 7 in 'slope-fast'")
    job = run(store, FormulaEvaluator([None, killed]))
    assert (job.state, job.error) == (JobState.FAILED, str(killed))
    assert job.progress.iterations == 1


def test_a_pause_does_not_wait_for_unreachable_workers(store: Store) -> None:
    job_id = queue(store)
    gone = EvaluatorUnavailable("no route to host")
    evaluator = FormulaEvaluator([gone] * 100)
    threading.Thread(
        target=lambda: (evaluator.entered.wait(), store.command(job_id, Command.PAUSE))
    ).start()
    assert run(store, evaluator, backoff=Backoff(first=60.0)).state is JobState.PAUSED


class AbsentStore:
    """`Store` that refuses those accesses of a run that `away` says; takes note of them."""

    def __init__(self, store: Store, away: Callable[[str], bool]) -> None:
        self.store = store
        self.away = away
        self.refused: list[str] = []
        self.refusal = threading.Event()

    def __getattr__(self, name: str) -> object:
        return getattr(self.store, name)

    def _ask(self, name: str, *given: object, **options: object) -> object:
        if self.away(name):
            self.refused.append(name)
            self.refusal.set()
            raise StoreUnavailable("the server is being restarted")
        return getattr(self.store, name)(*given, **options)

    claim = partialmethod(_ask, "claim")
    job = partialmethod(_ask, "job")
    begin = partialmethod(_ask, "begin")
    commit = partialmethod(_ask, "commit")
    renew = partialmethod(_ask, "renew")
    release = partialmethod(_ask, "release")


def test_an_evaluated_iteration_waits_for_a_store_that_is_away_for_a_moment(
    store: Store, undisturbed: list[Bits]
) -> None:
    job_id = queue(store)
    evaluator = FormulaEvaluator()
    absent = AbsentStore(
        store, lambda _: evaluator.calls == 3 and absent.refused.count("commit") < 3
    )
    job = run(cast(Store, absent), evaluator, lease_seconds=60.0)
    assert job.state is JobState.SUCCEEDED
    assert absent.refused.count("commit") == 3
    assert evaluator.calls == SPEC.iterations
    assert history(store, job_id) == undisturbed


def test_an_evaluated_iteration_waits_for_a_store_that_is_away_for_longer_than_the_lease(
    store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    job_id = queue(store)
    evaluator = FormulaEvaluator()
    until: list[float] = []

    def away(access: str) -> bool:
        if evaluator.calls == 1 and not until:
            until.append(time.monotonic() + 0.6)
        return bool(until) and time.monotonic() < until[0]

    absent = AbsentStore(store, away)
    with caplog.at_level(logging.WARNING):
        job = run(cast(Store, absent), evaluator, lease_seconds=0.3)
    assert job.state is JobState.SUCCEEDED
    assert {"commit", "renew"} <= set(absent.refused)
    assert evaluator.calls == SPEC.iterations
    assert len(history(store, job_id)) == SPEC.iterations * SPEC.optimizer.particles
    assert len(caplog.records) == 1


def test_an_iteration_that_waited_for_the_store_is_dropped_if_another_has_the_job(
    store: Store,
) -> None:
    job_id = queue(store)
    evaluator = FormulaEvaluator()
    taken: list[Claim] = []

    def away(access: str) -> bool:
        if evaluator.calls and not taken:
            claim = store.claim("another", lease_seconds=60.0, job_id=job_id)
            taken.extend([claim] if claim else [])
        return bool(evaluator.calls) and not taken

    job = run(cast(Store, AbsentStore(store, away)), evaluator, lease_seconds=0.3)
    assert (job.state, job.progress.iterations) == (JobState.RUNNING, 0)
    assert evaluator.calls == 1


def test_a_process_that_is_to_end_does_not_wait_for_a_store_that_is_away(store: Store) -> None:
    queue(store)
    evaluator = FormulaEvaluator()
    absent = AbsentStore(store, lambda access: access != "job" and evaluator.calls > 0)
    stop = threading.Event()
    threading.Thread(target=set_after, args=(absent.refusal, stop)).start()
    begun = time.monotonic()
    assert run(cast(Store, absent), evaluator, stop, lease_seconds=600.0).progress.iterations == 0
    assert time.monotonic() - begun < 10.0


def test_a_process_that_is_to_end_does_not_wait_to_read_a_budget_that_has_changed(
    store: Store,
) -> None:
    job_id = queue(store)
    stop = threading.Event()
    evaluator = FormulaEvaluator()

    def extend(done: CompletedIteration, state: JobState) -> None:
        store.extend(job_id, SPEC.iterations + 1)

    def away(access: str) -> bool:
        return access == "job" and store.job(job_id).state is JobState.RUNNING

    absent = AbsentStore(store, away)
    threading.Thread(target=set_after, args=(absent.refusal, stop)).start()
    assert run(cast(Store, absent), evaluator, stop, on_commit=extend).progress.iterations == 1


def test_a_simulation_error_fails_the_job_with_its_reason(store: Store) -> None:
    queue(store)
    job = run(store, FormulaEvaluator([SimulationInputError("FOMF: 7 is not a shape")]))
    assert job.state is JobState.FAILED
    assert job.error is not None and "FOMF: 7 is not a shape" in job.error


def test_a_listener_that_breaks_leaves_the_job_to_others(store: Store) -> None:
    job_id = queue(store)

    def broken(done: CompletedIteration, state: JobState) -> None:
        raise BrokenPipeError

    with pytest.raises(BrokenPipeError):
        run(store, FormulaEvaluator(), on_commit=broken)
    assert store.job(job_id).state is JobState.QUEUED
    assert run(store, FormulaEvaluator()).progress.iterations == SPEC.iterations


def test_a_run_that_lost_its_lease_writes_nothing(store: Store) -> None:
    job_id = queue(store)
    claim = store.claim("slow", lease_seconds=0.0)
    assert claim is not None
    taken = store.claim("quick", lease_seconds=60.0)
    assert taken is not None
    job = run_claim(claim, RunContext(store, FormulaEvaluator(), lease_seconds=60.0))
    assert job.progress.iterations == 0
    finished = run_claim(taken, RunContext(store, FormulaEvaluator(), lease_seconds=60.0))
    assert (finished.id, finished.state) == (job_id, JobState.SUCCEEDED)


def test_a_runner_outlives_a_store_that_cannot_be_asked_for_jobs_with_one_line_in_the_log(
    store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    job_id = queue(store)
    absent = AbsentStore(store, lambda access: absent.refused.count("claim") < 3)
    runner = Runner(cast(Store, absent), FormulaEvaluator(), poll_seconds=0.01)
    with caplog.at_level(logging.WARNING):
        runner.start()
        eventually(lambda: store.job(job_id).state is JobState.SUCCEEDED)
        runner.stop()
    (record,) = caplog.records
    assert record.exc_info is None and "being restarted" in record.getMessage()


class NotingEvaluator(FormulaEvaluator):
    """Keeps the designs that it was given."""

    def __init__(self) -> None:
        super().__init__()
        self.designs: list[NDArray[np.float64]] = []

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        self.designs.append(request.designs.copy())
        return super().evaluate(request, should_stop)


def test_recorded_designs_are_what_was_evaluated(store: Store) -> None:
    job_id = queue(store, SPEC.model_copy(update={"variables": ("P",), "fixed": {"I": 0.1}}))
    evaluator = NotingEvaluator()
    run(store, evaluator)
    recorded = [e.design for e in store.evaluations_between(job_id, 0, SPEC.iterations)]
    np.testing.assert_array_equal(recorded, np.concatenate(evaluator.designs))


def test_a_change_of_priority_reaches_the_workers_and_changes_no_bit(
    standing: StandingStore, undisturbed: list[Bits]
) -> None:
    store = standing.store
    job, _ = store.create_job(SPEC, priority=-1)
    given: list[float] = []

    class Prioritized(FormulaEvaluator):
        def evaluate(
            self, request: EvaluationRequest, should_stop: Callable[[], bool]
        ) -> tuple[Outcome, ...]:
            given.append(request.weight)
            return super().evaluate(request, should_stop)

    def prioritize(done: CompletedIteration, _state: JobState) -> None:
        if done.iteration == 0:
            store.prioritize(job.id, 4)
            # Of the next iterations, one begins after a heartbeat that has heard of it.
            evaluator.hold.set()
            threading.Thread(target=let_go_after_a_beat).start()

    def let_go_after_a_beat() -> None:
        standing.outlive(BRISK)
        evaluator.hold.clear()

    evaluator = Prioritized()
    ended = run(store, evaluator, on_commit=prioritize, lease_seconds=BRISK)
    assert ended.state is JobState.SUCCEEDED
    assert (given[0], given[-1]) == (0.5, 16.0)
    assert history(store, job.id) == undisturbed


def test_a_drained_job_does_not_wait_for_workers_out_of_reach(store: Store) -> None:
    job_id = queue(store)
    drain = threading.Event()
    claim = store.claim("runner", lease_seconds=60.0, job_id=job_id)
    assert claim is not None
    gone = EvaluatorUnavailable("no route to host")
    around = RunContext(
        store,
        FormulaEvaluator([None, gone]),
        backoff=Backoff(first=600.0),
        on_retry=lambda seconds, why: drain.set(),
    )
    job = run_claim(claim, around, drain=drain)
    assert (job.state, job.progress.iterations) == (JobState.QUEUED, 1)


def test_a_drain_in_single_precision_commits_the_best_as_judged_in_double(store: Store) -> None:
    job_id = queue(store, SINGLE)
    evaluator = FormulaEvaluator()
    drain = threading.Event()
    drain.set()
    claim = store.claim("runner", lease_seconds=60.0, job_id=job_id)
    assert claim is not None
    job = run_claim(claim, RunContext(store, evaluator), drain=drain)
    assert (job.state, job.progress.iterations) == (JobState.QUEUED, 1)
    assert len(store.reevaluations(job_id)) == 1
