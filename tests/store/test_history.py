"""Stored iterations."""

from __future__ import annotations

import math
from contextlib import closing

import numpy as np
import pytest
from sqlalchemy import select

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, LeaseLost, NotFound
from gaitswarm.services.optimizer.jobs.job import Claim, Command, JobState
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.tables import iterations
from gaitswarm.sim.outcome import Status
from tests.store.examples import Clock, ask, begun, completed

INF = math.inf


def run(store: Store, *fitness: tuple[float, ...]) -> Claim:
    """A job with one committed iteration for every swarm's fitness, and one more asked."""
    claim = begun(store)
    for index, values in enumerate(fitness):
        store.commit(claim, completed(index, values), ask(index + 1))
    return claim


def test_an_asked_iteration_is_no_history_until_it_is_committed(store: Store) -> None:
    job_id = begun(store).job.id
    assert store.iterations(job_id).items == ()
    assert store.best(job_id) is None
    with pytest.raises(NotFound, match="no committed iteration 0"):
        store.evaluations(job_id, 0)


def test_every_particle_is_kept_with_its_raw_objectives(store: Store) -> None:
    job_id = run(store, (4.0, INF)).job.id
    done = completed(0, (4.0, INF))
    found = store.evaluations(job_id, 0)
    assert [(e.iteration, e.particle) for e in found] == [(0, 0), (0, 1)]
    for e in found:
        np.testing.assert_array_equal(e.design, done.designs[e.particle])
        for k, outcome in enumerate(done.outcomes):
            np.testing.assert_array_equal(e.objectives[k], outcome.objectives[e.particle])
            assert e.statuses[k] == outcome.statuses[e.particle]
    assert found[0].fitness == 4.0 and found[1].fitness == INF
    assert found[1].statuses.tolist() == [Status.OK, Status.FELL]
    assert np.isnan(found[1].objectives[1]).all()
    assert found[1].statuses.dtype == np.uint8


def test_an_iteration_is_summed_up_over_its_finite_fitnesses(store: Store, clock: Clock) -> None:
    job_id = run(store, (5.0, INF, 2.0, 3.5)).job.id
    (iteration,) = store.iterations(job_id).items
    assert (iteration.best, iteration.mean, iteration.median, iteration.worst) == (2, 3.5, 3.5, 5)
    assert (iteration.failed, iteration.evaluate_seconds) == (1, 0.5)
    assert iteration.committed_at == clock.now


def test_a_swarm_that_failed_wholly_has_no_best(store: Store) -> None:
    job_id = run(store, (INF, INF)).job.id
    (iteration,) = store.iterations(job_id).items
    assert iteration.best is iteration.mean is iteration.worst is iteration.best_so_far is None
    assert iteration.failed == 2
    assert store.best(job_id) is None


def test_the_best_so_far_never_rises(store: Store) -> None:
    job_id = run(store, (INF, INF), (4.0, 6.0), (5.0, 7.0), (3.0, 9.0)).job.id
    found = [iteration.best_so_far for iteration in store.iterations(job_id).items]
    assert found == [None, 4.0, 4.0, 3.0]


def test_of_equal_designs_the_earliest_is_the_best(store: Store) -> None:
    job_id = run(store, (4.0, 3.0, 3.0), (3.0, 3.0, 3.0)).job.id
    best = store.best(job_id)
    assert best is not None and (best.iteration, best.particle, best.fitness) == (0, 1, 3.0)


def test_progress_counts_what_is_committed(store: Store) -> None:
    progress = store.job(run(store, (4.0, 3.0), (2.0, INF)).job.id).progress
    assert (progress.iterations, progress.evaluations, progress.compute_seconds) == (2, 4, 1.0)
    assert progress.recent_seconds == 0.25
    assert (progress.best_fitness, progress.best_iteration, progress.best_particle) == (2.0, 1, 0)


def test_a_repeated_commit_changes_nothing(store: Store) -> None:
    claim = run(store, (4.0, 3.0))
    before = store.job(claim.job.id), store.iterations(claim.job.id)
    assert store.commit(claim, completed(0, (1.0, 1.0)), ask(1)) is JobState.RUNNING
    assert (store.job(claim.job.id), store.iterations(claim.job.id)) == before
    assert [e.fitness for e in store.evaluations(claim.job.id, 0)] == [4.0, 3.0]


