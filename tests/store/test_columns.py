"""Evaluations as columns: every bit that was committed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import RESULTS, Outcome, Status
from tests.store.examples import LEASE, ask, begun, completed, spec
from tests.store.test_bits import anything, column, finite, many

INF = math.inf


def go_on(store: Store, claim: Claim, *fitness: tuple[float, ...]) -> None:
    """Commit one more iteration for every swarm's fitness."""
    start = store.job(claim.job.id).progress.iterations
    for index, values in enumerate(fitness, start):
        store.commit(claim, completed(index, values), ask(index + 1))


def test_columns_hold_what_was_committed(store: Store) -> None:
    claim = begun(store)
    go_on(store, claim, (4.0, INF), (INF, INF), (2.0, 3.0))
    columns = store.evaluation_columns(claim.job.id, 0, 3)
    assert columns is not None
    assert columns.objectives.shape == (6, 2, len(RESULTS))
    assert columns.statuses[1].tolist() == [Status.OK, Status.FELL]
    assert columns.iteration.tolist() == [0, 0, 1, 1, 2, 2]
    assert columns.particle.tolist() == [0, 1] * 3
    assert columns.fitness.tolist() == [4.0, INF, INF, INF, 2.0, 3.0]
    for index, fitness in enumerate(((4.0, INF), (INF, INF), (2.0, 3.0))):
        done, stored = completed(index, fitness), columns.of_iteration(index)
        objectives = np.stack([outcome.objectives for outcome in done.outcomes], axis=1)
        statuses = np.stack([outcome.statuses for outcome in done.outcomes], axis=1)
        assert stored.designs.tobytes() == done.designs.tobytes()
        assert stored.objectives.tobytes() == objectives.tobytes()
        assert stored.statuses.tobytes() == statuses.tobytes()


def test_only_committed_iterations_have_columns(store: Store) -> None:
    claim = begun(store)
    assert store.evaluation_columns(claim.job.id, 0, 10) is None
    go_on(store, claim, (4.0, 3.0), (2.0, 1.0))
    some = store.evaluation_columns(claim.job.id, 1, 2**70)
    assert some is not None and some.iteration.tolist() == [1, 1]
    with pytest.raises(NotFound):
        store.evaluation_columns("bcdfghjkmnpq", 0, 1)


@many
@given(
    designs=st.lists(finite, min_size=2, max_size=2),
    objectives=st.lists(anything, min_size=12, max_size=12),
)
def test_every_bit_of_a_number_comes_back(
    store: Store, designs: list[float], objectives: list[float]
) -> None:
    job, _ = store.create_job(spec(particles=1))
    claim = store.claim("a", lease_seconds=LEASE, job_id=job.id)
    assert claim is not None
    store.begin(claim, ask(0, particles=1))
    ok = np.full(1, Status.OK, dtype=np.uint8)
    outcomes = tuple(Outcome(column(objectives[k : k + 6], 1, 6), ok) for k in (0, 6))
    done = CompletedIteration(0, column(designs, 1, 2), outcomes, np.array([1.0]), 0.5)
    store.commit(claim, done, None)
    columns = store.evaluation_columns(job.id, 0, 1)
    assert columns is not None
    # What is not finite is stored as null.
    expected = [x if math.isfinite(x) else math.nan for x in objectives]
    assert columns.designs.tobytes() == column(designs, 1, 2).tobytes()
    assert columns.objectives.tobytes() == column(expected, 1, 2, 6).tobytes()
