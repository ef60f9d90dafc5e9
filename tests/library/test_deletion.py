"""Deleting jobs and keeping them, asked in every way that there is."""

from __future__ import annotations

import pytest

import gaitswarm
from tests.library.conftest import SMALL, Finished, Reach

pytestmark = pytest.mark.slow


def test_a_job_that_has_ended_is_deleted_with_all_that_it_found_and_restored(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    jobs.delete(finished.id)
    assert list(jobs.jobs()) == []
    with pytest.raises(gaitswarm.NotFound):
        jobs.job(finished.id)
    with pytest.raises(gaitswarm.NotFound):
        jobs.delete(finished.id)
    assert jobs.restore(finished.id).best_fitness is not None
    assert [restored.id for restored in jobs.jobs()] == [finished.id]
    with pytest.raises(gaitswarm.NotFound, match="was deleted in the last 24 hours"):
        jobs.restore(finished.id)


def test_a_job_under_way_is_not_deleted_and_the_error_says_what_to_do(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    job = jobs.submit(**SMALL)
    with pytest.raises(gaitswarm.Conflict, match="cancel it first"):
        jobs.delete(job.id)
    jobs.pause(job.id)
    jobs.delete(job.id)
    assert [left.id for left in jobs.jobs()] == [finished.id]


def test_a_job_that_is_kept_is_not_deleted_until_it_is_released(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    assert not jobs.job(finished.id).kept
    assert jobs.keep(finished.id).kept
    with pytest.raises(gaitswarm.Conflict, match="release it first"):
        jobs.delete(finished.id)
    assert not jobs.release(finished.id).kept
    jobs.delete(finished.id)


def test_a_follower_of_a_job_learns_that_it_was_deleted(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    job = jobs.submit(**SMALL)
    events = jobs.follow(job.id)
    assert next(iter(events)).state == "queued"  # type: ignore[union-attr]
    jobs.pause(job.id)
    jobs.delete(job.id)
    with pytest.raises(gaitswarm.NotFound):
        list(events)
