"""Cutting iterations into tasks."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.worker.dispatch import Chunk, Pace, cut
from gaitswarm.services.worker.tasks import run_task
from gaitswarm.sim.kernel.walk import LaneUse
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import lanes
from tests.examples.walks import short_walk
from tests.worker.requests import request

DURATIONS = [scenario.duration for scenario in SCENARIOS]

PACES = st.builds(Pace, st.floats(1e-5, 1.0), st.floats(0.0, 0.1)) | st.just(Pace())


def end_of_last_slot(chunks: Sequence[Chunk], slots: int) -> float:
    """Greedy assignment in the order of the chunks, as the slots take them."""
    loads = [0.0] * slots
    for chunk in chunks:
        heapq.heapreplace(loads, loads[0] + chunk.cost)
    return max(loads)


@given(
    durations=st.lists(st.floats(0.2, 1000.0), min_size=1, max_size=12),
    designs=st.integers(1, 600),
    slots=st.integers(1, 64),
    lanes=st.sampled_from([1, 2, 4, 8, 16]),
    pace=PACES,
    together=st.booleans(),
)
def test_every_design_of_every_case_is_in_one_chunk(
    durations: list[float], designs: int, slots: int, lanes: int, pace: Pace, together: bool
) -> None:
    chunks = cut(durations, designs, slots=slots, lanes=lanes, pace=pace, together=together)
    for case in range(len(durations)):
        ranges = sorted((c.start, c.stop) for c in chunks if case in c.cases)
        assert [start for start, _ in ranges] == [0, *(stop for _, stop in ranges[:-1])]
        assert ranges[-1][1] == designs
        assert all(start < stop for start, stop in ranges)
    for chunk in chunks:
        simulated = (chunk.stop - chunk.start) * sum(durations[case] for case in chunk.cases)
        assert chunk.cost >= simulated * (1.0 - 1e-9)
        if not together or slots >= len(durations):
            assert len(chunk.cases) == 1
            assert chunk.start % lanes == 0
    costs = [chunk.cost for chunk in chunks]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize("slots", [8, 16])
def test_all_slots_of_the_chapter_4_job_stay_busy(slots: int) -> None:
    chunks = cut(DURATIONS, 25, slots=slots, lanes=4)
    ideal = math.fsum(chunk.cost for chunk in chunks) / slots
    assert end_of_last_slot(chunks, slots) <= 1.25 * ideal


def test_fewer_slots_than_scenarios_have_a_task_each_with_all_scenarios() -> None:
    chunks = cut(DURATIONS, 25, slots=2, lanes=8, pace=Pace(1e-3, 5e-3))
    assert [(chunk.cases, chunk.stop - chunk.start) for chunk in chunks] == [
        (tuple(range(6)), 13),
        (tuple(range(6)), 12),
    ]


@pytest.mark.parametrize("slots", [1, 2, 8])
def test_a_task_of_a_big_job_takes_a_second_at_the_measured_pace(slots: int) -> None:
    for seconds in (1e-4, 1e-3, 3e-3):
        chunks = cut(DURATIONS, 3000, slots=slots, lanes=8, pace=Pace(seconds, 5e-3))
        assert 0.3 <= max(chunk.cost for chunk in chunks) * seconds <= 1.1


def test_tasks_of_a_big_job_are_longer_on_many_slots() -> None:
    chunks = cut(DURATIONS, 1_000_000, slots=1000, lanes=8, pace=Pace(1e-3, 5e-3))
    assert max(chunk.cost for chunk in chunks) * 1e-3 == pytest.approx(3.0, rel=0.2)


@pytest.mark.parametrize("slots", [8, 64])
def test_sending_takes_at_most_a_twentieth_of_a_task_of_a_big_job(slots: int) -> None:
    seconds, overhead = 1e-3, 0.02
    chunks = cut([0.2] * 6, 3000, slots=slots, lanes=4, pace=Pace(seconds, overhead))
    assert min(chunk.cost for chunk in chunks) * seconds >= 0.5 * overhead / 0.05


def test_before_anything_is_measured_tasks_are_neither_tiny_nor_huge() -> None:
    assert min(chunk.cost for chunk in cut([0.2] * 6, 1000, slots=64, lanes=4)) >= 5.0
    for slots in (1, 8):
        assert max(chunk.cost for chunk in cut(DURATIONS, 10_000, slots=slots, lanes=8)) <= 300.0


def test_the_pace_blends_iterations_and_takes_the_overhead_of_a_task_that_did_not_wait() -> None:
    pace = Pace().after([(100.0, 0.10, 0.004), (100.0, 0.14, 0.120)])
    assert (pace.seconds, pace.overhead) == pytest.approx((0.0012, 0.004))
    later = pace.after([(100.0, 0.36, 0.008)])
    assert (later.seconds, later.overhead) == pytest.approx((0.0024, 0.006))
    assert later.after([]) == later


@pytest.mark.slow
@pytest.mark.parametrize("slots", [1, 2])
def test_the_kernel_leaves_less_than_a_tenth_of_its_lanes_idle(slots: int) -> None:
    """The six scenarios in small, the shortest first, which is the worst order for the lanes."""
    walks = [
        short_walk(name=f"walk-{index}", cycle_time=duration / 15.0)
        for index, duration in enumerate(sorted(DURATIONS))
    ]
    wanted = request(25, scenarios=tuple(walks))
    durations = [case.duration for case in wanted.cases]
    use = LaneUse()
    for chunk in cut(durations, 25, slots=slots, lanes=lanes(), pace=Pace(1e-3, 5e-3)):
        cases = [wanted.cases[case] for case in chunk.cases]
        designs = wanted.designs[chunk.start : chunk.stop]
        use += run_task(cases, designs, wanted.provenance).kernel_time.lane_use
    assert use.share >= 0.9
