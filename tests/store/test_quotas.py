"""Quotas of unfinished jobs."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from gaitswarm.services.optimizer.errors import QuotaExceeded
from gaitswarm.services.optimizer.jobs.job import Command, JobState, Quota
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.store.examples import spec

TWO = Quota(jobs=2, seconds=1e9)


def submit(store: Store, owner: str | None, quota: Quota | None = TWO, **options: float) -> str:
    return store.create_job(spec(), owner=owner, quota=quota, **options)[0].id  # type: ignore[arg-type]


@pytest.mark.parametrize("owner", ["ci", None])
def test_an_owner_has_only_so_many_unfinished_jobs(store: Store, owner: str | None) -> None:
    first = submit(store, owner)
    store.command(submit(store, owner), Command.PAUSE)
    submit(store, "another")
    with pytest.raises(QuotaExceeded, match=r"2 unfinished jobs.*limit of 2.*cancel one"):
        submit(store, owner)
    submit(store, owner, quota=None)
    store.command(first, Command.CANCEL)
    with pytest.raises(QuotaExceeded):
        submit(store, owner)


def test_unfinished_jobs_walk_only_so_long_together(store: Store) -> None:
    quota = Quota(jobs=100, seconds=100.0)
    submit(store, "ci", quota, seconds=60.0)
    with pytest.raises(QuotaExceeded, match="with this one 120 s; the limit is 100 s") as refused:
        submit(store, "ci", quota, seconds=60.0)
    assert refused.value.field == "iterations"
    submit(store, "ci", quota, seconds=40.0)


def test_a_repeated_request_is_no_further_job(store: Store) -> None:
    one = Quota(jobs=1, seconds=1e9)
    made = store.create_job(spec(), owner="ci", quota=one, idempotency_key="k")
    assert store.create_job(spec(), owner="ci", quota=one, idempotency_key="k") == (made[0], False)


def test_a_job_that_is_taken_up_again_counts_again(store: Store) -> None:
    job_id = submit(store, "ci", seconds=60.0)
    claim = store.claim("runner", lease_seconds=60.0, job_id=job_id)
    assert claim is not None
    store.release(claim, JobState.FAILED, error="it broke")
    submit(store, "ci"), submit(store, "ci")
    with pytest.raises(QuotaExceeded):
        store.command(job_id, Command.RESUME, quota=TWO)
    longer = Quota(jobs=3, seconds=50.0)
    with pytest.raises(QuotaExceeded, match="60 s"):
        store.command(job_id, Command.RESUME, quota=longer)
    assert store.job(job_id).state is JobState.FAILED
    assert store.command(job_id, Command.RESUME).state is JobState.QUEUED


def test_a_longer_budget_counts_by_what_it_adds(store: Store) -> None:
    service = JobService(store, longest_job=1e9)
    job = service.submit(spec(), owner="ci")[0]
    planned = service.estimate(spec()).simulated_seconds
    twice, quota = 2 * job.spec.iterations, Quota(jobs=1, seconds=2.5 * planned)
    assert service.extend(job.id, twice, quota=quota).spec.iterations == twice
    with pytest.raises(QuotaExceeded, match="fewer iterations"):
        service.extend(job.id, 3 * job.spec.iterations, quota=quota)
    assert store.job(job.id).spec.iterations == twice


def test_of_those_who_ask_at_once_no_more_than_the_quota_get_a_job(store: Store) -> None:
    def ask(_: int) -> bool:
        try:
            submit(store, "ci")
        except QuotaExceeded:
            return False
        return True

    with ThreadPoolExecutor(6) as threads:
        assert sum(threads.map(ask, range(6))) == 2
