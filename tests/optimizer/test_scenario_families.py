"""Winners of fewer scenarios."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.scenario_families import (
    ScenarioFamiliesView,
    families_of,
    scenario_families,
)
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from tests.optimizer.columns import fitness_only

NAMES = tuple("0123456789")


def utilities(*rows: tuple[float, ...]) -> np.ndarray:
    """(r, K) logarithms."""
    return np.log(np.array(rows))


def families(judged: np.ndarray, tolerance: float) -> ScenarioFamiliesView:
    """Scenarios are named by number, and designs by their row, as iteration."""
    return scenario_families(numbered(len(judged)), judged, NAMES, tolerance=tolerance)


def numbered(rows: int) -> EvaluationColumns:
    return fitness_only(*((1.0,) for _ in range(rows)))


def test_without_a_scenario_its_specialist_no_longer_loses() -> None:
    # The second design is best in the first two scenarios, and poor in the third.
    found = families(utilities((2, 2, 2), (1, 1, 16), (3, 3, 3)), 0.01)
    assert [left.scenario for left in found.left_out] == ["0", "1", "2"]
    last = found.left_out[2]
    assert last.family.iteration == 1
    assert last.family.regret.value == pytest.approx(16 ** (1 / 3) / 2 - 1)
    assert last.loss.value == pytest.approx(16 / 2 - 1)
    assert found.left_out[0].family.iteration == 0
    assert found.left_out[0].loss.value == 0.0


def test_a_repeated_scenario_is_most_like_itself_and_the_other_cannot_be_judged_by_it() -> None:
    first, second = np.random.default_rng(1).normal(size=(2, 300))
    found = families(np.stack([first, first, second], axis=1), 0.0)
    assert (found.left_out[0].similar, found.left_out[1].similar) == ("1", "0")
    assert found.left_out[0].similarity == pytest.approx(1.0)
    assert found.left_out[0].family.correlation != pytest.approx(1.0)
    assert found.sizes[0].worst is not None and found.sizes[0].worst > 0.0


def test_scenarios_that_agree_need_only_one() -> None:
    worth = np.linspace(1.0, 2.0, 50)
    found = families(np.log(np.stack([worth, worth**2, worth**3], axis=1)), 0.0)
    assert found.smallest is not None
    assert len(found.smallest.scenarios) == 1
    assert found.smallest.regret.high == 0.0
    assert found.smallest.correlation == pytest.approx(1.0)


def test_scenarios_that_disagree_are_all_needed() -> None:
    angle = np.linspace(0.0, math.pi / 2.0, 200)
    found = families(np.stack([-3.0 * np.cos(angle), -3.0 * np.sin(angle)], axis=1), 0.01)
    assert found.smallest is None
    assert found.sizes[0].median is not None and found.sizes[0].median > 0.1


def test_a_winner_that_fails_in_what_was_left_out_has_an_infinite_regret() -> None:
    found = families(utilities((2, 2), (1, math.inf), (3, 3)), 0.01)
    assert (found.designs, found.failed) == (2, 1)
    left = found.left_out[1]
    assert left.family.iteration == 1
    assert left.family.regret.value is None
    assert left.loss.value is None
    assert found.left_out[0].family.regret.value == 0.0


def test_the_interval_widens_where_the_answer_hangs_on_one_design() -> None:
    rows = [(2.0, 2.0)] * 40 + [(1.0, 9.0)]
    found = families(utilities(*rows), 0.01)
    regret = found.left_out[1].family.regret
    assert regret.low == 0.0
    assert regret.value == pytest.approx(0.5)
    assert regret.high == regret.value


@pytest.mark.thorough("long histories")
def test_a_long_history_is_judged_in_the_memory_of_its_own() -> None:
    judged = np.random.default_rng(3).normal(size=(60_000, 6))
    columns = numbered(len(judged))
    tracemalloc.start()
    found = scenario_families(columns, judged, NAMES, tolerance=0.1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.designs == 60_000
    # Rows of all resamples would be eleven times as much, and again to draw and to sort them.
    assert peak < 6 * judged.nbytes


def test_the_job_itself_has_no_regret_and_a_single_scenario_no_family() -> None:
    found = families(utilities((2,), (1,)), 0.01)
    assert (found.left_out, found.sizes, found.smallest) == ([], [], None)


def test_of_many_scenarios_some_families_of_each_size_are_drawn_alike_each_time() -> None:
    generator = np.random.default_rng(2)
    judged = generator.normal(size=(40, 10))
    found, again = (families(judged, 0.1) for _ in range(2))
    assert {size.size: size.families for size in found.sizes} == {
        1: 10, 2: 45, 3: 64, 4: 64, 5: 64, 6: 64, 7: 64, 8: 45, 9: 10,
    }  # fmt: skip
    assert found == again
    drawn = list(families_of(10))
    assert len(set(drawn)) == len(drawn)
