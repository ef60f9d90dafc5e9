"""Jobs as their users see them: submitted once, listed in stable pages."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from datetime import UTC

import pytest

from gaitswarm.services.optimizer.errors import IdempotencyConflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.job import Command, Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.store import Store
from tests.store.examples import LEASE, Clock, ask, completed, spec


def certificate(name: str) -> CertificateSpec:
    design = {"P": 0.4, "I": 0.1}
    return CertificateSpec(kind="certificate", name=name, design=design, controller="pi")


def test_a_new_job_is_queued_and_reads_back_as_it_was_returned(store: Store, clock: Clock) -> None:
    job, new = store.create_job(spec(name="größer, and 'quoted'"))
    assert new
    assert job.state is JobState.QUEUED
    assert job.spec == spec(name="größer, and 'quoted'").resolved()
    assert job.created_at == job.updated_at == clock.now
    assert job.progress.iterations == 0 and job.progress.best_fitness is None
    assert store.job(job.id) == job


def test_times_come_back_in_utc_to_the_microsecond(store: Store, clock: Clock) -> None:
    job, _ = store.create_job(spec())
    assert store.job(job.id).created_at.tzinfo is UTC
    assert store.job(job.id).created_at.microsecond == clock.now.microsecond == 678901


def test_the_same_key_and_spec_give_the_same_job(store: Store) -> None:
    first, _ = store.create_job(spec(), idempotency_key="k1")
    # Presets by name and presets written out are the same request.
    again, new = store.create_job(spec().resolved(), idempotency_key="k1")
    assert not new
    assert again == first
    assert len(store.jobs().items) == 1


def test_the_same_key_for_another_spec_is_refused_and_names_the_job(store: Store) -> None:
    first, _ = store.create_job(spec(), idempotency_key="k1")
    with pytest.raises(IdempotencyConflict, match=first.id):
        store.create_job(spec(iterations=4), idempotency_key="k1")
    assert len(store.jobs().items) == 1


def test_without_a_key_every_submission_is_a_job(store: Store) -> None:
    assert store.create_job(spec())[0].id != store.create_job(spec())[0].id


def test_a_key_that_cannot_be_stored_is_refused(store: Store) -> None:
    for key in ("", "x" * 201, "nul\0", "line\n"):
        with pytest.raises(InvalidRequest, match="idempotency_key"):
            store.create_job(spec(), idempotency_key=key)
    assert store.jobs().items == ()


def test_an_unknown_id_is_not_found_by_any_method(store: Store) -> None:
    methods: list[Callable[[str], object]] = [
        *(store.job, store.iterations, store.best),
        lambda job_id: store.command(job_id, Command.PAUSE),
        lambda job_id: store.claim("runner", lease_seconds=1.0, job_id=job_id),
        lambda job_id: store.evaluations(job_id, 0),
        lambda job_id: store.evaluations_between(job_id, 0, 1),
    ]
    for job_id in ("", "nothing", "b" * 12, "nul\0", "\ud800", "x" * 10_000):
        for ask_for_it in methods:
            with pytest.raises(NotFound):
                ask_for_it(job_id)


def test_pages_go_from_the_newest_to_the_oldest_and_then_end(store: Store, clock: Clock) -> None:
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


def test_a_full_last_page_has_no_next(store: Store) -> None:
    store.create_job(spec())
    store.create_job(spec())
    assert store.jobs(limit=2).next is None


def test_pages_are_whole_when_all_jobs_were_made_in_the_same_instant(store: Store) -> None:
    made = {store.create_job(spec())[0].id for _ in range(7)}
    listed, after = [], None
    while True:
        page = store.jobs(limit=3, after=after)
        listed += [job.id for job in page.items]
        after = page.next
        if after is None:
            break
    assert len(listed) == 7 and set(listed) == made


def test_a_job_made_between_two_pages_does_not_shift_the_second(store: Store, clock: Clock) -> None:
    made = []
    for _ in range(4):
        made.append(store.create_job(spec())[0].id)
        clock.advance(1.0)
    first = store.jobs(limit=2)
    store.create_job(spec())
    assert [job.id for job in store.jobs(limit=2, after=first.next).items] == [made[1], made[0]]


def test_the_list_can_be_filtered_by_state(store: Store, clock: Clock) -> None:
    kept, _ = store.create_job(spec())
    clock.advance(1.0)
    paused, _ = store.create_job(spec())
    store.command(paused.id, Command.PAUSE)
    assert [job.id for job in store.jobs(state=JobState.QUEUED).items] == [kept.id]
    assert [job.id for job in store.jobs(state=JobState.PAUSED).items] == [paused.id]


def listed(store: Store, **question: object) -> list[str]:
    """Names of all jobs that are asked for, read in pages of two."""
    names, after = [], None
    while True:
        page = store.jobs(limit=2, after=after, **question)  # type: ignore[arg-type]
        names += [job.spec.name for job in page.items]
        after = page.next
        if after is None:
            return names


def named(store: Store, clock: Clock, *names: str) -> list[Job]:
    made = []
    for name in names:
        made.append(store.create_job(spec(name=name))[0])
        clock.advance(1.0)
    return made


def with_fitness(store: Store, job: Job, fitness: float) -> None:
    claim = store.claim("runner", lease_seconds=LEASE, job_id=job.id)
    assert claim is not None
    store.begin(claim, ask(0))
    store.commit(claim, completed(0, (fitness, fitness + 1.0)), ask(1))


def test_the_list_can_be_searched_by_name_whatever_its_case(store: Store, clock: Clock) -> None:
    named(store, clock, "a SLOW one", "Slow walk", "größe", "100%")
    for text, found in {
        "slow": ["Slow walk", "a SLOW one"],
        "GRÖẞE": ["größe"],
        "%": ["100%"],
        "_": [],
        "nothing like it": [],
        "": ["100%", "größe", "Slow walk", "a SLOW one"],
    }.items():
        assert listed(store, search=text) == found, text


def test_a_name_of_any_characters_keeps_no_other_job_from_the_list(
    store: Store, clock: Clock
) -> None:
    made = named(store, clock, "'; DROP", '"\\ü\U0001f916', "plain")
    listed = store.jobs(order=JobOrder.NAME).items
    assert {job.id for job in listed} == {job.id for job in made}
    assert [job.id for job in store.jobs(search="ü").items] == [made[1].id]


def test_the_list_can_be_searched_by_a_part_of_the_id(store: Store, clock: Clock) -> None:
    wanted, _ = named(store, clock, "one", "two")
    assert [job.id for job in store.jobs(search=wanted.id[2:].upper()).items] == [wanted.id]


def test_the_list_can_be_sorted_by_name_and_those_without_come_last(
    store: Store, clock: Clock
) -> None:
    named(store, clock, "b", "", "A", "ç" * 200, "a")
    names = listed(store, order=JobOrder.NAME)
    assert sorted(names[:2]) == ["A", "a"]
    assert names[2:] == ["b", "ç" * 200, ""]


def test_the_list_can_be_sorted_by_fitness_and_those_without_come_last(
    store: Store, clock: Clock
) -> None:
    third, _, first, second, _ = named(store, clock, "third", "none", "first", "second", "none")
    with_fitness(store, third, 1e22)
    with_fitness(store, first, 0.1)
    with_fitness(store, second, 0.1 + 2.0**-52)
    assert listed(store, order=JobOrder.FITNESS) == ["first", "second", "third", "none", "none"]


def test_search_order_and_state_go_together(store: Store, clock: Clock) -> None:
    jobs = named(store, clock, "walk b", "walk a", "other", "walk c")
    store.command(jobs[0].id, Command.PAUSE)
    found = listed(store, order=JobOrder.NAME, search="walk", state=JobState.QUEUED)
    assert found == ["walk a", "walk c"]


@pytest.mark.variants("sqlite-created", "sqlite-gain", "sqlite-rate", "postgresql-created")
@pytest.mark.parametrize("order", list(JobOrder))
def test_jobs_made_between_two_pages_repeat_nothing(
    store: Store, clock: Clock, order: JobOrder
) -> None:
    made = {job.id for job in named(store, clock, "m", "n", "", "m")}
    first = store.jobs(limit=2, order=order, search="")
    named(store, clock, "a", "z")
    rest = store.jobs(limit=10, order=order, after=first.next)
    ids = [job.id for job in (*first.items, *rest.items)]
    assert len(set(ids)) == len(ids) and made <= set(ids)


def refuses_cursor(store: Store, order: JobOrder, after: str | None) -> bool:
    with pytest.raises(InvalidRequest) as refused:
        store.jobs(order=order, after=after)
    return refused.value.field == "after"


def test_a_cursor_belongs_to_its_order(store: Store, clock: Clock) -> None:
    named(store, clock, "a", "b", "c")
    cursors = {order: store.jobs(limit=1, order=order).next for order in JobOrder}
    for order, other in itertools.permutations(JobOrder, 2):
        assert refuses_cursor(store, order, cursors[other])


def test_what_is_not_a_cursor_is_refused_by_name(store: Store) -> None:
    for after in ("name:bcdfghjkmnpq", "\0"):
        assert refuses_cursor(store, JobOrder.NAME, after)
    for after in ("fitness:1e:bcdfghjkmnpq", "fitness:nan:bcdfghjkmnpq", ""):
        assert refuses_cursor(store, JobOrder.FITNESS, after)
    long = "999999999999999999.bbbbbbbbbbbb"
    for after in ("", "x", "1.", "12.bbb", long, "1.BBBBBBBBBBBB", "-1.b", "\0"):
        assert refuses_cursor(store, JobOrder.CREATED, after)


def test_a_page_of_nothing_is_refused(store: Store) -> None:
    with pytest.raises(InvalidRequest, match="limit"):
        store.jobs(limit=0)


def test_jobs_of_one_kind_are_found_among_all_others_in_every_order(
    store: Store, clock: Clock
) -> None:
    wanted: list[str] = []
    for number in range(3):
        store.create_job(spec(name=f"certificate {number}"))
        clock.advance(0.001)
        wanted.insert(0, store.create_job(certificate(name=str(number)))[0].id)
        clock.advance(0.001)
    assert [job.id for job in store.jobs(kind="certificate").items] == wanted
    named = store.jobs(kind="certificate", order=JobOrder.NAME).items
    assert [job.id for job in named] == wanted[::-1]
    assert [job.id for job in store.jobs(kind="certificate", search="1").items] == [wanted[1]]
    page = store.jobs(kind="certificate", limit=2)
    assert [job.id for job in page.items] == wanted[:2]
    (last,) = store.jobs(kind="certificate", limit=2, after=page.next).items
    assert last.id == wanted[2]
