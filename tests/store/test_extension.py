"""Jobs that get another budget, as they are stored."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import BudgetChanged, Conflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.search.registry import OPTIMIZERS
from gaitswarm.services.optimizer.store import Store
from tests.certificate.examples import small
from tests.store.examples import LEASE, Clock, ask, begun, completed, spec
from tests.store.test_job_states import in_state


@pytest.mark.parametrize("state", [s for s in JobState if s is not JobState.CANCELLED])
def test_the_store_keeps_the_budget_and_the_state_that_follows(
    store: Store, state: JobState
) -> None:
    job_id = in_state(store, state)
    before = store.job(job_id)
    after = store.extend(job_id, 40)
    assert after == store.job(job_id)
    assert after.spec == before.spec.model_copy(update={"iterations": 40})
    assert after.state is (JobState.QUEUED if state is JobState.SUCCEEDED else state)
    assert after.progress == before.progress


def test_a_refused_extension_changes_nothing(store: Store) -> None:
    cancelled, succeeded = (in_state(store, s) for s in (JobState.CANCELLED, JobState.SUCCEEDED))
    before = store.job(cancelled), store.job(succeeded)
    with pytest.raises(Conflict):
        store.extend(cancelled, 40)
    with pytest.raises(InvalidRequest, match="iterations"):
        store.extend(succeeded, 1)
    with pytest.raises(NotFound):
        store.extend("bcdfghjkmnpq", 40)
    assert (store.job(cancelled), store.job(succeeded)) == before


@pytest.mark.parametrize(
    ("asked", "iterations", "words"),
    [
        (small(), 30_000, "worlds: must be at most 100000"),
        (spec().model_copy(update={"optimizer": OPTIMIZERS["random"]}), 20_000, "is replayed"),
    ],
    ids=["certificate", "replayed"],
)
def test_no_job_gets_a_budget_that_it_could_not_be_submitted_with(
    store: Store, asked: Spec, iterations: int, words: str
) -> None:
    job, _ = store.create_job(asked)
    with pytest.raises(InvalidRequest, match=words) as refused:
        store.extend(job.id, iterations)
    assert refused.value.field == "iterations"
    assert store.job(job.id) == job


def test_a_runner_under_an_older_budget_learns_it_before_anything_is_stored(
    store: Store,
) -> None:
    claim = begun(store)
    store.extend(claim.job.id, 40)
    with pytest.raises(BudgetChanged):
        store.commit(claim, completed(0), ask(1))
    assert store.job(claim.job.id).progress.iterations == 0


def test_a_runner_that_begins_under_an_older_budget_learns_it_too(store: Store) -> None:
    store.create_job(spec())
    claim = store.claim("runner-a", lease_seconds=LEASE)
    assert claim is not None
    store.extend(claim.job.id, 40)
    with pytest.raises(BudgetChanged):
        store.begin(claim, ask(0))
    assert store.claim("runner-a", lease_seconds=LEASE) is None
    current = replace(claim, job=store.job(claim.job.id))
    store.begin(current, ask(0))
    # The spec stays, so a restart does not depend on a later budget.
    store.extend(claim.job.id, 50)
    store.begin(current, ask(0))


def test_who_claims_an_extended_job_gets_the_last_ask_with_its_evaluations(
    store: Store, clock: Clock
) -> None:
    claim = begun(store)
    store.commit(claim, completed(0, (4.0, math.inf)), None)
    store.extend(claim.job.id, 40)
    again = store.claim("runner-b", lease_seconds=LEASE)
    assert again is not None and again.ask is None and again.answered is not None
    assert again.answered.ask.iteration == 0
    assert again.answered.ask.state == ask(0).state
    np.testing.assert_array_equal(again.answered.ask.positions, ask(0).positions)
    assert again.answered.columns.fitness.tolist() == [4.0, math.inf]


def test_the_same_key_still_means_the_job_as_it_was_submitted(store: Store) -> None:
    job, _ = store.create_job(spec(), idempotency_key="k1")
    store.extend(job.id, 40)
    again, new = store.create_job(spec(), idempotency_key="k1")
    assert not new and again == store.job(job.id)
    with pytest.raises(Conflict):
        store.create_job(spec(iterations=40), idempotency_key="k1")
