"""Random designs in single and double precision, compared."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from gaitswarm import (
    MEASUREMENTS,
    PREFERENCES,
    SCENARIOS,
    InvalidRequest,
    RobotVariant,
    SimulationResult,
    Status,
)
from gaitswarm_research.studies.precision import (
    LAWS,
    Variant,
    agreement_of,
    compare,
    study_tables,
    variants,
)
from research.tests.conftest import Command

DEFAULT_ROBOT = RobotVariant().name
SCENARIO = SCENARIOS[0].model_copy(update={"cycles": 1.0})


def result(
    precision: Literal["single", "double"],
    fitness: list[float],
    *,
    f1: list[float],
    fallen: int | None = None,
) -> SimulationResult:
    n = len(fitness)
    objectives = np.ones((n, 1, 6))
    objectives[:, 0, 0] = f1
    statuses = np.full((n, 1), Status.OK, dtype=np.uint8)
    if fallen is not None:
        statuses[fallen], objectives[fallen], fitness[fallen] = Status.FELL, np.nan, np.nan
    return SimulationResult(
        robot=DEFAULT_ROBOT,
        controller="pi",
        preference=PREFERENCES["A"],
        precision=precision,
        variables=("P",),
        designs=np.zeros((n, 1)),
        scenarios=("one",),
        statuses=statuses,
        objectives=objectives,
        measurements=np.zeros((n, 1, len(MEASUREMENTS))),
        utilities=np.array(fitness)[:, None],
        fitness=np.array(fitness),
    )


def test_deviations_are_relative_to_double_and_the_ranking_is_compared() -> None:
    double = result("double", [4.0, 2.0, 8.0, 5.0], f1=[1.0, 2.0, 4.0, 1.0])
    single = result("single", [2.2, 2.4, 8.0, 5.0], f1=[1.1, 2.0, 4.04, 1.0], fallen=3)
    heavier = result("double", [4.0, 2.02, 8.0, 5.0], f1=[1.0, 2.0, 4.0, 1.0])
    found = agreement_of("pair", double, single, heavier)
    assert (found.designs, found.walked, found.statuses) == (4, 3, 1)
    assert found.median.objectives["torque"] == pytest.approx(0.01)
    assert found.largest.objectives["torque"] == pytest.approx(0.1)
    assert 0.09 < found.most.objectives["torque"] < 0.1
    assert found.largest.objectives["energy"] == 0.0
    assert (found.median.fitness, found.largest.fitness) == pytest.approx((0.2, 0.45))
    assert (found.median.sensitivity, found.largest.sensitivity) == pytest.approx((0.0, 0.01))
    assert found.correlation == pytest.approx(0.5)
    # In single the first design is the best; in double it is twice as bad as the second.
    assert found.loss == pytest.approx(1.0)


def test_only_designs_that_walk_are_among_the_ten_best() -> None:
    few = result("double", [1.0, 2.0, 3.0], f1=[1.0, 1.0, 1.0], fallen=2)
    assert agreement_of("few", few, few, few).same_of_ten == 2


def test_every_law_is_compared_plain_with_backlash_and_over_a_minute() -> None:
    planned = variants(DEFAULT_ROBOT, designs=5, with_backlash=3, long=2)
    assert [v.designs for v in planned] == [*len(LAWS) * [5], *len(LAWS) * [3], *len(LAWS) * [2]]
    assert [v.robot.contact_law for v in planned] == 3 * list(LAWS)
    assert [bool(any(v.robot.backlash)) for v in planned] == 4 * [False] + 4 * [True] + 4 * [False]
    assert all(60.0 <= s.duration < 63.0 for v in planned[8:] for s in v.scenarios)
    assert len(variants(DEFAULT_ROBOT, designs=5, with_backlash=0, long=0)) == len(LAWS)


@pytest.mark.slow
def test_single_and_double_precision_nearly_agree_on_random_designs() -> None:
    found = compare(Variant("brief", RobotVariant(), (SCENARIO,), 12), seed=1, cpus=1)
    assert 0.0 < found.median.fitness < 1e-3 and 0.0 < found.median.sensitivity < 1e-3
    assert found.correlation is not None and found.correlation > 0.95
    assert found.largest.objectives["torque"] > 0.0
    assert [table.row_count for table in study_tables([found])] == [3, 1]


def test_a_robot_that_does_not_ship_is_refused(research: Command) -> None:
    refused = research("study", "precision", "--robot", "spider")
    assert refused.code == 2
    assert "name: Input should be 'szabadka2'" in refused.err


def test_without_a_design_that_walks_nothing_is_compared() -> None:
    fallen = result("double", [1.0], f1=[1.0], fallen=0)
    with pytest.raises(InvalidRequest, match="designs: none of 1 random designs walks to the end"):
        agreement_of("pair", fallen, fallen, fallen)
