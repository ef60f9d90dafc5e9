"""Predicted durations of tasks."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.services.worker.cutting import Chunk, Part
from gaitswarm.services.worker.durations import CaseTime, Durations, costs_of
from tests.worker.requests import SCENARIOS, request

PACE = {"level": 0.5, "slope": 2.0, "turn": 0.2}


def ended(costs: dict[str, float]) -> CaseTime:
    return CaseTime(costs, sum(PACE[case] * seconds for case, seconds in costs.items()))


def test_tasks_of_one_case_are_predicted_after_the_first_of_it() -> None:
    known = Durations().after([ended({"level": 10.0}), ended({"slope": 10.0})])
    assert known.predicted({"level": 4.0}) == pytest.approx(2.0)
    assert known.predicted({"slope": 4.0, "level": 2.0}) == pytest.approx(9.0)


def test_nothing_is_predicted_of_a_case_that_was_never_measured() -> None:
    known = Durations().after([ended({"level": 10.0})])
    assert known.predicted({"level": 1.0, "turn": 1.0}) is None
    assert Durations().after([]).predicted({"level": 1.0}) is None


def test_the_pace_of_each_case_is_found_from_tasks_of_several() -> None:
    generator = np.random.default_rng(3)
    known = Durations()
    for _ in range(300):
        mixtures = generator.uniform(0.0, 10.0, (6, 3))
        known = known.after([ended(dict(zip(PACE, row, strict=True))) for row in mixtures])
    assert known.rates == pytest.approx(PACE, rel=0.05)


def test_a_case_whose_pace_changes_is_known_by_it_after_some_iterations() -> None:
    known = Durations().after([CaseTime({"level": 10.0}, 1.0)])
    for _ in range(8):
        known = known.after([CaseTime({"level": 10.0}, 5.0)])
    assert known.predicted({"level": 10.0}) == pytest.approx(5.0, rel=0.02)


def test_a_chunks_cost_is_divided_as_its_walks_are_long() -> None:
    cases = request(8).cases
    chunk = Chunk((Part(0, 0, 6), Part(1, 0, 2)), cost=100.0)
    walks = [6 * cases[0].duration, 2 * cases[1].duration]
    assert list(costs_of(chunk, cases).values()) == pytest.approx(
        [100.0 * seconds / sum(walks) for seconds in walks]
    )
    assert [name.split()[0] for name in costs_of(chunk, cases)] == [s.name for s in SCENARIOS]
