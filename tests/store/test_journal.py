"""Outcomes of finished tasks are kept until their iteration is committed"""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import LeaseLost, NotFound
from gaitswarm.services.optimizer.jobs.iteration import JournalEntry
from gaitswarm.services.optimizer.jobs.job import Claim, JobState
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import Outcome
from tests.store.examples import LEASE, Clock, ask, begun, completed

ENTRIES = [
    JournalEntry(
        case,
        (bytes(range(16)), bytes(range(16, 32))),
        Outcome(np.array([[0.1, np.nan, -0.0], [np.inf, 3.0, 1e-300]]), np.array([0, 2], np.uint8)),
    )
    for case in (1, 0)
]


def next_claim(store: Store) -> Claim:
    claim = store.claim("runner-b", lease_seconds=LEASE)
    assert claim is not None
    return claim


def test_the_next_claim_brings_them_bit_for_bit(store: Store, clock: Clock) -> None:
    claim = begun(store)
    store.journal(claim, ENTRIES[:1])
    store.journal(claim, ENTRIES[1:])
    clock.advance(LEASE)
    journal = next_claim(store).journal
    assert [(entry.case, entry.keys) for entry in journal] == [(e.case, e.keys) for e in ENTRIES]
    for entry, given in zip(journal, ENTRIES, strict=True):
        assert entry.outcome.objectives.tobytes() == given.outcome.objectives.tobytes()
        assert entry.outcome.statuses.tobytes() == given.outcome.statuses.tobytes()


def test_the_commit_removes_them(store: Store, clock: Clock) -> None:
    claim = begun(store)
    store.journal(claim, ENTRIES)
    store.commit(claim, completed(0), ask(1), journaled=True)
    clock.advance(LEASE)
    assert next_claim(store).journal == ()


def test_those_of_another_iteration_are_not_used(store: Store, clock: Clock) -> None:
    claim = begun(store)
    store.journal(claim, ENTRIES)
    store.commit(claim, completed(0), ask(1))
    clock.advance(LEASE)
    assert next_claim(store).journal == ()


def test_a_runner_that_lost_the_job_stores_none(store: Store, clock: Clock) -> None:
    claim = begun(store)
    clock.advance(LEASE)
    taken = next_claim(store)
    with pytest.raises(LeaseLost):
        store.journal(claim, ENTRIES)
    store.release(taken, JobState.QUEUED)
    assert next_claim(store).journal == ()


def test_a_job_is_deleted_with_them(store: Store) -> None:
    claim = begun(store)
    store.journal(claim, ENTRIES)
    store.release(claim, JobState.FAILED, error="of its own")
    store.delete_job(claim.job.id)
    with pytest.raises(NotFound):
        store.job(claim.job.id)
