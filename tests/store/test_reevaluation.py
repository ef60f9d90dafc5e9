"""The best design of a search in single precision is kept as it was judged in double."""

from __future__ import annotations

import math

import numpy as np

from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration, Reevaluation
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import Status
from tests.store.examples import LEASE, ask, completed, spec

NAN = math.nan


def begun(store: Store) -> Claim:
    store.create_job(spec().model_copy(update={"precision": "single"}))
    claim = store.claim("runner", lease_seconds=LEASE)
    assert claim is not None
    store.begin(claim, ask(0))
    return claim


def searched(index: int, fitness: tuple[float, ...], double: float | None) -> CompletedIteration:
    """An iteration whose best particle has fitness `double` in double; None: not reevaluated."""
    done = completed(index, fitness)._replace(precision="single")
    if double is None:
        return done
    fell = math.isinf(double)
    objectives = np.full((2, 6), NAN if fell else double / 7.0)
    statuses = np.full(2, Status.FELL if fell else Status.OK, dtype=np.uint8)
    reevaluation = Reevaluation(int(np.argmin(fitness)), objectives, statuses, double)
    return done._replace(reevaluation=reevaluation)


def test_both_precisions_of_the_best_design_are_kept_with_every_bit(store: Store) -> None:
    claim = begun(store)
    done = searched(0, (4.0, 3.0), 3.0 + 1e-7)
    store.commit(claim, done, ask(1))
    best = store.best(claim.job.id)
    assert best is not None and best.reevaluation is not None and done.reevaluation is not None
    assert (best.particle, best.fitness, best.reevaluation.fitness) == (1, 3.0, 3.0 + 1e-7)
    np.testing.assert_array_equal(best.objectives[0], done.outcomes[0].objectives[1])
    np.testing.assert_array_equal(best.reevaluation.objectives, done.reevaluation.objectives)
    assert best.reevaluation.statuses.tolist() == [Status.OK, Status.OK]


def test_the_best_is_the_least_in_double_precision(store: Store) -> None:
    claim = begun(store)
    job_id = claim.job.id
    store.commit(claim, searched(0, (4.0, 3.0), 3.5), ask(1))
    # In single it is better than the best, in double it is not.
    store.commit(claim, searched(1, (3.4, 9.0), 3.6), ask(2))
    progress = store.job(job_id).progress
    assert (progress.best_fitness, progress.best_iteration, progress.best_particle) == (3.5, 0, 1)
    store.commit(claim, searched(2, (3.4, 3.3), 3.3), None)
    best = store.best(job_id)
    assert best is not None and (best.iteration, best.particle) == (2, 1)
    listed = store.iterations(job_id).items
    assert [i.best_so_far for i in listed] == [3.5, 3.5, 3.3]
    assert [i.best for i in listed] == [3.0, 3.4, 3.3], "statistics of the swarm, in single"


def test_a_swarm_that_was_not_reevaluated_in_double_adds_no_best(store: Store) -> None:
    claim = begun(store)
    store.commit(claim, searched(0, (4.0, 3.0), 3.5), ask(1))
    store.commit(claim, searched(1, (1.0, 2.0), None), ask(2))
    assert store.job(claim.job.id).progress.best_fitness == 3.5


def test_a_design_that_falls_in_double_is_no_best(store: Store) -> None:
    claim = begun(store)
    store.commit(claim, searched(0, (4.0, 3.0), math.inf), ask(1))
    assert store.best(claim.job.id) is None
    assert store.iterations(claim.job.id).items[0].best_so_far is None
    assert [e.fitness for e in store.evaluations(claim.job.id, 0)] == [4.0, 3.0]


def test_a_repeated_commit_changes_nothing(store: Store) -> None:
    claim = begun(store)
    store.commit(claim, searched(0, (4.0, 3.0), 3.5), ask(1))
    before = store.job(claim.job.id)
    store.commit(claim, searched(0, (4.0, 3.0), 3.4), ask(1))
    assert store.job(claim.job.id) == before
    best = store.best(claim.job.id)
    assert best is not None and best.reevaluation is not None
    assert best.reevaluation.fitness == 3.5
