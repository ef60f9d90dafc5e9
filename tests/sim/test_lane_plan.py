"""Order in which walks enter the lanes, and idle lanes."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.sim.kernel.lanes import plan_lanes
from gaitswarm.sim.scenario import SCENARIOS

SWARM = [scenario.duration for scenario in SCENARIOS for _ in range(25)]


def end_of_last_lane(durations: Sequence[float], order: Sequence[int], lanes: int) -> float:
    """A kernel that fills each free lane with the next walk of the order."""
    free = [0.0] * lanes
    for index in order:
        heapq.heapreplace(free, free[0] + durations[index])
    return max(free)


@given(durations=st.lists(st.integers(0, 5000), max_size=200), lanes=st.sampled_from([1, 4, 8, 16]))
def test_every_walk_begins_once_and_refilled_lanes_end_when_the_plan_says(
    durations: list[int], lanes: int
) -> None:
    plan = plan_lanes(durations, lanes)
    assert sorted(plan.order) == list(range(len(durations)))
    assert end_of_last_lane(durations, plan.order, lanes) == plan.end
    if any(durations):
        assert plan.use == pytest.approx(sum(durations) / lanes / plan.end)


def test_a_free_lane_takes_the_next_walk_even_where_that_was_meant_for_another() -> None:
    durations = [37, 2782, 2011, 12, 2098, 36, 2630, 4377]  # spread over two lanes until 7019
    plan = plan_lanes(durations, 2)
    assert plan.end == end_of_last_lane(durations, plan.order, 2) == 7007


@given(
    durations=st.lists(st.integers(1, 5000), min_size=1, max_size=200),
    lanes=st.sampled_from([2, 8, 16]),
)
def test_lanes_end_no_later_than_with_the_longest_walks_first(
    durations: list[int], lanes: int
) -> None:
    longest_first = sorted(range(len(durations)), key=lambda k: -durations[k])
    end = plan_lanes(durations, lanes).end
    assert end <= end_of_last_lane(durations, longest_first, lanes)
    assert end >= max(*durations, sum(durations) / lanes)


@pytest.mark.parametrize("lanes", [4, 8, 16, 32])
def test_a_swarm_of_25_in_six_scenarios_leaves_a_hundredth_of_the_lanes_idle(lanes: int) -> None:
    assert plan_lanes(SWARM, lanes).use >= 0.99


def test_no_walks_need_no_lanes() -> None:
    assert plan_lanes([], 8).order == ()
