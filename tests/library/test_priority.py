"""Priorities and notifications of jobs, asked for in every way that there is."""

from __future__ import annotations

from pathlib import Path

import pytest

import gaitswarm
from gaitswarm.services.optimizer.store import open_store
from tests.library.conftest import SMALL, Finished, Reach

pytestmark = pytest.mark.slow

HOOK = "https://ci.example/hook"


def urls(db: Path) -> list[str]:
    """Where something is to be sent."""
    store = open_store(str(db))
    try:
        ended = [job.id for job in store.jobs().items]
        return [sent.url for job in ended for sent in store.outbox.about(job)]
    finally:
        store.close()


def test_a_job_is_submitted_with_a_priority_and_gets_another_one(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    assert jobs.submit(**SMALL).priority == 0
    job = jobs.submit(priority=-2, **SMALL)
    assert job.priority == -2
    assert jobs.prioritize(job.id, 7).priority == 7
    assert [listed.priority for listed in jobs.jobs()] == [7, 0]


def test_a_fork_has_a_priority_of_its_own(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    parent = jobs.submit(priority=5, **SMALL)
    assert jobs.fork(finished.id, 1, priority=3).priority == 3
    assert jobs.fork(finished.id, 1).priority == 0
    assert jobs.job(parent.id).priority == 5


@pytest.mark.parametrize("priority", [11, -11, 1.5, "5", True])
def test_what_is_no_priority_is_refused_by_name(reach: Reach, db: Path, priority: object) -> None:
    jobs = reach(db)
    job = jobs.submit(**SMALL)
    with pytest.raises(gaitswarm.InvalidRequest, match=r"^priority: must be"):
        jobs.submit(priority=priority, **SMALL)  # type: ignore[arg-type]
    with pytest.raises(gaitswarm.InvalidRequest, match=r"^priority: must be"):
        jobs.prioritize(job.id, priority)  # type: ignore[arg-type]
    assert [(listed.id, listed.priority) for listed in jobs.jobs()] == [(job.id, 0)]


def test_a_job_that_has_ended_gets_no_other_priority(reach: Reach, finished: Finished) -> None:
    with pytest.raises(gaitswarm.Conflict, match="it has ended"):
        reach(finished.db).prioritize(finished.id, 1)


def test_the_receiver_of_the_notification_is_given_at_submission(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    for job in (
        jobs.submit(notify_url=HOOK, **SMALL),
        jobs.fork(finished.id, 1, notify_url=f"{HOOK}/2"),
        jobs.submit(**SMALL),
    ):
        jobs.cancel(job.id)
    assert sorted(urls(finished.db)) == [HOOK, f"{HOOK}/2"]


@pytest.mark.parametrize("url", ["ci.example/hook", "ftp://ci.example/", "https://u:p@ci.example/"])
def test_a_url_to_which_nothing_can_be_sent_is_refused(reach: Reach, db: Path, url: str) -> None:
    jobs = reach(db)
    with pytest.raises(gaitswarm.InvalidRequest, match=r"^notify_url: must"):
        jobs.submit(notify_url=url, **SMALL)
    assert list(jobs.jobs()) == []
