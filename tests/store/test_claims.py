"""Claims, heartbeats, expired leases, and fencing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import LeaseLost
from gaitswarm.services.optimizer.jobs.job import (
    LONGEST_LEASE_SECONDS,
    QUARANTINE_AFTER,
    Claim,
    Command,
    JobState,
)
from gaitswarm.services.optimizer.store import Store
from tests.store.examples import LEASE, Clock, ask, begun, completed, spec

DAY = 86400.0


def taken(store: Store, runner: str = "runner-b", job_id: str | None = None) -> Claim:
    claim = store.claim(runner, lease_seconds=LEASE, job_id=job_id)
    assert claim is not None
    return claim


def test_the_oldest_waiting_job_is_claimed_first(store: Store, clock: Clock) -> None:
    made = []
    for _ in range(3):
        made.append(store.create_job(spec())[0].id)
        clock.advance(1.0)
    assert [taken(store).job.id for _ in range(3)] == made
    assert store.claim("runner-b", lease_seconds=LEASE) is None


def test_a_claimed_job_is_running_since_its_first_claim(store: Store, clock: Clock) -> None:
    job, _ = store.create_job(spec())
    clock.advance(1.0)
    first = taken(store)
    assert first.job.state is JobState.RUNNING and first.job.started_at == clock.now
    assert first.ask is None
    assert first.job == store.job(job.id)
    store.release(first, JobState.QUEUED)
    clock.advance(1.0)
    assert taken(store).job.started_at == first.job.started_at


def test_a_certain_job_can_be_claimed_before_its_turn(store: Store, clock: Clock) -> None:
    store.create_job(spec())
    clock.advance(1.0)
    wanted, _ = store.create_job(spec())
    assert taken(store, job_id=wanted.id).job.id == wanted.id
    assert store.claim("runner-b", lease_seconds=LEASE, job_id=wanted.id) is None


def test_a_job_that_is_created_claimed_belongs_to_one_runner_while_its_lease_lives(
    store: Store, clock: Clock
) -> None:
    claim = store.create_claimed_job(spec(), "runner-a", lease_seconds=LEASE)
    assert store.job(claim.job.id) == claim.job
    assert (claim.job.state, claim.job.started_at) == (JobState.RUNNING, clock.now)
    assert (claim.runner, claim.ask, claim.answered) == ("runner-a", None, None)
    clock.advance(LEASE - 0.001)
    assert store.claim("runner-b", lease_seconds=LEASE) is None
    clock.advance(0.001)
    assert taken(store).token > claim.token


def test_a_job_that_is_created_claimed_is_run_with_its_claim(store: Store) -> None:
    claim = store.create_claimed_job(spec(iterations=1), "runner-a", lease_seconds=LEASE)
    store.begin(claim, ask(0))
    assert store.renew(claim, lease_seconds=LEASE).state is JobState.RUNNING
    assert store.commit(claim, completed(0), None) is JobState.SUCCEEDED


def test_the_longest_lease_is_alive_until_its_end(store: Store, clock: Clock) -> None:
    store.create_job(spec())
    assert store.claim("runner-a", lease_seconds=LONGEST_LEASE_SECONDS) is not None
    assert store.claim("runner-b", lease_seconds=LEASE) is None
    clock.advance(LONGEST_LEASE_SECONDS - 0.001)
    assert store.claim("runner-b", lease_seconds=LEASE) is None
    clock.advance(0.001)
    assert taken(store).taken_from == "runner-a"


@pytest.fixture
def killed_with_its_clock_ahead(store: Store, clock: Clock) -> Claim:
    """A claim by a runner whose clock was ahead, after which the clock was set right."""
    clock.advance(60.0)
    claim = begun(store)
    clock.advance(-60.0)
    return claim


def test_a_lease_outlives_a_clock_that_is_set_back_a_little(store: Store, clock: Clock) -> None:
    begun(store)
    clock.advance(-4.9)
    assert store.claim("runner-b", lease_seconds=LEASE) is None


def test_a_job_is_claimed_whose_runner_died_with_its_clock_ahead(
    store: Store, killed_with_its_clock_ahead: Claim
) -> None:
    claim = taken(store, job_id=killed_with_its_clock_ahead.job.id)
    assert claim.taken_from == "runner-a" and claim.ask is not None
    assert store.claim("runner-c", lease_seconds=LEASE) is None


def test_a_job_is_paused_and_resumed_whose_runner_died_with_its_clock_ahead(
    store: Store, killed_with_its_clock_ahead: Claim
) -> None:
    job_id = killed_with_its_clock_ahead.job.id
    assert store.command(job_id, Command.PAUSE).state is JobState.PAUSED
    assert store.command(job_id, Command.RESUME).state is JobState.QUEUED


@pytest.mark.parametrize("before", [JobState.RUNNING, JobState.PAUSING])
def test_a_job_under_way_is_queued_by_resume_once_its_runner_died(
    store: Store, clock: Clock, before: JobState
) -> None:
    claim = begun(store)
    if before is JobState.PAUSING:
        store.command(claim.job.id, Command.PAUSE)
    clock.advance(DAY)
    assert store.command(claim.job.id, Command.RESUME).state is JobState.QUEUED
    assert taken(store).ask is not None


def test_resume_takes_a_job_from_a_runner_whose_clock_is_ahead(
    store: Store, killed_with_its_clock_ahead: Claim
) -> None:
    resumed = store.command(killed_with_its_clock_ahead.job.id, Command.RESUME)
    assert resumed.state is JobState.QUEUED
    with pytest.raises(LeaseLost):
        store.renew(killed_with_its_clock_ahead, lease_seconds=LEASE)


def test_a_heartbeat_prolongs_the_lease(store: Store, clock: Clock) -> None:
    claim = begun(store)
    clock.advance(LEASE - 1.0)
    assert store.renew(claim, lease_seconds=LEASE).state is JobState.RUNNING
    clock.advance(LEASE - 1.0)
    assert store.claim("runner-b", lease_seconds=LEASE) is None


def test_a_job_whose_lease_ran_out_continues_with_the_ask_that_was_stored(
    store: Store, clock: Clock
) -> None:
    first = begun(store)
    store.commit(first, completed(0), ask(1))
    clock.advance(LEASE)
    second = taken(store)
    assert second.job.id == first.job.id and second.token > first.token
    assert second.job.progress.iterations == 1
    assert second.ask is not None
    assert second.ask.iteration == 1 and second.ask.state == ask(1).state
    np.testing.assert_array_equal(second.ask.positions, ask(1).positions)


@pytest.mark.parametrize("ended", [JobState.PAUSED, JobState.FAILED])
def test_a_resumed_job_continues_with_the_ask_that_was_stored(
    store: Store, ended: JobState
) -> None:
    first = begun(store)
    store.release(first, ended)
    store.command(first.job.id, Command.RESUME)
    second = taken(store)
    assert second.ask is not None and second.ask.iteration == 0
    assert second.token > first.token


def test_a_pausing_job_whose_runner_died_is_paused_and_not_claimed(
    store: Store, clock: Clock
) -> None:
    claim = begun(store)
    store.command(claim.job.id, Command.PAUSE)
    clock.advance(1.0)
    waiting, _ = store.create_job(spec())
    clock.advance(LEASE)
    assert taken(store).job.id == waiting.id
    assert store.job(claim.job.id).state is JobState.PAUSED


Lose = Callable[[Store, Clock, Claim], None]


def overtaken(store: Store, clock: Clock, claim: Claim) -> None:
    clock.advance(LEASE)
    taken(store)


def overtaken_by_itself(store: Store, clock: Clock, claim: Claim) -> None:
    clock.advance(LEASE)
    taken(store, claim.runner)


def cancelled(store: Store, clock: Clock, claim: Claim) -> None:
    store.command(claim.job.id, Command.CANCEL)


def released(store: Store, clock: Clock, claim: Claim) -> None:
    store.release(claim, JobState.QUEUED)


def finished(store: Store, clock: Clock, claim: Claim) -> None:
    store.commit(claim, completed(0), None)


@pytest.mark.variants("sqlite-*", "postgresql-overtaken")
@pytest.mark.parametrize(
    "lose",
    [overtaken, overtaken_by_itself, cancelled, released, finished],
    ids=lambda f: f.__name__,
)
def test_a_stale_claim_can_write_nothing(store: Store, clock: Clock, lose: Lose) -> None:
    claim = begun(store)
    lose(store, clock, claim)
    before = store.job(claim.job.id), store.iterations(claim.job.id)
    index = before[0].progress.iterations
    for write in (
        lambda: store.commit(claim, completed(index), ask(index + 1)),
        lambda: store.commit(claim, completed(index), None),
        lambda: store.begin(claim, ask(0)),
        lambda: store.renew(claim, lease_seconds=LEASE),
        lambda: store.release(claim, JobState.FAILED, error="late"),
    ):
        with pytest.raises(LeaseLost, match="runner-a has lost job"):
            write()
    assert (store.job(claim.job.id), store.iterations(claim.job.id)) == before


def test_a_lease_that_ran_out_but_was_not_taken_is_still_good(store: Store, clock: Clock) -> None:
    claim = begun(store)
    clock.advance(1000 * LEASE)
    assert store.commit(claim, completed(0), ask(1)) is JobState.RUNNING


def crash(store: Store, clock: Clock, times: int, runner: str = "") -> list[Claim]:
    """Runners that claim the job, and are not heard of any more."""
    claims = []
    for number in range(times):
        claims.append(taken(store, runner or f"killed-{number}"))
        clock.advance(LEASE)
    return claims


def test_a_job_that_takes_runner_after_runner_down_is_quarantined_and_others_run(
    store: Store, clock: Clock
) -> None:
    poison, _ = store.create_job(spec())
    clock.advance(1.0)
    sound, _ = store.create_job(spec())
    *_, last = crash(store, clock, QUARANTINE_AFTER)
    assert taken(store).job.id == sound.id
    found = store.job(poison.id)
    assert found.state is JobState.FAILED
    assert found.error is not None and "quarantined: 5 runner processes in a row" in found.error
    assert last.runner in found.error and "resume" in found.error
    with pytest.raises(LeaseLost):
        store.begin(last, ask(0))


def test_a_quarantined_job_that_is_resumed_is_tried_as_often_again(
    store: Store, clock: Clock
) -> None:
    job, _ = store.create_job(spec())
    for _ in range(2):
        crash(store, clock, QUARANTINE_AFTER)
        assert store.claim("runner-b", lease_seconds=LEASE) is None
        assert store.job(job.id).state is JobState.FAILED
        assert store.command(job.id, Command.RESUME).state is JobState.QUEUED
    assert taken(store).job.error is None


def test_a_job_that_commits_between_crashes_is_never_quarantined(
    store: Store, clock: Clock
) -> None:
    begun(store, iterations=100)
    for iteration in range(3):
        clock.advance(LEASE)
        *_, last = crash(store, clock, QUARANTINE_AFTER - 2)
        # The last of them has committed something before it was killed.
        assert store.commit(last, completed(iteration), ask(iteration + 1)) is JobState.RUNNING
    assert taken(store).job.state is JobState.RUNNING


def test_claims_that_were_given_up_in_order_do_not_count_and_do_not_reset(
    store: Store, clock: Clock
) -> None:
    job, _ = store.create_job(spec())
    crash(store, clock, QUARANTINE_AFTER - 1)
    for number in range(3):
        store.release(taken(store, f"stopped-{number}"), JobState.QUEUED)
    assert taken(store, "killed").job.state is JobState.RUNNING
    clock.advance(LEASE)
    assert store.claim("runner-b", lease_seconds=LEASE) is None
    assert store.job(job.id).state is JobState.FAILED


def test_a_runner_that_lives_may_take_up_its_own_job_as_often_as_its_machine_sleeps(
    store: Store, clock: Clock
) -> None:
    store.create_job(spec())
    crash(store, clock, 3 * QUARANTINE_AFTER, runner="laptop")
    assert taken(store, "laptop").job.state is JobState.RUNNING


def test_how_many_crashes_it_takes_is_a_setting(store: Store, clock: Clock) -> None:
    job, _ = store.create_job(spec())
    crash(store, clock, 1)
    assert store.claim("runner-b", lease_seconds=LEASE, quarantine_after=1) is None
    assert store.job(job.id).state is JobState.FAILED


def test_what_a_job_waits_for_is_reported_until_it_waits_no_longer(
    store: Store, clock: Clock
) -> None:
    claim = begun(store)
    clock.advance(1.0)
    store.renew(claim, lease_seconds=LEASE, waiting="no route to host")
    found = store.job(claim.job.id)
    assert (found.waiting, found.updated_at) == ("no route to host", clock.now)
    store.renew(claim, lease_seconds=LEASE)
    assert store.job(claim.job.id).waiting is None
    store.renew(claim, lease_seconds=LEASE, waiting="no route to host")
    store.release(claim, JobState.QUEUED)
    assert store.job(claim.job.id).waiting is None
