"""Priorities: which job is claimed next, and that nothing that is remembered depends on it."""

from __future__ import annotations

import pytest

from gaitswarm.services.optimizer.errors import Conflict, NotFound
from gaitswarm.services.optimizer.jobs.job import Command, JobState
from gaitswarm.services.optimizer.store import Store
from tests.store.examples import LEASE, Clock, ask, begun, completed, spec


def claimed(store: Store) -> str | None:
    claim = store.claim("runner-b", lease_seconds=LEASE)
    return None if claim is None else claim.job.id


def test_of_waiting_jobs_the_highest_is_claimed_first_and_the_oldest_among_equals(
    store: Store, clock: Clock
) -> None:
    ids: dict[str, str] = {}
    for name, priority in {"low": -10, "usual": 0, "later": 0, "high": 10, "as high": 10}.items():
        ids[name] = store.create_job(spec(name=name), priority=priority)[0].id
        clock.advance(1.0)
    order = [claimed(store) for _ in ids]
    assert order == [ids[n] for n in ("high", "as high", "usual", "later", "low")]


def test_a_job_whose_runner_has_gone_waits_like_any_other(store: Store, clock: Clock) -> None:
    abandoned = begun(store)
    clock.advance(LEASE)
    urgent, _ = store.create_job(spec(), priority=1)
    assert [claimed(store), claimed(store)] == [urgent.id, abandoned.job.id]


def test_a_waiting_job_gets_another_place_in_the_queue(store: Store, clock: Clock) -> None:
    first = store.create_job(spec())[0].id
    clock.advance(1.0)
    second, _ = store.create_job(spec())
    assert second.priority == 0
    assert store.prioritize(second.id, 3).priority == 3
    assert store.job(second.id).priority == 3
    assert [claimed(store), claimed(store)] == [second.id, first]


def test_the_runner_of_a_job_learns_its_priority_with_the_next_heartbeat(store: Store) -> None:
    claim = begun(store)
    assert store.renew(claim, lease_seconds=LEASE).priority == 0
    store.prioritize(claim.job.id, -4)
    assert store.renew(claim, lease_seconds=LEASE).priority == -4


def test_a_job_that_has_ended_keeps_its_priority(store: Store) -> None:
    job, _ = store.create_job(spec(), priority=2)
    store.command(job.id, Command.CANCEL)
    with pytest.raises(Conflict, match="cannot prioritize a job that is cancelled"):
        store.prioritize(job.id, 5)
    assert store.job(job.id).priority == 2
    with pytest.raises(NotFound):
        store.prioritize("nosuchjob123", 5)


def test_a_change_is_in_the_audit_log(store: Store) -> None:
    job, _ = store.create_job(spec())
    store.prioritize(job.id, 5, actor="ann")
    entry = store.audit(job_id=job.id).items[0]
    assert (entry.actor, entry.action.value, entry.details) == (
        "ann",
        "prioritize",
        {"priority": 5},
    )


def test_a_request_that_is_repeated_finds_its_job_whatever_its_priority(store: Store) -> None:
    job, _ = store.create_job(spec(), idempotency_key="k", priority=1)
    again, new = store.create_job(spec(), idempotency_key="k", priority=9)
    assert (again.id, again.priority, new) == (job.id, 1, False)


def test_the_chain_of_a_job_is_the_same_under_any_priority(store: Store) -> None:
    heads = []
    for priority in (0, 7):
        job, _ = store.create_job(spec(), priority=priority)
        claim = store.claim("runner-a", lease_seconds=LEASE)
        assert claim is not None and claim.job.id == job.id
        store.begin(claim, ask(0))
        if priority:
            store.prioritize(job.id, -3)
        assert store.commit(claim, completed(0), ask(1)) is JobState.RUNNING
        heads.append(store.job(job.id).progress.head)
    assert heads[0] is not None and heads[0] == heads[1]
