"""The audit log: every change of users is in it, with its author, if and only if it was made."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from typing import Any

import pytest

from gaitswarm.services.optimizer.access import Scope
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.audit import AuditAction
from gaitswarm.services.optimizer.jobs.job import Command, JobState
from gaitswarm.services.optimizer.store import Store
from tests.store.examples import LEASE, Clock, ask, begun, completed, spec
from tests.store.test_recordings import recording


def noted(store: Store, **only: Any) -> list[tuple[str, str, str | None, dict[str, Any]]]:
    """Entries, the oldest first."""
    entries = store.audit(**only).items[::-1]
    return [(e.actor, e.action.value, e.job_id, e.details) for e in entries]


def test_what_is_done_to_a_job_is_noted_with_who_and_when(store: Store, clock: Clock) -> None:
    job, _ = store.create_job(spec(), owner="ci")
    begun_at = clock.now
    clock.advance(5.0)
    store.command(job.id, Command.PAUSE, actor="ann")
    store.command(job.id, Command.RESUME, accept_changes=True)
    store.extend(job.id, 9, actor="ann")
    store.command(job.id, Command.CANCEL, actor="ann")
    assert noted(store) == [
        ("ci", "submit", job.id, {}),
        ("ann", "pause", job.id, {}),
        ("local", "resume", job.id, {"accept_changes": True}),
        ("ann", "extend", job.id, {"iterations": 9}),
        ("ann", "cancel", job.id, {}),
    ]
    assert [e.at for e in store.audit().items[::-1]] == [begun_at] + [clock.now] * 4


def test_deletions_are_noted_and_stay_so_when_the_job_is_gone(store: Store, clock: Clock) -> None:
    job, old = (store.create_job(spec())[0].id for _ in range(2))
    for one in (job, old):
        store.command(one, Command.CANCEL)
    store.keep(job, True, actor="ann")
    store.keep(job, False)
    store.delete_job(job, actor="ann")
    clock.advance(60.0)
    assert store.delete_ended_before(clock.now) == (old,)
    assert [entry[:2] for entry in noted(store, job_id=job)][2:] == [
        *(("ann", "keep"), ("local", "release"), ("ann", "delete")),
    ]
    assert noted(store, job_id=old)[-1] == ("retention", "delete", old, {})
    assert store.queue().jobs[JobState.CANCELLED] == 0


def test_a_request_that_is_repeated_is_noted_once(store: Store) -> None:
    store.create_job(spec(), idempotency_key="k", owner="ci")
    store.create_job(spec(), idempotency_key="k", owner="ci")
    assert [entry[1] for entry in noted(store)] == ["submit"]


def _cancelled_twice(store: Store, job_id: str) -> None:
    store.command(job_id, Command.CANCEL)


def _extended_too_little(store: Store, job_id: str) -> None:
    store.extend(job_id, 0)


def _revoked_nothing(store: Store, job_id: str) -> None:
    store.tokens.revoke("unknown")


@pytest.mark.parametrize("change", [_cancelled_twice, _extended_too_little, _revoked_nothing])
def test_what_is_refused_is_not_noted(store: Store, change: Callable[[Store, str], None]) -> None:
    job, _ = store.create_job(spec())
    store.command(job.id, Command.CANCEL)
    before = noted(store)
    with pytest.raises((Conflict, InvalidRequest, NotFound)):
        change(store, job.id)
    assert noted(store) == before


def test_what_runners_do_is_not_noted(store: Store) -> None:
    claim = begun(store)
    store.renew(claim, lease_seconds=LEASE)
    store.commit(claim, completed(0), ask(1))
    store.release(claim, JobState.QUEUED)
    assert [entry[1] for entry in noted(store)] == ["submit"]


def test_tokens_are_noted_by_name_and_scope_and_never_by_secret(store: Store) -> None:
    _, secret = store.tokens.create("ci", Scope.SUBMIT)
    store.tokens.revoke("ci")
    store.tokens.revoke("ci")
    assert noted(store) == [
        ("local", "create_token", None, {"name": "ci", "scope": "submit"}),
        ("local", "revoke_token", None, {"name": "ci"}),
    ]
    assert secret not in repr(store.audit())
    with pytest.raises(InvalidRequest, match="audit log"):
        store.tokens.create("local", Scope.READ)


def test_a_recording_is_noted_when_it_is_new(store: Store) -> None:
    name = store.add_recording(recording(), actor="ci")
    store.add_recording(recording(), actor="ann")
    assert noted(store) == [("ci", "add_recording", None, {"recording": name})]


def test_old_entries_are_removed_and_their_numbers_not_given_again(
    store: Store, clock: Clock
) -> None:
    for _ in range(5):
        store.create_job(spec())
    clock.advance(60.0)
    assert store.forget_audit_before(clock.now - timedelta(seconds=61)) == 0
    young = store.create_job(spec())[0].id
    (last,) = store.audit(job_id=young).items
    assert store.forget_audit_before(clock.now) == 5
    assert store.audit().items == (last,)
    assert store.forget_audit_before(clock.now + timedelta(seconds=1)) == 1
    assert store.audit().items == ()
    store.create_job(spec())
    assert store.audit().items[0].index == last.index + 1


def test_the_log_is_read_by_pages_and_by_job(store: Store) -> None:
    jobs = [store.create_job(spec())[0].id for _ in range(3)]
    store.command(jobs[0], Command.CANCEL)
    first = store.audit(limit=3)
    assert [entry.job_id for entry in first.items] == [jobs[0], jobs[2], jobs[1]]
    rest = store.audit(limit=3, after=first.next)
    assert [entry.job_id for entry in rest.items] == [jobs[0]] and rest.next is None
    of_one = store.audit(job_id=jobs[0])
    assert [entry.action for entry in of_one.items] == [AuditAction.CANCEL, AuditAction.SUBMIT]
    assert store.audit(job_id="nothing").items == ()
    for bad in ("x", "-1", "9" * 30):
        with pytest.raises(InvalidRequest, match="cursor"):
            store.audit(after=bad)
