"""What every optimizer keeps to, whatever its method. A new one is added to `JOBS`."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from services.optimizer.jobs.spec import create_optimizer
from services.optimizer.jobs.tuning import JobSpec
from services.optimizer.search.optimizer import Optimizer

JOBS = {
    "pso, reflecting": {"name": "pso", "particles": 6, "bounds": "reflect"},
    "pso, absorbing": {"name": "pso", "particles": 6, "bounds": "absorb", "velocity_limit": 1.0},
}


@pytest.fixture(params=JOBS)
def spec(request: pytest.FixtureRequest) -> JobSpec:
    return job(JOBS[request.param])


def job(optimizer: dict[str, object], **others: object) -> JobSpec:
    given = {"optimizer": optimizer, "iterations": 8, "seed": 3} | others
    return JobSpec.model_validate(given)


def fitness_of(positions: NDArray[np.float64], iteration: int) -> NDArray[np.float64]:
    """Anything that depends on all coordinates, with a failure now and then."""
    fitness = np.log1p(np.abs(positions)).sum(axis=1)
    fitness[iteration % len(fitness)] = math.inf
    return fitness


def through_json(optimizer: Optimizer, spec: JobSpec) -> Optimizer:
    loaded = create_optimizer(spec)
    loaded.load(json.loads(json.dumps(optimizer.dump(), allow_nan=False)))
    return loaded


def history(spec: JobSpec, *, reload: bool) -> list[bytes]:
    optimizer = create_optimizer(spec)
    asked = []
    for iteration in range(spec.iterations):
        optimizer = through_json(optimizer, spec) if reload else optimizer
        positions = optimizer.ask()
        asked.append(positions.tobytes())
        optimizer = through_json(optimizer, spec) if reload else optimizer
        optimizer.tell(fitness_of(positions, iteration))
    return asked


def test_a_dump_loaded_between_any_ask_and_tell_changes_no_bit(spec: JobSpec) -> None:
    assert history(spec, reload=True) == history(spec, reload=False)


def test_another_seed_searches_elsewhere(spec: JobSpec) -> None:
    other = spec.model_copy(update={"seed": spec.seed + 1})
    assert history(spec, reload=False)[0] != history(other, reload=False)[0]


def test_asking_twice_gives_the_same_positions(spec: JobSpec) -> None:
    optimizer = create_optimizer(spec)
    first = optimizer.ask()
    again = optimizer.ask()
    assert first.tobytes() == again.tobytes()
    assert optimizer.iteration == 0


def test_what_the_caller_does_to_an_ask_is_its_own_affair(spec: JobSpec) -> None:
    optimizer = create_optimizer(spec)
    expected = optimizer.ask()
    optimizer.ask()[:] = math.nan
    np.testing.assert_array_equal(optimizer.ask(), expected)


def test_iteration_counts_the_tells(spec: JobSpec) -> None:
    optimizer = create_optimizer(spec)
    for k in range(3):
        assert optimizer.iteration == k
        optimizer.tell(fitness_of(optimizer.ask(), k))
    assert optimizer.iteration == 3


def test_every_position_is_inside_the_bounds(spec: JobSpec) -> None:
    space = spec.design_space()
    optimizer = create_optimizer(spec)
    for k in range(200):
        positions = optimizer.ask()
        assert positions.shape == (6, len(space.variables))
        assert (positions >= space.low).all() and (positions <= space.high).all()
        optimizer.tell(fitness_of(positions, k))


def test_a_swarm_that_only_fails_keeps_searching(spec: JobSpec) -> None:
    optimizer = create_optimizer(spec)
    seen = set()
    for _ in range(4):
        positions = optimizer.ask()
        assert np.isfinite(positions).all()
        seen.add(positions.tobytes())
        optimizer.tell(np.full(6, math.inf))
    assert len(seen) == 4


@pytest.mark.parametrize(
    "fitness",
    [np.zeros(5), np.zeros((6, 1)), np.full(6, math.nan), np.full(6, -math.inf)],
    ids=["too few", "two axes", "nan", "-inf"],
)
def test_a_fitness_that_is_none_is_refused(spec: JobSpec, fitness: NDArray[np.float64]) -> None:
    optimizer = create_optimizer(spec)
    optimizer.ask()
    with pytest.raises(ValueError, match="fitness"):
        optimizer.tell(fitness)
    assert optimizer.iteration == 0


def test_a_tell_needs_an_ask(spec: JobSpec) -> None:
    with pytest.raises(ValueError, match="before ask"):
        create_optimizer(spec).tell(np.zeros(6))


def test_a_damaged_state_is_refused_and_named(spec: JobSpec) -> None:
    sound = create_optimizer(spec)
    sound.ask()
    for field, value in (
        ("schema_version", 999),
        ("iteration", -1),
        ("asked", None),
        ("positions", [[1.0]]),
        ("optimizer", "another"),
    ):
        with pytest.raises(ValueError, match=field):
            create_optimizer(spec).load(sound.dump() | {field: value})
    incomplete = sound.dump()
    del incomplete["iteration"]
    with pytest.raises(ValueError, match="iteration"):
        create_optimizer(spec).load(incomplete)


def test_a_refused_state_leaves_the_state_before(spec: JobSpec) -> None:
    optimizer = create_optimizer(spec)
    optimizer.tell(fitness_of(optimizer.ask(), 0))
    before = optimizer.dump()
    optimizer.ask()
    later = optimizer.dump()
    optimizer.load(before)
    outside = [[1e9] * len(row) for row in later["best_positions"]]
    with pytest.raises(ValueError, match="best_positions: outside"):
        optimizer.load(later | {"best_positions": outside})
    assert optimizer.dump() == before


def test_a_state_of_another_swarm_size_is_refused(spec: JobSpec) -> None:
    larger = spec.model_copy(
        update={"optimizer": spec.optimizer.model_copy(update={"particles": 7})}
    )
    optimizer = create_optimizer(larger)
    optimizer.ask()
    with pytest.raises(ValueError, match="positions: expected 6 rows"):
        create_optimizer(spec).load(optimizer.dump())


@given(
    seed=st.integers(0, 2**63 - 1),
    particles=st.integers(1, 9),
    fitness=st.lists(st.one_of(st.floats(0.0, 1e300), st.just(math.inf)), min_size=9, max_size=9),
    bounds=st.sampled_from(["reflect", "absorb"]),
    limit=st.floats(0.01, 1.0),
    social=st.floats(0.0, 10.0),
)
@settings(max_examples=60, deadline=None)
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
    space = spec.design_space()
    straight, reloaded = create_optimizer(spec), create_optimizer(spec)
    for k in range(5):
        positions = straight.ask()
        assert (positions >= space.low).all() and (positions <= space.high).all()
        reloaded = through_json(reloaded, spec)
        assert reloaded.ask().tobytes() == positions.tobytes()
        told = np.roll(np.array(fitness), k)[:particles]
        straight.tell(told)
        reloaded.tell(told)


def test_inertia_that_rises_is_refused() -> None:
    with pytest.raises(ValidationError, match="inertia_end must not exceed inertia_start"):
        job({"inertia_start": 0.4, "inertia_end": 0.5})
