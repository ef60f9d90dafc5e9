"""An optimizer whose positions follow from their number alone."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.kinds.certificate import Enumeration


def numbers(start: int, stop: int) -> np.ndarray:
    return np.arange(float(start), float(stop)).reshape(-1, 1)


def enumeration(particles: int = 3) -> Enumeration:
    return Enumeration("random", particles, numbers)


def test_positions_are_asked_for_in_order_whatever_they_are_worth() -> None:
    search = enumeration()
    assert search.ask().tolist() == search.ask().tolist() == [[0.0], [1.0], [2.0]]
    search.tell(np.array([5.0, np.inf, 1.0]))
    assert search.ask(2).tolist() == [[3.0], [4.0]]
    # What is asked already stays.
    assert search.ask().tolist() == [[3.0], [4.0]]
    search.tell(np.zeros(2))
    assert search.ask().tolist() == [[5.0], [6.0], [7.0]]
    assert (search.iteration, search.evaluations) == (2, 5)


def test_a_restored_state_continues_and_does_not_grow() -> None:
    search, sizes = enumeration(), set()
    for _ in range(9):
        state = json.loads(json.dumps(search.dump()))
        sizes.add(len(json.dumps(state)))
        other = enumeration()
        other.load(state)
        assert other.ask().tolist() == search.ask().tolist()
        search.tell(np.zeros(3))
    assert max(sizes) - min(sizes) <= 2


def test_what_is_no_state_of_it_is_refused_and_changes_nothing() -> None:
    search = enumeration()
    search.ask()
    search.tell(np.zeros(3))
    before = search.dump()
    for change, words in (
        ({"optimizer": "pso"}, "not a state of random: optimizer: pso"),
        ({"asked": 4}, "asked: 4 positions, more than random asks for"),
        ({"schema_version": 2}, "schema_version"),
        ({"feedback": []}, "feedback"),
    ):
        with pytest.raises(ValueError, match=words):
            search.load(before | change)
        assert search.dump() == before


def test_it_begins_with_its_first_position_and_needs_to_be_asked() -> None:
    with pytest.raises(ValueError, match="does not accept start positions"):
        enumeration().start_from(np.zeros((1, 1)))
    with pytest.raises(ValueError, match="before ask"):
        enumeration().tell(np.zeros(3))
