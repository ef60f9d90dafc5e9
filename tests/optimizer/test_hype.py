"""HypE: what it selects by, what it keeps, and that it finds a front faster than NSGA-II."""

from __future__ import annotations

import itertools
import json
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from gaitswarm.services.optimizer.search.hype import (
    Hype,
    HypeSettings,
    SampledHypervolume,
    pareto_ranks,
)
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Axis, Space

Floats = NDArray[np.float64]

BOX = Space.continuous([0.0] * 9, [1.0] * 9)
LINE = Space([Axis(0.0, 1.0)])


def search(space: Space = BOX, seed: int = 1, start: Floats | None = None, **given: object) -> Hype:
    optimizer = Hype(HypeSettings.model_validate(given), space, 625, seed)
    if start is not None:
        optimizer.start_from(start)
    return optimizer


def dtlz2(x: Floats) -> Floats:
    """(n, 5) objectives whose front is the part of the unit sphere where all are positive."""
    radius = 1.0 + np.square(x[:, 4:] - 0.5).sum(axis=1)
    angle = 0.5 * math.pi * x[:, :4]
    cosines = np.cumprod(np.column_stack([np.ones(len(x)), np.cos(angle)]), axis=1)[:, ::-1]
    sines = np.column_stack([np.ones(len(x)), np.sin(angle[:, ::-1])])
    return radius[:, np.newaxis] * cosines * sines


def hypervolume(vectors: Floats, reference: float = 1.5) -> float:
    """Share of the box from 0 to the reference point, of points drawn in it."""
    drawn = 20_000
    points = np.random.default_rng(0).random((drawn, vectors.shape[1])) * reference
    for vector in vectors:
        points = points[(vector > points).any(axis=1)]
    return 1.0 - len(points) / drawn


def found_by(optimizer: Hype, evaluations: int = 625) -> Floats:
    found = []
    while optimizer.evaluations < evaluations:
        positions = optimizer.ask(evaluations - optimizer.evaluations)
        found.append(dtlz2(positions))
        optimizer.tell(found[-1])
    return np.vstack(found)


def test_ranks_are_those_of_the_definition() -> None:
    vectors = np.floor(np.random.default_rng(3).random((60, 3)) * 6.0)
    vectors[::11] = math.inf
    left, expected, rank = set(range(60)) - set(range(0, 60, 11)), np.full(60, -1), 0

    def dominates(i: int, j: int) -> bool:
        return bool((vectors[i] <= vectors[j]).all() and (vectors[i] < vectors[j]).any())

    while left:
        front = {j for j in left if not any(dominates(i, j) for i in left)}
        expected[list(front)] = rank
        left, rank = left - front, rank + 1
    expected[expected < 0] = rank
    assert rank > 2
    assert pareto_ranks(vectors).tolist() == expected.tolist()


def sampled(front: Floats, samples: int = 50_000) -> SampledHypervolume:
    return SampledHypervolume(front, samples, RandomNumbers(1, 99))


def test_a_share_is_what_a_vector_dominates_alone() -> None:
    # Scaled, the box is 1.1 x 1.1; the middle one of the three has 0.5 x 0.5 of it for itself.
    shares = sampled(np.array([[0.0, 10.0], [5.0, 5.0], [10.0, 0.0]])).shares()
    np.testing.assert_allclose(shares / 50_000 * 1.1**2, [0.05, 0.25, 0.05], rtol=0.05)


def test_those_are_chosen_that_dominate_the_most_together() -> None:
    # Four of them lie close together in the middle.
    angle = np.array([0.8, 0.2, 0.78, 1.4, 0.76, 0.82, 0.0, 1.57])
    front = np.column_stack([np.cos(angle), np.sin(angle)]) ** 3
    scaled = (front - front.min(axis=0)) / np.ptp(front, axis=0)
    volume = {
        chosen: hypervolume(scaled[list(chosen)], 1.1)
        for chosen in itertools.combinations(range(len(front)), 3)
    }
    good = 0.99 * max(volume.values())
    assert volume[tuple(sampled(front, 20_000).chosen(3).tolist())] >= good
    assert np.mean([value >= good for value in volume.values()]) < 0.1


def test_of_equal_vectors_one_is_chosen() -> None:
    front = np.array([[0.0, 1.0]] * 4 + [[1.0, 0.0], [0.4, 0.4]])
    assert sampled(front).chosen(3).tolist() == [3, 4, 5]


def test_whole_fronts_stay_as_long_as_there_is_room_and_failures_last() -> None:
    optimizer = search(LINE, population=4, offspring=4)
    first = optimizer.ask()
    optimizer.tell(np.array([[1.0, 2.0], [math.inf, math.inf], [2.0, 1.0], [3.0, 3.0]]))
    second = optimizer.ask()
    optimizer.tell(np.array([[4.0, 4.0], [0.9, 5.0], [math.inf, 0.0], [5.0, 5.0]]))
    positions, vectors = optimizer.state.members, optimizer.state.vectors
    assert positions.tolist() == [*first[[0, 2, 3]].tolist(), second[1].tolist()]
    assert vectors.tolist() == [[1.0, 2.0], [2.0, 1.0], [3.0, 3.0], [0.9, 5.0]]


def test_scaling_an_objective_changes_no_bit_of_the_path() -> None:
    # By powers of two, which round nothing.
    plain, scaled = search(), search()
    for _ in range(8):
        positions = plain.ask()
        assert scaled.ask().tobytes() == positions.tobytes()
        plain.tell(dtlz2(positions))
        scaled.tell(dtlz2(positions) * np.array([1.0, 1024.0, 0.25, 1.0, 8.0]))


