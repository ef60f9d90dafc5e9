"""The cache of histories: every bit that is stored, within its bound."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.history import HistoryCache
from gaitswarm.services.optimizer.errors import Conflict, EvaluatorUnavailable
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Claim, Job
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import RESULTS
from tests.store.examples import ask, begun, completed

INF = math.inf


def go_on(store: Store, claim: Claim, *fitness: tuple[float, ...]) -> None:
    """Commit one more iteration for every swarm's fitness."""
    start = store.job(claim.job.id).progress.iterations
    for index, values in enumerate(fitness, start):
        store.commit(claim, completed(index, values), ask(index + 1))


def assert_as_row_by_row(store: Store, job_id: str, columns: EvaluationColumns) -> None:
    rows = store.evaluations_between(job_id, 0, 1000)
    assert len(columns) == len(rows)
    assert columns.iteration.tolist() == [row.iteration for row in rows]
    assert columns.particle.tolist() == [row.particle for row in rows]
    for name in ("designs", "objectives", "statuses"):
        one = {"designs": "design"}.get(name, name)
        expected = np.stack([getattr(row, one) for row in rows])
        found: NDArray[np.generic] = getattr(columns, name)
        assert found.dtype == expected.dtype and found.tobytes() == expected.tobytes()
    assert columns.fitness.tolist() == [row.fitness for row in rows]


def test_the_cache_reads_on_where_it_stopped(store: Store) -> None:
    claim = begun(store)
    cache = HistoryCache(store)
    job = store.job(claim.job.id)
    nothing = cache.columns(job)
    assert len(nothing) == 0 and nothing.objectives.shape == (0, 2, len(RESULTS))
    for _ in range(4):
        go_on(store, claim, (4.0, INF), (2.0, 3.0))
        job = store.job(claim.job.id)
        earlier, known = nothing.fitness.tolist(), len(nothing)
        columns = cache.columns(job)
        assert_as_row_by_row(store, job.id, columns)
        # What was handed out before is neither changed nor moved.
        assert nothing.fitness.tolist() == earlier == columns.fitness[:known].tolist()
        nothing = columns


def test_what_was_read_is_not_read_again(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    claim = begun(store)
    go_on(store, claim, (4.0, 3.0), (2.0, 1.0))
    cache = HistoryCache(store)
    first = cache.columns(store.job(claim.job.id))
    asked: list[tuple[int, int]] = []
    read = Store.evaluation_columns

    def counted(self: Store, job_id: str, first: int, last: int) -> EvaluationColumns | None:
        asked.append((first, last))
        return read(self, job_id, first, last)

    monkeypatch.setattr(Store, "evaluation_columns", counted)
    again = cache.columns(store.job(claim.job.id))
    assert asked == [] and np.shares_memory(again.objectives, first.objectives)
    go_on(store, claim, (5.0, 6.0))
    cache.columns(store.job(claim.job.id))
    assert asked == [(2, 3)]


def test_columns_cannot_be_written_to(store: Store) -> None:
    claim = begun(store)
    go_on(store, claim, (4.0, 3.0))
    columns = HistoryCache(store).columns(store.job(claim.job.id))
    with pytest.raises(ValueError, match="read-only"):
        columns.fitness[0] = 0.0


def test_the_job_asked_about_longest_ago_is_dropped_first(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = []
    for _ in range(3):
        claim = begun(store)
        go_on(store, claim, (4.0, 3.0), (2.0, 1.0))
        jobs.append(store.job(claim.job.id))
    size = memory_of_one(store, jobs[0])
    cache = HistoryCache(store, max_bytes=2 * size)
    first = cache.columns(jobs[0])
    cache.columns(jobs[1])
    cache.columns(jobs[0])
    cache.columns(jobs[2])
    assert cache.nbytes <= 2 * size
    asked: list[str] = []
    read = Store.evaluation_columns

    def counted(self: Store, job_id: str, *given: int) -> EvaluationColumns | None:
        asked.append(job_id)
        return read(self, job_id, *given)

    monkeypatch.setattr(Store, "evaluation_columns", counted)
    assert np.shares_memory(cache.columns(jobs[0]).fitness, first.fitness)
    del first
    cache.columns(jobs[1])
    assert asked == [jobs[1].id]


def test_a_job_that_is_too_large_is_refused_with_the_way_out(store: Store) -> None:
    claim = begun(store)
    go_on(store, claim, (4.0, 3.0))
    with pytest.raises(Conflict, match="export"):
        HistoryCache(store, max_bytes=100).columns(store.job(claim.job.id))


def jobs_with_history(store: Store, count: int) -> list[Job]:
    jobs = []
    for _ in range(count):
        claim = begun(store)
        go_on(store, claim, *[(4.0, 3.0)] * 10)
        jobs.append(store.job(claim.job.id))
    return jobs


def memory_of_one(store: Store, job: Job) -> int:
    cache = HistoryCache(store)
    cache.columns(job)
    return cache.nbytes


@pytest.mark.thorough("test_the_job_asked_about_longest_ago_is_dropped_first")
def test_many_jobs_in_many_threads_stay_within_the_bound(store: Store) -> None:
    jobs = jobs_with_history(store, 12)
    bound = 3 * memory_of_one(store, jobs[0])
    cache = HistoryCache(store, max_bytes=bound)
    most, wrong = [0], []

    def ask_about_all(offset: int) -> None:
        for k in range(3 * len(jobs)):
            job = jobs[(k + offset) % len(jobs)]
            columns = cache.columns(job)
            most[0] = max(most[0], cache.nbytes)
            if len(columns) != job.progress.evaluations:
                wrong.append(job.id)
            del columns

    threads = [threading.Thread(target=ask_about_all, args=(3 * n,)) for n in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
    assert 0 < most[0] <= bound


def test_columns_that_are_computed_with_count_until_they_are_let_go(store: Store) -> None:
    first, second = jobs_with_history(store, 2)
    cache = HistoryCache(store, max_bytes=memory_of_one(store, first), longest_wait=0.05)
    used = cache.columns(first).rows(slice(1, 2))
    with pytest.raises(EvaluatorUnavailable, match="try again"):
        cache.columns(second)
    fitness = used.fitness.tolist()
    del used
    assert len(cache.columns(second)) == 20
    assert fitness == [3.0]


def test_memory_is_waited_for(store: Store) -> None:
    first, second = jobs_with_history(store, 2)
    cache = HistoryCache(store, max_bytes=memory_of_one(store, first), longest_wait=60.0)
    used = [cache.columns(first)]
    threading.Timer(0.1, used.clear).start()
    assert len(cache.columns(second)) == 20


def test_a_history_that_grows_beyond_half_of_the_memory_is_read_again(store: Store) -> None:
    claim = begun(store)
    go_on(store, claim, *[(4.0, 3.0)] * 6)
    job = store.job(claim.job.id)
    # Room for one history of 8 iterations, not for another of 6.
    cache = HistoryCache(store, max_bytes=memory_of_one(store, job) * 8 // 6)
    cache.columns(job)
    go_on(store, claim, *[(2.0, 1.0)] * 2)
    assert_as_row_by_row(store, job.id, cache.columns(store.job(job.id)))


def test_many_threads_read_the_same_history(store: Store) -> None:
    claim = begun(store)
    go_on(store, claim, *[(4.0, INF)] * 30)
    job = store.job(claim.job.id)
    cache = HistoryCache(store)
    found: list[EvaluationColumns] = []
    threads = [threading.Thread(target=lambda: found.append(cache.columns(job))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    for columns in found:
        assert_as_row_by_row(store, job.id, columns)
