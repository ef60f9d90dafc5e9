"""Pareto fronts of a job's designs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.front import (
    FrontView,
    FrontWinnerView,
    TradeOffDesignView,
    front_knees,
    pareto_front,
)
from gaitswarm.services.optimizer.analysis.utilities import fitness_by, objective_vectors
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import Aggregation, TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.jobs.preference import objective_vectors as stored_vectors
from tests.examples.columns import columns_of


def front_of(
    columns: EvaluationColumns, worlds: TuningWorlds | None = None, most: int = 1000
) -> FrontView:
    """Iterations of its designs are their rows, where each has one particle."""
    vectors = objective_vectors(columns, aggregation=Aggregation(worlds))
    return pareto_front(columns, vectors, JobSpec(worlds=worlds), most=most)


def rows_of(designs: Sequence[TradeOffDesignView]) -> list[int]:
    return [design.iteration for design in designs]


def values(named: dict[str, float]) -> list[float]:
    return list(named.values())


def winners_of(front: FrontView) -> dict[str, FrontWinnerView]:
    return {str(winner.preference): winner for winner in front.winners}


def walks(rows: int, scenarios: int, seed: int = 1) -> np.ndarray:
    """(rows, scenarios, 5) objectives."""
    return np.exp(np.random.default_rng(seed).normal(size=(rows, scenarios, 5)))


def trade_off(*pairs: tuple[float, float]) -> np.ndarray:
    """(r, 5) objectives whose logarithms are these in the first two, and 0 in all others."""
    return np.exp([[first, second, 0.0, 0.0, 0.0] for first, second in pairs])


def test_vectors_are_those_that_jobs_compute_one_by_one() -> None:
    columns = columns_of(walks(40, 3), failed=(5,))
    columns.objectives[7, 1, 2] = np.nan
    for bias in ((0.0,) * 5, (0.9, 0.8, 0.24, 0.5, 0.8), (0.1,) * 6):
        own = stored_vectors(columns.objectives, columns.failed, bias)
        np.testing.assert_allclose(objective_vectors(columns, bias), own, rtol=1e-12)


def test_designs_that_are_dominated_equal_to_earlier_ones_or_failed_are_not_on_it() -> None:
    objectives = trade_off((0, 4), (4, 0), (5, 1), (1, 1), (0, 4), (0, 0))
    front = front_of(columns_of(objectives, failed=(5,)))
    assert rows_of(front.designs) == [0, 1, 3]
    assert (front.size, front.designs_judged, front.failed) == (3, 5, 1)
    np.testing.assert_allclose(values(front.ideal), np.exp([0, 0, 0, 0, 0]))
    np.testing.assert_allclose(values(front.nadir), np.exp([4, 4, 0, 0, 0]))
    np.testing.assert_allclose(values(front.reference)[:2], np.exp([4.4, 4.4]))


def test_objectives_are_normalised_by_logarithms_between_ideal_and_nadir() -> None:
    front = front_of(columns_of(trade_off((0, 4), (1, 2), (4, 0))))
    normalised = np.array([values(design.normalised) for design in front.designs])
    np.testing.assert_allclose(normalised[:, :2], [[0.0, 1.0], [0.25, 0.5], [1.0, 0.0]], atol=1e-12)
    assert (normalised[:, 2:] == 0.0).all()


def test_the_extremes_are_the_best_in_each_objective() -> None:
    columns = columns_of(walks(200, 2))
    best = objective_vectors(columns).argmin(axis=0)
    assert rows_of(front_of(columns).extremes) == best.tolist()


def test_of_designs_that_are_best_in_an_objective_the_one_nearest_to_the_ideal_is_named() -> None:
    # All are the best in the last three objectives.
    front = front_of(columns_of(trade_off((0, 4), (1, 1), (4, 0))))
    assert rows_of(front.extremes) == [0, 2, 1, 1, 1]


def test_a_knee_is_where_the_front_bends() -> None:
    # Two straight branches that meet at (1, 1).
    left = [(x, 10.0 - 9.0 * x) for x in np.linspace(0.0, 1.0, 21)]
    right = [(x, 1.0 - (x - 1.0) / 9.0) for x in np.linspace(1.0, 10.0, 21)[1:]]
    (knee,) = front_of(columns_of(trade_off(*left, *right))).knees
    np.testing.assert_allclose(np.log(values(knee.objectives)[:2]), [1.0, 1.0])


def normalised_front(pairs: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    points = np.array(pairs)
    return points, np.arange(len(points)), points.argmin(axis=0)


def test_a_front_that_bends_twice_has_two_knees_the_sharper_one_first() -> None:
    corners = [(0.0, 1.0), (0.05, 0.5), (0.4, 0.4), (0.45, 0.05), (1.0, 0.0)]
    points = [
        tuple(np.array(a) + share * (np.array(b) - np.array(a)))
        for a, b in pairwise(corners)
        for share in np.linspace(0.0, 1.0, 10, endpoint=False)
    ]
    points.append(corners[-1])
    (first, distance), (second, _) = front_knees(*normalised_front(points))
    assert [points[first], points[second]] == [corners[3], corners[1]]
    # The plane is x + y = 1.
    assert distance == pytest.approx((1.0 - 0.5) / math.sqrt(2.0))


def test_neighbors_of_a_knee_are_none_and_neither_is_a_front_that_bulges() -> None:
    straight = [(x, 1.0 - x) for x in np.linspace(0.0, 1.0, 11)]
    assert front_knees(*normalised_front([*straight, (0.4, 0.4), (0.45, 0.36)]))[0][0] == 11
    bulging = [(math.sin(a), math.cos(a)) for a in np.linspace(0.0, math.pi / 2.0, 30)]
    assert front_knees(*normalised_front(bulging)) == []


def test_c_without_biases_always_wins_on_the_front_and_the_others_are_placed() -> None:
    columns = columns_of(walks(300, 4, seed=3), own=PREFERENCES["B"])
    front = front_of(columns)
    winners = winners_of(front)
    assert list(winners) == ["A", "B", "C", "job"]
    for name in ("A", "B", "C"):
        assert winners[name].iteration == fitness_by(columns, PREFERENCES[name]).argmin()
    assert winners["job"] == winners["B"].model_copy(update={"preference": "job"})
    assert winners["C"].on_front
    assert winners["C"].iteration in rows_of(front.designs)


def test_a_winner_may_be_dominated_and_then_its_distance_is_given() -> None:
    # In one scenario biases hide what the first design is better in; the mean without biases is not
    # so blind.
    objectives = np.ones((2, 2, 5))
    objectives[0, :, 3] = 1e-6, 1.0
    objectives[1, :, 3] = 0.3, 0.3
    columns = columns_of(objectives, own=PREFERENCES["A"])
    front = front_of(columns)
    assert rows_of(front.designs) == [0]
    winner = winners_of(front)["A"]
    assert (winner.iteration, winner.on_front, winner.dominated_by) == (1, False, 1)
    # The other objectives are equal.
    assert winner.behind == 0.0
    objectives[0, :, [0, 1, 2, 4]] = 0.98
    winner = winners_of(front_of(columns_of(objectives, own=PREFERENCES["A"])))["A"]
    assert winner.iteration == 1
    assert winner.behind == pytest.approx(0.02)


def test_hypervolume_grows_iteration_by_iteration_in_the_box_of_the_whole() -> None:
    pairs = [(3, 3), (3.5, 3.5), (2, 2), (2.5, 3), (0, 4), (4, 0)]
    front = front_of(columns_of(trade_off(*pairs), particles=2))
    assert [iteration.index for iteration in front.iterations] == [0, 1, 2]
    side, last = 4.4, 4.4 - 4.0
    # Objectives without a range are at the ideal, and the box reaches a tenth beyond.
    squares = [(side - 3.0) ** 2, (side - 2.0) ** 2, (side - 2.0) ** 2 + 2.0 * 2.0 * last]
    volumes = [iteration.hypervolume for iteration in front.iterations]
    np.testing.assert_allclose(volumes, np.array(squares) / side**2, atol=0.008)
    assert front.hypervolume == volumes[-1]
    assert 0.0 < front.hypervolume_error < 0.002


def test_in_worlds_an_objective_is_what_the_job_makes_of_it_in_all_of_them() -> None:
    worlds = TuningWorlds(count=2, aggregate="worst")
    objectives = walks(50, 4)
    columns = columns_of(objectives, aggregation=Aggregation(worlds))
    by_scenario = np.exp(np.log(objectives.reshape(50, 2, 2, 5).max(axis=2)).mean(axis=1))
    front = front_of(columns, worlds)
    for design in front.designs:
        np.testing.assert_allclose(values(design.objectives), by_scenario[design.iteration])
    winners = winners_of(front)
    assert winners["job"] == winners["A"].model_copy(update={"preference": "job"})


def test_a_front_of_many_is_covered_by_some_of_its_designs_with_all_named_ones() -> None:
    directions = np.abs(np.random.default_rng(4).normal(size=(150, 5)))
    columns = columns_of(np.exp(-directions / np.linalg.norm(directions, axis=1)[:, None]))
    front, some = front_of(columns), front_of(columns, most=40)
    assert front.size == some.size == len(front.designs) == 150
    assert len(some.designs) == 40
    rows = set(rows_of(some.designs))
    assert set(rows_of(front.extremes)) <= rows
    assert {winner.iteration for winner in front.winners if winner.on_front} <= rows
    points = np.array([values(design.normalised) for design in front.designs])

    def gap(chosen: list[int]) -> float:
        apart = np.linalg.norm(points[:, None] - points[chosen][None], axis=2)
        return float(apart.min(axis=1).max())

    assert gap(rows_of(some.designs)) < gap(list(range(40)))


def test_an_objective_of_nothing_does_not_break_the_scale() -> None:
    objectives = trade_off((0, 4), (4, 0), (2, 2))
    objectives[0, 0] = 0.0
    front = front_of(columns_of(objectives))
    assert rows_of(front.designs) == [0, 1, 2]
    assert np.isfinite([values(design.normalised) for design in front.designs]).all()
    assert values(front.ideal)[0] == 0.0
