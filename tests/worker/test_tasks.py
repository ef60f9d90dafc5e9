"""How an iteration is cut."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.worker.tasks import cut
from sim.scenario import SCENARIOS

DURATIONS = [scenario.duration for scenario in SCENARIOS]


@given(
    durations=st.lists(st.floats(0.2, 1000.0), min_size=1, max_size=12),
    designs=st.integers(1, 3000),
    slots=st.integers(1, 64),
    lanes=st.sampled_from([1, 2, 4, 8, 16]),
)
def test_every_design_of_every_case_is_in_one_chunk_and_lanes_are_filled(
    durations: list[float], designs: int, slots: int, lanes: int
) -> None:
    chunks = cut(durations, designs, slots=slots, lanes=lanes)
    for case in range(len(durations)):
        own = sorted((c.start, c.stop) for c in chunks if c.case == case)
        assert [start for start, _ in own] == [0, *(stop for _, stop in own[:-1])]
        assert own[-1][1] == designs
        assert all(start % lanes == 0 and start < stop for start, stop in own)


def test_the_longest_come_first() -> None:
    costs = [chunk.cost for chunk in cut(DURATIONS, 25, slots=2, lanes=8)]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize("slots", [1, 2, 8, 16])
def test_all_slots_of_the_chapter_4_job_stay_busy(slots: int) -> None:
    """Greedy assignment in the order of the chunks, as the slots take them."""
    chunks = cut(DURATIONS, 25, slots=slots, lanes=4)
    loads = [0.0] * slots
    for chunk in chunks:
        least = min(range(slots), key=loads.__getitem__)
        loads[least] += chunk.cost
    ideal = math.fsum(loads) / slots
    assert max(loads) <= 1.25 * ideal


def test_a_task_carries_tens_of_milliseconds_of_work_at_least_if_there_is_so_much() -> None:
    chunks = cut([0.2] * 6, 1000, slots=64, lanes=4)
    assert min(chunk.cost for chunk in chunks) >= 5.0


def test_a_task_of_a_big_job_takes_a_second_and_not_minutes() -> None:
    chunks = cut(DURATIONS, 10_000, slots=1, lanes=8)
    assert max(chunk.cost for chunk in chunks) <= 300.0
