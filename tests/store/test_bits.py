"""Floats come back from the database bit for bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import Outcome
from tests.store.examples import LEASE, spec

# The fixture's database is shared by the examples on purpose: each makes a job of its own.
many = settings(
    deadline=None,
    max_examples=4,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
awkward = st.sampled_from(
    [-0.0, 5e-324, -2.2250738585072009e-308, 1.7976931348623157e308, 0.1, 1e22, 2.0**53 + 2.0]
)
finite = st.one_of(st.floats(allow_nan=False, allow_infinity=False), awkward)
anything = st.one_of(st.floats(), awkward)


def bits(values: object) -> list[int]:
    return np.asarray(values, dtype=np.float64).reshape(-1).view(np.uint64).tolist()


def column(values: list[float], *shape: int) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64).reshape(shape)


@many
@given(
    positions=st.lists(finite, min_size=40, max_size=40),
    state=st.dictionaries(
        st.text('aé"\\\0', max_size=3), st.one_of(finite, st.integers()), max_size=4
    ),
)
def test_an_ask_comes_back_exactly(
    store: Store, positions: list[float], state: dict[str, float]
) -> None:
    job, _ = store.create_job(spec(particles=20))
    claim = store.claim("a", lease_seconds=LEASE, job_id=job.id)
    assert claim is not None
    store.begin(claim, Ask(0, column(positions, 20, 2), dict(state)))
    store.release(claim, JobState.QUEUED)
    again = store.claim("b", lease_seconds=LEASE, job_id=job.id)
    assert again is not None and again.ask is not None
    assert again.ask.positions.shape == (20, 2)
    assert bits(again.ask.positions) == bits(positions)
    assert {k: (type(v), repr(v)) for k, v in again.ask.state.items()} == {
        k: (type(v), repr(v)) for k, v in state.items()
    }


@many
@given(
    design=st.lists(finite, min_size=2, max_size=2),
    objectives=st.lists(anything, min_size=12, max_size=12),
    fitness=st.one_of(st.floats(min_value=0.0, allow_nan=False), st.just(5e-324)),
)
def test_an_evaluation_comes_back_exactly(
    store: Store, design: list[float], objectives: list[float], fitness: float
) -> None:
    job, _ = store.create_job(spec(particles=1))
    claim = store.claim("a", lease_seconds=LEASE, job_id=job.id)
    assert claim is not None
    store.begin(claim, Ask(0, column([0.0, 0.0], 1, 2), {}))
    given_ = column(objectives, 2, 1, 6)
    outcomes = tuple(Outcome(scenario, np.zeros(1, dtype=np.uint8)) for scenario in given_)
    store.commit(
        claim,
        CompletedIteration(0, column(design, 1, 2), outcomes, column([fitness], 1), 0.1),
        None,
    )
    (found,) = store.evaluations(job.id, 0)
    assert bits(found.design) == bits(design)
    assert found.objectives.shape == (2, 6)
    # An objective that is not finite is missing.
    assert bits(found.objectives) == bits(np.where(np.isfinite(given_), given_, np.nan))
    assert bits(found.fitness) == bits(fitness)
    best = store.best(job.id)
    assert (best is None) == (fitness == math.inf)


@many
@given(low=finite.filter(lambda x: abs(x) < 1e300), seed=st.integers(0, 2**63 - 1))
def test_a_spec_comes_back_exactly(store: Store, low: float, seed: int) -> None:
    asked = JobSpec.model_validate(
        {
            "controller": "pi",
            "variables": [{"name": "P", "low": low, "high": abs(low) * 2.0 + 1.0}],
            "fixed": {"I": low},
            "seed": seed,
        }
    )
    job, _ = store.create_job(asked)
    found = store.job(job.id).spec
    assert found == asked.resolved()
    assert bits(found.fixed["I"]) == bits(low)
    assert bits(found.design_space().box.low) == bits(low)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_ask_that_is_no_number_is_refused_rather_than_changed(store: Store, bad: float) -> None:
    job, _ = store.create_job(spec())
    claim = store.claim("a", lease_seconds=LEASE, job_id=job.id)
    assert claim is not None
    with pytest.raises(ValueError, match="a position of iteration 0 is not a finite number"):
        store.begin(claim, Ask(0, column([bad, 0.0], 1, 2), {}))
    assert store.job(job.id).progress.iterations == 0
