"""The particle swarm's state: of every version, of any settings, and what is wrong with it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.optimizer import Optimizer


def job(optimizer: dict[str, object], seed: int = 3) -> JobSpec:
    document = {"optimizer": {"name": "pso", **optimizer}, "iterations": 8, "seed": seed}
    return JobSpec.model_validate(document)


SPEC = job({"particles": 6})


def asked(iterations: int, spec: JobSpec = SPEC) -> Optimizer:
    optimizer = spec.create_search()
    for _ in range(iterations):
        optimizer.tell(np.log1p(np.abs(optimizer.ask())).sum(axis=1))
    optimizer.ask()
    return optimizer


def test_a_refused_state_leaves_the_state_before() -> None:
    optimizer = asked(1)
    before, later = optimizer.dump(), asked(2).dump()
    for field in ("best_positions", "positions"):
        outside = [[1e9] * len(row) for row in later[field]]
        with pytest.raises(ValueError, match=f"{field}: outside"):
            optimizer.load(later | {field: outside})
    assert optimizer.dump() == before


def test_a_state_of_another_swarm_size_is_refused() -> None:
    larger = asked(0, job({"particles": 7}))
    with pytest.raises(ValueError, match="positions: expected 6 rows"):
        SPEC.create_search().load(larger.dump())


@given(
    seed=st.integers(0, 2**63 - 1),
    particles=st.integers(1, 9),
    fitness=st.lists(st.one_of(st.floats(0.0, 1e300), st.just(math.inf)), min_size=9, max_size=9),
    bounds=st.sampled_from(["reflect", "absorb"]),
    limit=st.floats(0.01, 1.0),
    social=st.floats(0.0, 10.0),
)
def test_no_settings_and_no_fitness_lead_out_of_the_box_or_off_the_bits(
    seed: int, particles: int, fitness: list[float], bounds: str, limit: float, social: float
) -> None:
    spec = job(
        {
            "particles": particles,
            "bounds": bounds,
            "velocity_limit": limit,
            "social": social,
            "inertia_start": 2.0,
            "inertia_end": 1.5,
        },
        seed=seed,
    )
    box = spec.design_space().box
    straight, reloaded = spec.create_search(), spec.create_search()
    for k in range(5):
        positions = straight.ask()
        assert (positions >= box.low).all() and (positions <= box.high).all()
        state = json.loads(json.dumps(reloaded.dump(), allow_nan=False))
        reloaded = spec.create_search()
        reloaded.load(state)
        assert reloaded.ask().tobytes() == positions.tobytes()
        feedback = np.roll(np.array(fitness), k)[:particles]
        straight.tell(feedback)
        reloaded.tell(feedback)


def test_inertia_that_rises_is_refused() -> None:
    with pytest.raises(ValidationError, match="inertia_end must not exceed inertia_start"):
        job({"inertia_start": 0.4, "inertia_end": 0.5})
