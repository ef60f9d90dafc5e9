"""Tunings that judge every design in many worlds."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import conditional_value_at_risk
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import Aggregation, TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, log_utilities
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from gaitswarm.sim.worlds.perturbations import DRAWN, sample_worlds
from gaitswarm.sim.worlds.walks import WorldWalk
from tests.examples.jobs import history
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

RANGES = ["friction_factor", {"name": "efficiency_factor", "low": 0.5, "high": 1.0}]


def robust(**worlds: Any) -> JobSpec:
    """A small tuning of two gains in three worlds of two scenarios."""
    spec = SPECS.validate_python(
        {
            "controller": "pi",
            "scenarios": [SHORT_WALK, UPHILL_WALK],
            "optimizer": {"name": "pso", "particles": 4},
            "iterations": 2,
            "seed": 3,
            "worlds": {"count": 3, "seed": 5, "ranges": RANGES, **worlds},
        }
    )
    assert isinstance(spec, JobSpec)
    return spec


@pytest.fixture(scope="module")
def evaluator() -> Iterator[Evaluator]:
    opened = open_evaluator("in-process", cpus=2)
    yield opened
    opened.close()


@pytest.mark.parametrize(
    ("aggregate", "level", "expected"),
    [
        ("mean", 0.0, 5.5),
        ("worst", 0.0, 10.0),
        ("quantile", 0.75, 8.0),
        ("quantile", 0.9, 9.0),
        ("quantile", 0.0, 1.0),
        ("cvar", 0.8, 9.5),
        ("cvar", 0.75, (10.0 + 9.0 + 0.5 * 8.0) / 2.5),
        ("cvar", 0.99, 10.0),
    ],
)
def test_utilities_of_all_worlds_become_one(aggregate: Any, level: float, expected: float) -> None:
    worlds = TuningWorlds(count=10, aggregate=aggregate, level=level)
    utilities = np.array([[3.0, 9.0, 1.0, 7.0, 5.0, 10.0, 2.0, 8.0, 4.0, 6.0]])
    (found,) = np.exp(worlds.aggregated(np.log(utilities)))
    assert found == pytest.approx([expected])
    judged = Aggregation(worlds).judged(
        np.log(np.concatenate([utilities, 4.0 * utilities], axis=1))
    )
    assert judged.fitness == pytest.approx([2.0 * expected])
    if aggregate == "cvar" and level < 0.9:
        assert expected == pytest.approx(conditional_value_at_risk(utilities[0], level))


def test_a_failed_walk_is_infinitely_bad_unless_a_quantile_leaves_it_out() -> None:
    logarithms = np.array([[0.0, math.inf, 1.0, 2.0]])
    for aggregate in ("mean", "worst", "cvar"):
        worlds = TuningWorlds.model_validate({"count": 4, "aggregate": aggregate})
        assert Aggregation(worlds).judged(logarithms).fitness.tolist() == [math.inf]
    quantile = TuningWorlds(count=4, aggregate="quantile", level=0.75)
    assert Aggregation(quantile).judged(logarithms).fitness == pytest.approx([math.exp(2.0)])


def test_every_design_walks_in_the_same_worlds_of_every_scenario(
    store: Store, evaluator: Evaluator
) -> None:
    spec = robust()
    job, _ = JobService(store).submit(spec)
    assert run_embedded(store, evaluator, job.id).state is JobState.SUCCEEDED
    stored = store.job(job.id).spec
    assert isinstance(stored, JobSpec) and stored.worlds is not None
    assert len(stored.case_names) == 6 and stored.case_names[4] == "uphill.world-1"
    variables = stored.worlds.variables()
    drawn = sample_worlds(3, 5, variables)
    names = tuple(variable.name for variable in variables)
    for evaluation in store.evaluations_between(job.id, 0, 2):
        design = tuple(zip(("P", "I"), evaluation.design.tolist(), strict=True))
        walked = [
            WorldWalk(stored.robot, "pi", design, scenario, names).run(drawn)
            for scenario in stored.resolved_scenarios()
        ]
        expected = np.concatenate([outcome.objectives for outcome in walked])
        assert evaluation.objectives[:, :6].tobytes() == expected.tobytes()
        logs = log_utilities(expected, np.zeros(6, dtype=bool), PREFERENCES["A"])
        assert evaluation.fitness == Aggregation(stored.worlds).judged(logs[np.newaxis]).fitness[0]


def test_it_is_ranked_by_another_preference_over_its_worlds(
    store: Store, evaluator: Evaluator
) -> None:
    service = JobService(store)
    ids = [service.submit(robust().model_copy(update={"preference": p}))[0].id for p in "AB"]
    for job_id in ids:
        run_embedded(store, evaluator, job_id)
    ranked = DatabaseJobs(service, "").ranking(ids[0], "B", top=8)
    first = min(ranked.top, key=lambda design: (design.iteration, design.particle))
    by_b = store.evaluations_between(ids[1], 0, 1)
    assert (first.iteration, first.particle) == (0, 0)
    # The first iteration of both jobs is the same swarm.
    assert first.fitness == pytest.approx(next(iter(by_b)).fitness, rel=1e-12)


def test_one_nominal_world_is_the_model(store: Store, evaluator: Evaluator) -> None:
    narrow = [{"name": "slope_added", "low": 0.0, "high": 1e-300}]
    plain = robust().model_copy(update={"worlds": None})
    in_world = robust(count=1, ranges=narrow)
    bits = []
    for spec in (plain, in_world):
        job, _ = JobService(store).submit(spec)
        run_embedded(store, evaluator, job.id)
        bits.append([row[:5] for row in history(store, job.id)])
    assert bits[0] == bits[1]


def test_an_integer_perturbation_stays_one_within_custom_bounds() -> None:
    spec = robust(count=100, ranges=[{"name": "angle_delay", "low": 1, "high": 2}]).resolved()
    assert spec.worlds is not None
    drawn = [dict(world)["angle_delay"] for world in spec.worlds.drawn()]
    assert set(drawn) == {1.0, 2.0}
    assert SPECS.validate_json(spec.model_dump_json()) == spec


def test_worlds_are_all_perturbations_by_default_and_stored_with_their_bounds() -> None:
    spec = robust(ranges=None).resolved()
    assert spec.worlds is not None and spec.worlds.ranges == DRAWN
    assert SPECS.validate_json(spec.model_dump_json()) == spec
    assert JobSpec().worlds is None


@pytest.mark.parametrize(
    ("worlds", "words"),
    [
        ({"ranges": ["gravity"]}, "ranges: unknown perturbation 'gravity'; known are"),
        ({"ranges": ["friction_factor", "friction_factor"]}, "'friction_factor' is named twice"),
        (
            {"ranges": [{"name": "angle_delay", "low": 0.5, "high": 1.5}]},
            "bounds of the integer variable angle_delay must be integers",
        ),
        (
            {"ranges": [{"name": "friction_factor", "kind": "integer", "low": 1, "high": 2}]},
            "friction_factor is continuous, not integer",
        ),
        ({"aggregate": "median"}, "Input should be 'mean', 'quantile', 'worst' or 'cvar'"),
        ({"level": 1.0}, "less than 1"),
        ({"count": 0}, "greater than or equal to 1"),
    ],
)
def test_invalid_values_are_refused(worlds: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError) as raised:
        robust(**worlds)
    assert words in str(raised.value)


def test_a_range_that_cannot_be_simulated_names_its_field() -> None:
    with pytest.raises(InvalidRequest) as raised:
        robust(
            ranges=[{"name": "friction_factor", "low": -1.0, "high": 1.0}]
        ).check_can_be_simulated()
    assert raised.value.field == "worlds.ranges"