@pytest.mark.parametrize("command", [None, Command.PAUSE])
def test_a_repeated_commit_that_ended_or_paused_the_job_changes_nothing(
    store: Store, command: Command | None
) -> None:
    claim = begun(store, iterations=2)
    if command is not None:
        store.command(claim.job.id, command)
    given = completed(0), None if command is None else ask(1)
    state = store.commit(claim, *given)
    before = store.job(claim.job.id)
    assert store.commit(claim, *given) is state is before.state
    assert store.job(claim.job.id) == before


def test_a_commit_is_not_taken_for_a_repeated_one_after_another_claim(store: Store) -> None:
    claim = run(store, (4.0, 3.0))
    store.release(claim, JobState.QUEUED)
    assert store.claim("another", lease_seconds=60.0) is not None
    with pytest.raises(LeaseLost):
        store.commit(claim, completed(0), ask(1))


def test_a_repeated_begin_keeps_the_ask_that_is_there(store: Store) -> None:
    claim = begun(store)
    store.begin(claim, ask(0, particles=7))
    store.release(claim, JobState.QUEUED)
    again = store.claim("runner-b", lease_seconds=1.0)
    assert again is not None and again.ask is not None
    np.testing.assert_array_equal(again.ask.positions, ask(0).positions)


def test_an_iteration_that_was_not_asked_cannot_be_committed(store: Store) -> None:
    claim = run(store, (4.0, 3.0))
    before = store.job(claim.job.id)
    with pytest.raises(Conflict, match="its next is 1"):
        store.commit(claim, completed(2), ask(3))
    with pytest.raises(Conflict, match="its next is 2"):
        store.commit(claim, completed(1), ask(3))
    assert store.job(claim.job.id) == before


def test_the_next_ask_and_the_iteration_are_stored_together_or_not_at_all(
    store: Store,
) -> None:
    claim = begun(store)
    following = ask(1)
    following.state["not json"] = math.nan
    with pytest.raises(Exception, match=r"(?i)json"):
        store.commit(claim, completed(0), following)
    assert store.iterations(claim.job.id).items == ()
    assert store.evaluations_between(claim.job.id, 0, 10) == ()
    assert store.job(claim.job.id).progress.iterations == 0


def test_iterations_are_paged_by_index(store: Store) -> None:
    job_id = run(store, *[(1.0, 2.0)] * 5).job.id
    first = store.iterations(job_id, limit=2)
    second = store.iterations(job_id, after=int(first.next or 0), limit=2)
    third = store.iterations(job_id, after=int(second.next or 0), limit=2)
    indices = [[i.index for i in page.items] for page in (first, second, third)]
    assert indices == [[0, 1], [2, 3], [4]]
    assert third.next is None
    assert store.iterations(job_id, after=4).items == ()


def test_an_index_beyond_any_iteration_finds_nothing(store: Store) -> None:
    job_id = run(store, (1.0, 2.0)).job.id
    for index in (-(2**70), -1, 1, 2**31, 2**70):
        with pytest.raises(NotFound):
            store.evaluations(job_id, index)
        assert len(store.iterations(job_id, after=index).items) == (1 if index < 0 else 0)


def test_a_page_of_no_iterations_is_refused(store: Store) -> None:
    with pytest.raises(InvalidRequest, match="limit"):
        store.iterations(begun(store).job.id, limit=0)


def test_evaluations_of_several_iterations_come_in_order(store: Store) -> None:
    job_id = run(store, *[(1.0, 2.0)] * 4).job.id
    found = store.evaluations_between(job_id, 1, 3)
    assert [(e.iteration, e.particle) for e in found] == [(1, 0), (1, 1), (2, 0), (2, 1)]


def test_states_are_kept_of_the_last_commit_and_the_next_ask_alone(
    store: Store, database_url: str
) -> None:
    job_id = run(store, (4.0, 1.0), (3.0, 1.0), (2.0, 1.0)).job.id
    with (
        closing(Database(database_url)) as database,
        database.read() as reading,
    ):
        query = select(iterations.c.optimizer_state).where(iterations.c.job_id == job_id)
        kept = reading.execute(query.order_by(iterations.c.iteration)).scalars().all()
    assert kept == [{}, {}, ask(2).state, ask(3).state]
