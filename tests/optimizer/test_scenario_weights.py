"""Tuning jobs whose scenarios are weighed, or judged by the worst of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.analysis.utilities import fitness_by, objective_vectors
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.sim.outcome import N_OBJECTIVES
from tests.examples.columns import columns_of

SLOW, FAST = "normal-slow", "normal-fast"
NONE_FAILED = np.zeros((8, 2), dtype=bool)
OBJECTIVES = np.random.default_rng(3).uniform(0.5, 5.0, (8, 2, N_OBJECTIVES))


def spec(**fields: Any) -> JobSpec:
    return JobSpec(scenarios=(SLOW, FAST), preference="C", **fields)


def utilities(judged: JobSpec) -> np.ndarray[Any, Any]:
    return judged.judge(OBJECTIVES, NONE_FAILED).utilities


def fitness(judged: JobSpec) -> np.ndarray[Any, Any]:
    return judged.judge(OBJECTIVES, NONE_FAILED).fitness


def test_a_weight_counts_its_scenario_as_often_in_the_geometric_mean() -> None:
    slow, fast = utilities(spec()).T
    assert fitness(spec(scenario_weights={FAST: 3.0})) == pytest.approx((slow * fast**3) ** 0.25)


def test_equal_weights_change_no_bit() -> None:
    assert (
        fitness(spec(scenario_weights={SLOW: 2.0, FAST: 2.0})).tolist() == fitness(spec()).tolist()
    )


def test_the_worst_scenario_alone_can_count() -> None:
    worst = spec(scenario_aggregate="worst")
    assert fitness(worst) == pytest.approx(utilities(spec()).max(axis=1))
    failed = NONE_FAILED.copy()
    failed[2, 0] = True
    assert worst.judge(OBJECTIVES, failed).fitness[2] == math.inf


def test_weights_hold_after_the_aggregation_over_worlds() -> None:
    worlds = {"count": 2, "aggregate": "worst"}
    objectives = np.repeat(OBJECTIVES, 2, axis=1) * [[[1.0], [0.9], [0.8], [1.0]]]
    judged = spec(worlds=worlds, scenario_weights={FAST: 3.0}).judge(
        objectives, np.zeros((8, 4), dtype=bool)
    )
    assert judged.fitness == pytest.approx(fitness(spec(scenario_weights={FAST: 3.0})))


@pytest.mark.parametrize(
    "fields", [{"scenario_weights": {SLOW: 0.5}}, {"scenario_aggregate": "worst"}]
)
def test_stored_histories_are_judged_alike(fields: dict[str, Any]) -> None:
    job = spec(**fields)
    columns = columns_of(OBJECTIVES[:, :, :5], own=PREFERENCES["C"], aggregation=job.aggregation)
    assert columns.fitness == pytest.approx(fitness(job), rel=1e-12)
    feedback = objective_vectors(columns, aggregation=job.aggregation)
    alone = job.model_copy(update={"optimizer": spec(optimizer={"name": "hype"}).optimizer})
    assert alone.search_feedback(OBJECTIVES, NONE_FAILED, fitness(job)) == pytest.approx(feedback)
    # Of a mean, the fitness is the product of the objectives; of the worst scenario, it is less.
    product = feedback.prod(axis=1) * (1.0 + 1e-9)
    assert (fitness_by(columns, PREFERENCES["C"], aggregation=job.aggregation) <= product).all()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"scenario_weights": {"nomal-fast": 2.0}}, "'normal-fast'"),
        ({"scenario_weights": {FAST: 0.0}}, "greater than 0"),
        ({"scenario_weights": {FAST: 2.0}, "scenario_aggregate": "worst"}, "omit them"),
    ],
)
def test_unusable_weights_are_refused_by_name(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match="scenario_weights") as refused:
        spec(**fields)
    assert message in str(refused.value)
