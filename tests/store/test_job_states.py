"""The life of a job: every command in every state, and what the store makes of it."""

from __future__ import annotations

from itertools import product

import pytest

from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.job import TRANSITIONS, Command, JobState, commanded
from gaitswarm.services.optimizer.store import Store
from tests.store.examples import LEASE, Clock, ask, begun, completed, spec

ALLOWED = {
    ("queued", "pause"): "paused",
    ("queued", "cancel"): "cancelled",
    ("running", "pause"): "pausing",
    ("running", "cancel"): "cancelled",
    ("pausing", "resume"): "running",
    ("pausing", "cancel"): "cancelled",
    ("paused", "resume"): "queued",
    ("paused", "cancel"): "cancelled",
    ("failed", "resume"): "queued",
    ("failed", "cancel"): "cancelled",
}
EVERY_PAIR = list(product(JobState, Command))


def in_state(store: Store, state: JobState) -> str:
    """Id of a job that has come into a state as jobs do."""
    if state in (JobState.QUEUED, JobState.PAUSED, JobState.CANCELLED):
        job, _ = store.create_job(spec())
        if state is JobState.PAUSED:
            store.command(job.id, Command.PAUSE)
        if state is JobState.CANCELLED:
            store.command(job.id, Command.CANCEL)
        return job.id
    claim = begun(store)
    if state is JobState.PAUSING:
        store.command(claim.job.id, Command.PAUSE)
    if state is JobState.FAILED:
        store.release(claim, JobState.FAILED, error="the evaluator is broken")
    if state is JobState.SUCCEEDED:
        store.commit(claim, completed(0), None)
    return claim.job.id


@pytest.mark.parametrize(("state", "command"), EVERY_PAIR)
def test_a_command_leads_where_the_table_says_or_is_refused(
    state: JobState, command: Command
) -> None:
    if (state, command) in ALLOWED:
        assert commanded(state, command) == ALLOWED[state, command]
    else:
        with pytest.raises(Conflict, match=state):
            commanded(state, command)


def test_the_table_holds_nothing_else() -> None:
    assert {key: JobState(after) for key, after in ALLOWED.items()} == TRANSITIONS


def test_a_refusal_says_what_is_possible_instead() -> None:
    with pytest.raises(Conflict, match="possible now: resume, cancel"):
        commanded(JobState.PAUSED, Command.PAUSE)
    with pytest.raises(Conflict, match="it has ended"):
        commanded(JobState.SUCCEEDED, Command.RESUME)


@pytest.mark.variants(
    *("sqlite-running-*", "sqlite-queued-pause", "sqlite-paused-resume", "sqlite-failed-resume"),
    *("sqlite-pausing-resume", "sqlite-succeeded-pause"),
)
@pytest.mark.parametrize(("state", "command"), EVERY_PAIR)
def test_the_store_applies_a_command_or_changes_nothing(
    store: Store, state: JobState, command: Command
) -> None:
    job_id = in_state(store, state)
    before = store.job(job_id)
    assert before.state is state
    if (state, command) in ALLOWED:
        after = store.command(job_id, command)
        assert after.state == ALLOWED[state, command]
        assert store.job(job_id) == after
    else:
        with pytest.raises(Conflict):
            store.command(job_id, command)
        assert store.job(job_id) == before


def test_an_ended_job_has_an_end_and_a_resumed_one_has_none(store: Store, clock: Clock) -> None:
    job_id = in_state(store, JobState.FAILED)
    assert store.job(job_id).finished_at == clock.now
    assert store.job(job_id).error == "the evaluator is broken"
    clock.advance(5.0)
    resumed = store.command(job_id, Command.RESUME)
    assert resumed.finished_at is None and resumed.error is None
    assert resumed.updated_at == clock.now


def test_a_cancelled_failure_still_says_why_it_failed(store: Store) -> None:
    job_id = in_state(store, JobState.FAILED)
    assert store.command(job_id, Command.CANCEL).error == "the evaluator is broken"


def test_pausing_a_job_whose_runner_has_gone_completes_at_once(store: Store, clock: Clock) -> None:
    claim = begun(store)
    clock.advance(LEASE + 1.0)
    assert store.command(claim.job.id, Command.PAUSE).state is JobState.PAUSED


def test_a_pause_takes_effect_when_the_iteration_is_committed(store: Store) -> None:
    claim = begun(store)
    store.command(claim.job.id, Command.PAUSE)
    assert store.renew(claim, lease_seconds=LEASE).state is JobState.PAUSING
    assert store.commit(claim, completed(0), ask(1)) is JobState.PAUSED
    assert store.claim("runner-b", lease_seconds=LEASE) is None


def test_a_pause_in_the_last_iteration_comes_too_late(store: Store) -> None:
    claim = begun(store)
    store.command(claim.job.id, Command.PAUSE)
    assert store.commit(claim, completed(0), None) is JobState.SUCCEEDED


def test_a_pause_that_was_taken_back_changes_nothing_for_the_runner(store: Store) -> None:
    claim = begun(store)
    store.command(claim.job.id, Command.PAUSE)
    store.command(claim.job.id, Command.RESUME)
    assert store.commit(claim, completed(0), ask(1)) is JobState.RUNNING


@pytest.mark.parametrize(
    ("asked_to_pause", "released_as", "state"),
    [
        (False, JobState.QUEUED, JobState.QUEUED),
        (True, JobState.QUEUED, JobState.PAUSED),
        (False, JobState.PAUSED, JobState.PAUSED),
        (True, JobState.FAILED, JobState.FAILED),
    ],
)
def test_a_runner_that_stops_leaves_the_job_in_the_state_asked_for(
    store: Store, asked_to_pause: bool, released_as: JobState, state: JobState
) -> None:
    claim = begun(store)
    if asked_to_pause:
        store.command(claim.job.id, Command.PAUSE)
    store.release(claim, released_as, error="why\0" if state is JobState.FAILED else None)
    job = store.job(claim.job.id)
    assert job.state is state
    assert job.error == ("why\N{REPLACEMENT CHARACTER}" if state is JobState.FAILED else None)


def test_a_runner_cannot_release_a_job_as_succeeded(store: Store) -> None:
    with pytest.raises(ValueError, match="succeeded"):
        store.release(begun(store), JobState.SUCCEEDED)