def test_the_first_members_are_the_start_and_more_than_there_is_room_for_are_selected() -> None:
    start = np.linspace(0.05, 0.95, 10)[:, np.newaxis]
    optimizer = search(LINE, start=start, population=4, particles=10)
    positions = optimizer.ask()
    assert positions.tolist() == start.tolist()
    # All but the last three are dominated by the third.
    feedback = np.column_stack([np.abs(positions[:, 0] - 0.25), np.full(10, 1.0)])
    feedback[7:] = [[9.0, 0.5], [8.0, 0.7], [7.0, 0.8]]
    optimizer.tell(feedback)
    assert optimizer.state.members.tolist() == start[[2, 7, 8, 9]].tolist()


def test_designs_at_bounds_are_tried() -> None:
    optimizer = search(Space.continuous([0.0] * 3, [1.0] * 3))
    at_bounds = total = 0
    while optimizer.evaluations < 400:
        positions = optimizer.ask()
        at_bounds += int((positions == 0.0).any(axis=1).sum())
        total += len(positions)
        # The less of everything the better, but of what it costs.
        optimizer.tell(np.column_stack([positions.sum(axis=1), 1.0 - positions[:, 0]]))
    assert at_bounds > 0.25 * total


def test_choices_and_integers_of_a_front_are_all_found() -> None:
    space = Space([Axis(0.0, 3.0, "categorical"), Axis(0.0, 4.0, "integer"), Axis(0.0, 1.0)])
    optimizer, best = search(space, population=25), dict[float, float]()
    while optimizer.evaluations < 500:
        designs = space.designs(optimizer.ask())
        # Each choice is as good as the next, in another way; each has its own best integer.
        gap = np.abs(designs[:, 1] - designs[:, 0]) + designs[:, 2]
        optimizer.tell(np.column_stack([gap + designs[:, 0], gap + 3.0 - designs[:, 0]]))
        for choice, value in zip(designs[:, 0].tolist(), gap.tolist(), strict=True):
            best[choice] = min(value, best.get(choice, math.inf))
    assert set(best) == {0.0, 1.0, 2.0, 3.0}
    assert max(best.values()) < 0.05


@pytest.mark.thorough(
    "test_whole_fronts_stay_as_long_as_there_is_room_and_failures_last, until a search converges"
)
def test_a_converged_population_is_given_up_for_a_new_one() -> None:
    optimizer, extents = search(LINE, population=6, offspring=6), [1.0]
    while optimizer.evaluations < 3_000:
        positions = optimizer.ask()
        extents.append(float(np.ptp(positions)))
        optimizer.tell(np.column_stack([np.abs(positions[:, 0] - 0.3)] * 2))
    small = extents.index(next(extent for extent in extents if extent < 1e-8))
    assert max(extents[small:]) > 0.5


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("members", [[0.5]] * 9),
        ("members", [[7.0]] * 4),
        ("vectors", [[1.0, 2.0]]),
        ("vectors", [[1.0, 2.0], [1.0], [1.0, 2.0], [1.0, 2.0]]),
        ("vectors", [[]] * 4),
        ("fitness", [[1.0, 2.0, 3.0]]),
        ("fitness", [1.0]),
    ],
)
def test_an_impossible_state_is_refused(field: str, value: object) -> None:
    optimizer = search(LINE, population=4, offspring=4, particles=2)
    for _ in range(3):
        positions = optimizer.ask()
        optimizer.tell(np.column_stack([positions[:, 0], 1.0 - positions[:, 0]]))
    before = json.dumps(optimizer.dump())
    with pytest.raises(ValueError, match=field):
        optimizer.load(optimizer.dump() | {field: value})
    assert json.dumps(optimizer.dump()) == before


def test_scales_are_in_order() -> None:
    with pytest.raises(ValidationError, match="scale_least"):
        HypeSettings(scale_least=0.8, scale_most=0.5)


def test_vectors_have_as_many_numbers_as_the_first_ones() -> None:
    optimizer = search(LINE, population=4, offspring=4)
    optimizer.ask()
    optimizer.tell(np.ones((4, 3)))
    optimizer.ask()
    with pytest.raises(ValueError, match=r"fitness has shape \(4, 2\), not \(4, 3\)"):
        optimizer.tell(np.ones((4, 2)))


def by_nsga2(seed: int) -> Floats:
    """What pymoo's NSGA-II finds in 625 evaluations, with a population of 25 or 50, the better."""
    pytest.importorskip("pymoo")
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Dtlz2(Problem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(n_var=9, n_obj=5, xl=0.0, xu=1.0)
            self.feedback: list[Floats] = []

        def _evaluate(self, x: Floats, out: dict[str, Floats], *_: object, **__: object) -> None:
            out["F"] = dtlz2(x)
            self.feedback.append(out["F"])

    runs = []
    for population in (25, 50):
        problem = Dtlz2()
        minimize(problem, NSGA2(pop_size=population), ("n_eval", 625), seed=seed)
        runs.append(np.vstack(problem.feedback)[:625])
    return max(runs, key=hypervolume)


@pytest.mark.thorough("comparison with another method")
def test_it_finds_more_hypervolume_of_five_objectives_than_nsga_ii() -> None:
    own = [hypervolume(found_by(search(seed=seed))) for seed in range(3)]
    others = [hypervolume(by_nsga2(seed)) for seed in range(2)]
    assert min(own) > max(others) + 0.06
