"""Cutting iterations into tasks."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.worker.cutting import Chunk, cut
from gaitswarm.services.worker.pace import Pace, TaskTime
from gaitswarm.services.worker.tasks import Task
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel.walk import LaneUse
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import lanes
from tests.examples.walks import short_walk
from tests.worker.requests import request

DURATIONS = [scenario.duration for scenario in SCENARIOS]


SWARM_SECONDS = 25 * math.fsum(DURATIONS)

PACES = st.builds(Pace, st.floats(1e-5, 1.0), st.floats(0.0, 0.1), st.floats(0.0, 0.5)) | st.just(
    Pace()
)


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
    shared=st.booleans(),
)
def test_every_design_of_every_case_is_in_one_chunk(
    durations: list[float],
    designs: int,
    slots: int,
    lanes: int,
    pace: Pace,
    together: bool,
    shared: bool,
) -> None:
    chunks = cut(
        durations, designs, slots=slots, lanes=lanes, pace=pace, together=together, shared=shared
    )
    for case in range(len(durations)):
        own = sorted((p.start, p.stop) for c in chunks for p in c.parts if p.case == case)
        assert [start for start, _ in own] == [0, *(stop for _, stop in own[:-1])]
        assert own[-1][1] == designs
        assert all(start < stop for start, stop in own)
    for chunk in chunks:
        walked = sum((p.stop - p.start) * durations[p.case] for p in chunk.parts)
        assert chunk.cost >= walked * (1.0 - 1e-9)
        if not together or slots >= len(durations):
            (part,) = chunk.parts
            assert part.start % lanes == 0


@pytest.mark.parametrize("slots", [2, 8])
def test_the_longest_come_first(slots: int) -> None:
    costs = [chunk.cost for chunk in cut(DURATIONS, 25, slots=slots, lanes=8)]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize("slots", [8, 16])
def test_all_slots_of_the_chapter_4_job_stay_busy(slots: int) -> None:
    chunks = cut(DURATIONS, 25, slots=slots, lanes=4)
    ideal = math.fsum(chunk.cost for chunk in chunks) / slots
    assert end_of_last_slot(chunks, slots) <= 1.25 * ideal


@pytest.mark.parametrize("lanes", [4, 8, 16])
@pytest.mark.parametrize("slots", [1, 2])
@pytest.mark.parametrize("spread", [0.0, 0.02, 0.05])
def test_a_swarm_of_25_in_six_scenarios_wastes_at_most_5_percent_of_its_lanes(
    lanes: int, slots: int, spread: float
) -> None:
    """Of all lanes of all slots, until the last one ends."""
    chunks = cut(DURATIONS, 25, slots=slots, lanes=lanes, pace=Pace(1e-3, 5e-3, spread))
    assert SWARM_SECONDS / (slots * end_of_last_slot(chunks, slots)) >= 0.95


def test_few_slots_make_the_tables_of_nearly_every_design_in_one_task_only() -> None:
    chunks = cut(DURATIONS, 25, slots=2, lanes=8, pace=Pace(1e-3, 5e-3, 0.01))
    assert len(chunks) == 2
    shared = [{k for p in chunk.parts for k in range(p.start, p.stop)} for chunk in chunks]
    assert len(shared[0] & shared[1]) <= 1


def test_the_more_the_paces_differ_the_more_is_left_for_short_tasks_at_the_end() -> None:
    even, uneven = (
        cut(DURATIONS, 200, slots=2, lanes=4, pace=Pace(2e-4, 1e-3, spread))
        for spread in (0.0, 0.5)
    )
    assert uneven[-1].cost < 0.5 * even[-1].cost


@pytest.mark.parametrize("slots", [1, 2, 4])
@pytest.mark.parametrize("spread", [0.0, 0.05, 0.5])
def test_slots_that_take_over_walks_of_each_other_have_one_task_each(
    slots: int, spread: float
) -> None:
    pace = Pace(1e-3, 5e-3, spread)
    assert len(cut(DURATIONS, 25, slots=slots, lanes=8, pace=pace, shared=True)) == slots


@pytest.mark.parametrize("slots", [1, 2, 8])
def test_a_task_of_a_big_job_takes_a_second_at_the_pace_that_was_measured(slots: int) -> None:
    for seconds in (1e-4, 1e-3, 3e-3):
        chunks = cut(DURATIONS, 3000, slots=slots, lanes=8, pace=Pace(seconds, 5e-3, 0.02))
        longest = max(chunk.cost for chunk in chunks) * seconds
        assert 0.3 <= longest <= 1.1


@pytest.mark.parametrize("slots", [4, 64])
def test_sending_takes_a_twentieth_of_a_task_at_most_if_there_is_so_much_to_do(slots: int) -> None:
    seconds, overhead = 1e-3, 0.02
    chunks = cut([0.2] * 6, 3000, slots=slots, lanes=4, pace=Pace(seconds, overhead))
    assert min(chunk.cost for chunk in chunks) * seconds >= 0.5 * overhead / 0.05


def test_before_anything_is_measured_tasks_are_neither_tiny_nor_huge() -> None:
    assert min(chunk.cost for chunk in cut([0.2] * 6, 1000, slots=64, lanes=4)) >= 5.0
    for slots in (1, 8):
        assert max(chunk.cost for chunk in cut(DURATIONS, 10_000, slots=slots, lanes=8)) <= 300.0


def test_the_pace_is_that_of_all_tasks_and_the_overhead_that_of_one_that_did_not_wait() -> None:
    tasks = [TaskTime(100.0, 0.10, 0.004), TaskTime(100.0, 0.14, 0.120)]
    pace = Pace().after(tasks)
    assert (pace.seconds, pace.overhead) == pytest.approx((0.0012, 0.004))
    assert pace.spread == pytest.approx(0.02 / 0.12)


def test_half_of_what_is_known_of_the_pace_is_of_the_last_iteration() -> None:
    pace = Pace().after([TaskTime(10.0, 1.0, 0.5)]).after([TaskTime(10.0, 3.0, 0.1)])
    assert (pace.seconds, pace.overhead, pace.spread) == pytest.approx((0.2, 0.3, 0.0))
    assert pace.after([]) == pace


@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0, 250.0])
@pytest.mark.parametrize("lanes", [4, 8, 16])
def test_a_slow_robot_leaves_at_most_a_tenth_of_the_lanes_idle(rate: float, lanes: int) -> None:
    """At so many simulated seconds a second, tasks of a second have few walks in each lane."""
    chunks = cut(DURATIONS, 25, slots=2, lanes=lanes, pace=Pace(1.0 / rate, 5e-3, 0.02))
    assert SWARM_SECONDS / math.fsum(chunk.cost for chunk in chunks) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("slots", [1, 2])
def test_the_kernel_steps_as_many_lanes_as_was_planned_and_5_percent_of_them_idle(
    slots: int,
) -> None:
    """The six scenarios in small, the shortest first, which is the worst order for the lanes."""
    walks = [
        short_walk(name=f"walk-{index}", cycle_time=duration / 15.0)
        for index, duration in enumerate(sorted(DURATIONS))
    ]
    wanted = request(25, scenarios=tuple(walks))
    chunks = cut(
        [case.duration for case in wanted.cases],
        25,
        slots=slots,
        lanes=lanes(),
        pace=Pace(1e-3, 5e-3, 0.02),
    )
    use, planned = LaneUse(), 0.0
    for chunk in chunks:
        task = Task.of(wanted.cases, wanted.designs, chunk.parts, wanted.provenance)
        use += task.run().kernel_time.lane_use
        planned += chunk.cost / CONTROL_PERIOD
    # Landings, which take some rounds more, are many in walks of a fraction of a second.
    assert planned <= use.computed < 1.5 * planned
    assert use.share >= 0.95
