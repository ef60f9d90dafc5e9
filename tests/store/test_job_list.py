"""Jobs as their users see them: submitted once, listed in stable pages."""

from __future__ import annotations

from datetime import UTC

import pytest

from services.optimizer.errors import IdempotencyConflict, InvalidRequest, NotFound
from services.optimizer.job import Command, JobState
from services.optimizer.store.sql_store import SqlStore
from tests.store.examples import Clock, spec


def test_a_new_job_is_queued_and_reads_back_as_it_was_returned(
    store: SqlStore, clock: Clock
) -> None:
    job, new = store.create_job(spec(name="größer, and 'quoted'"))
    assert new
    assert job.state is JobState.QUEUED
    assert job.spec == spec(name="größer, and 'quoted'").resolved()
    assert job.created_at == job.updated_at == clock.now
    assert job.progress.iterations == 0 and job.progress.best_fitness is None
    assert store.job(job.id) == job


def test_times_come_back_in_utc_to_the_microsecond(store: SqlStore, clock: Clock) -> None:
    job, _ = store.create_job(spec())
    assert store.job(job.id).created_at.tzinfo is UTC
    assert store.job(job.id).created_at.microsecond == clock.now.microsecond == 678901


def test_the_same_key_and_spec_give_the_same_job(store: SqlStore) -> None:
    first, _ = store.create_job(spec(), idempotency_key="k1")
    # Presets by name and presets written out are the same request.
    again, new = store.create_job(spec().resolved(), idempotency_key="k1")
    assert not new
    assert again == first
    assert len(store.jobs().items) == 1


def test_the_same_key_for_another_spec_is_refused_and_names_the_job(store: SqlStore) -> None:
    first, _ = store.create_job(spec(), idempotency_key="k1")
    with pytest.raises(IdempotencyConflict, match=first.id):
        store.create_job(spec(iterations=4), idempotency_key="k1")
    assert len(store.jobs().items) == 1


def test_without_a_key_every_submission_is_a_job(store: SqlStore) -> None:
    assert store.create_job(spec())[0].id != store.create_job(spec())[0].id


@pytest.mark.parametrize("key", ["", "x" * 201, "nul\0", "line\n"])
def test_a_key_that_cannot_be_stored_is_refused(store: SqlStore, key: str) -> None:
    with pytest.raises(InvalidRequest, match="idempotency_key"):
        store.create_job(spec(), idempotency_key=key)
    assert store.jobs().items == ()


@pytest.mark.parametrize("job_id", ["", "nothing", "b" * 12, "nul\0", "\ud800", "x" * 10_000])
def test_an_unknown_id_is_not_found_by_any_method(store: SqlStore, job_id: str) -> None:
    for ask_for_it in (
        lambda: store.job(job_id),
        lambda: store.command(job_id, Command.PAUSE),
        lambda: store.claim("runner", lease_seconds=1.0, job_id=job_id),
        lambda: store.iterations(job_id),
        lambda: store.evaluations(job_id, 0),
        lambda: store.evaluations_between(job_id, 0, 1),
        lambda: store.best(job_id),
    ):
        with pytest.raises(NotFound):
            ask_for_it()


def test_pages_go_from_the_newest_to_the_oldest_and_then_end(store: SqlStore, clock: Clock) -> None:
    made = []
    for _ in range(5):
        made.append(store.create_job(spec())[0].id)
        clock.advance(0.001)
    first = store.jobs(limit=2)
    second = store.jobs(limit=2, after=first.next)
    third = store.jobs(limit=2, after=second.next)
    listed = [job.id for page in (first, second, third) for job in page.items]
    assert listed == made[::-1]
    assert third.next is None


def test_a_full_last_page_has_no_next(store: SqlStore) -> None:
    store.create_job(spec())
    store.create_job(spec())
    assert store.jobs(limit=2).next is None


def test_pages_are_whole_when_all_jobs_were_made_in_the_same_instant(store: SqlStore) -> None:
    made = {store.create_job(spec())[0].id for _ in range(7)}
    listed, after = [], None
    while True:
        page = store.jobs(limit=3, after=after)
        listed += [job.id for job in page.items]
        after = page.next
        if after is None:
            break
    assert len(listed) == 7 and set(listed) == made


def test_a_job_made_between_two_pages_does_not_shift_the_second(
    store: SqlStore, clock: Clock
) -> None:
    made = []
    for _ in range(4):
        made.append(store.create_job(spec())[0].id)
        clock.advance(1.0)
    first = store.jobs(limit=2)
    store.create_job(spec())
    assert [job.id for job in store.jobs(limit=2, after=first.next).items] == [made[1], made[0]]


def test_the_list_can_be_filtered_by_state(store: SqlStore, clock: Clock) -> None:
    kept, _ = store.create_job(spec())
    clock.advance(1.0)
    paused, _ = store.create_job(spec())
    store.command(paused.id, Command.PAUSE)
    assert [job.id for job in store.jobs(state=JobState.QUEUED).items] == [kept.id]
    assert [job.id for job in store.jobs(state=JobState.PAUSED).items] == [paused.id]


@pytest.mark.parametrize(
    "after",
    ["", "x", "1.", "12.bbb", "999999999999999999.bbbbbbbbbbbb", "1.BBBBBBBBBBBB", "-1.b", "\0"],
)
def test_what_is_not_a_cursor_is_refused_by_name(store: SqlStore, after: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        store.jobs(after=after)
    assert refused.value.field == "after"


def test_a_page_of_nothing_is_refused(store: SqlStore) -> None:
    with pytest.raises(InvalidRequest, match="limit"):
        store.jobs(limit=0)
