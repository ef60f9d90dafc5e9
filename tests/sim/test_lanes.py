"""Lanes: a walk's bits do not depend on its lane, its predecessor or its neighbours."""

from __future__ import annotations

import ctypes
import dataclasses
import gc
import weakref
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final, cast

import numpy as np
import pytest

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.native import LaneCounts, NativeKernel, Pool, native_kernel
from gaitswarm.sim.kernel.reference import reference_kernel
from gaitswarm.sim.kernel.walk import Coding, LaneUse, WalkResult, WalkSetup
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.bounds import ContactLaw
from gaitswarm.sim.scenario import SCENARIOS

LAWS: Final[tuple[ContactLaw, ...]] = ("linear_zone", "dead_zone", "karnopp", "stick")
VARIANTS: Final[dict[str, RobotVariant]] = {
    **{law: RobotVariant(contact_law=law) for law in LAWS},
    "backlash": RobotVariant(contact_law="stick", backlash=(2.5, 1.0, 1.0)),
}
CONTROL_LAWS: Final = [
    controller.compile(design)
    for controller in CONTROLLERS.values()
    for design in controller.published.values()
]


def varied_walks(kernel: NativeKernel, variant: RobotVariant, n: int) -> list[WalkSetup]:
    """Walks of 1 to 130 control ticks after a small fall, some onto ground that carries nothing or
    far too much."""
    robot = load_robot(variant)
    _, timestep = control_steps(robot)
    dropped = SCENARIOS[0].model_copy(update={"cycles": 1.0, "drop": 0.002})
    plan = plan_walk(robot, dropped, timestep)
    assert plan is not None
    rng = np.random.default_rng(11)
    setups = []
    for k in range(n):
        setup = plan(CONTROL_LAWS[k % len(CONTROL_LAWS)])
        ticks = [130, 1, 9, 40][k % 4] + int(rng.integers(0, 5)) * (k % 4 > 1)
        parameters = setup.parameters.copy()
        if k % 5 in (2, 3):
            stiffness = 0.0 if k % 5 == 2 else 1e13
            parameters[kernel.layout.slices["stiffness"]] = stiffness
            parameters[kernel.layout.slices["damping"]] = 0.0
        setups.append(
            dataclasses.replace(
                setup,
                desired=setup.desired[:ticks],
                parameters=parameters,
                # Close to the start: a fall takes a few ticks.
                fall_height=setup.start[2] - 0.002 * (k % 5 == 2) - 0.1 * (k % 5 != 2),
                disturbance=rng.normal(size=(ticks, robot.n_joints)) if k % 3 == 1 else None,
                current_smoothing=0.01 if k % 2 else 1.0,
            )
        )
    return setups


def bits(result: WalkResult) -> tuple[Status, bytes]:
    states = np.empty(0) if result.states is None else result.states.ravel()
    values = np.concatenate([result.sums, result.end, result.peaks, [result.clearance], states])
    # What sign a NaN has is the compiler's choice.
    return result.status, np.where(np.isnan(values), np.nan, values).tobytes()


def kernel_and_coding(
    variant: RobotVariant, precision: Precision = "double"
) -> tuple[NativeKernel, Coding]:
    robot = load_robot(variant)
    kernel = native_kernel(robot, precision)
    assert kernel is not None
    return kernel, control_steps(robot)[0]


@pytest.mark.variants("linear_zone-double", "backlash-single")
@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("variant", VARIANTS.values(), ids=VARIANTS)
def test_a_walk_has_the_same_bits_in_a_lane_that_others_have_left(
    variant: RobotVariant, precision: Precision
) -> None:
    kernel, coding = kernel_and_coding(variant, precision)
    setups = varied_walks(kernel, variant, 2 * kernel.lanes + 5)

    def walked(order: Sequence[int]) -> dict[int, tuple[Status, bytes]]:
        results = kernel.walk([setups[k] for k in order], coding, log=True)
        return {k: bits(result) for k, result in zip(order, results, strict=True)}

    alone = {k: walked([k])[k] for k in range(len(setups))}
    assert {status for status, _ in alone.values()} == {Status.OK, Status.FELL, Status.DIVERGED}
    rounds = kernel.walk(setups[:1], coding, log=False).lane_use.walked
    assert setups[0].ticks < rounds < coding.refinement * setups[0].ticks or coding.refinement == 1
    rng = np.random.default_rng(7)
    everyone = np.arange(len(setups))
    for size in (len(setups), len(setups), kernel.lanes - 1, kernel.lanes + 1):
        order = rng.permutation(everyone)[:size].tolist()
        assert walked(order) == {k: alone[k] for k in order}


def still_walk(ticks: int, drop: float) -> WalkSetup:
    """A robot that falls from so high [m] and stands."""
    robot = load_robot(VARIANTS["dead_zone"])
    _, timestep = control_steps(robot)
    plan = plan_walk(robot, SCENARIOS[0].model_copy(update={"drop": drop}), timestep)
    assert plan is not None
    setup = plan(CONTROL_LAWS[0])
    return dataclasses.replace(setup, desired=np.repeat(setup.desired[:1], ticks, axis=0))


def landing_walk() -> WalkSetup:
    """A fall that takes 20 ms, and 30 ms on the ground."""
    return still_walk(25, 0.002)


def lane_use(kernel: NativeKernel, coding: Coding, ticks: Sequence[int]) -> LaneUse:
    """Of walks of so many control ticks each, none of which ends early, and no foot comes down."""
    results = kernel.walk([still_walk(count, 0.2) for count in ticks], coding, log=False)
    assert {result.status for result in results} == {Status.OK}
    return results.lane_use


def test_a_call_reports_walked_and_computed_rounds() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    n = kernel.lanes
    assert lane_use(kernel, coding, [7]) == LaneUse(walked=7, computed=7 * n)
    assert lane_use(kernel, coding, [7] * n) == LaneUse(walked=7 * n, computed=7 * n)
    assert lane_use(kernel, coding, [7] * (n + 1)) == LaneUse(7 * (n + 1), 14 * n)
    assert kernel.walk([], coding, log=False).lane_use.share == 1.0


def test_a_call_reports_the_time_of_control_ticks_in_sampled_rounds() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    first = lane_use(kernel, coding, [7])
    assert 0 < first.control < first.timed
    both = first + lane_use(kernel, coding, [7])
    assert (both - first).timed == both.timed - first.timed > 0
    assert 0.0 < both.control_share < 1.0
    assert kernel.walk([], coding, log=False).lane_use.control_share == 0.0


def test_a_lane_takes_the_next_walk_when_one_ends_the_longest_first() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    n = kernel.lanes
    # The long one begins at once although it comes last, and the short ones share other lanes.
    ticks = [10] * (3 * (n - 1)) + [30]
    assert lane_use(kernel, coding, ticks) == LaneUse(walked=30 * n, computed=30 * n)


def test_a_control_tick_with_a_landing_takes_as_many_rounds_as_it_has_more_steps() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    landing = landing_walk()
    use = kernel.walk([landing], coding, log=False).lane_use
    extra, rest = divmod(use.walked - landing.ticks, coding.refinement - 1)
    assert rest == 0
    # Nine ticks pass before the feet touch down in the tenth, which is predicted before it begins.
    assert 1 <= extra <= landing.ticks - 9
    reference = reference_kernel(load_robot(VARIANTS["dead_zone"]))
    assert reference.walk([landing], coding, log=False).lane_use.walked == use.walked


def test_lanes_do_not_wait_for_one_another_where_a_foot_comes_down() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    n, landing = kernel.lanes, landing_walk()
    rounds = kernel.walk([landing], coding, log=False).lane_use.walked
    others = [still_walk(count, 0.2) for count in (rounds - 10, 10)]
    results = kernel.walk([landing] + (n - 1) * others, coding, log=False)
    assert {result.status for result in results} == {Status.OK}
    assert results.lane_use == LaneUse(walked=n * rounds, computed=n * rounds)


def test_a_walk_that_ends_early_frees_its_lane() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    falling = dataclasses.replace(still_walk(7, 0.2), fall_height=1.0)
    results = kernel.walk([falling] * (2 * kernel.lanes), coding, log=False)
    assert {result.status for result in results} == {Status.FELL}
    assert results.lane_use == LaneUse(2 * kernel.lanes, 2 * kernel.lanes)


def test_the_interpreter_has_one_lane_which_is_never_idle() -> None:
    robot = load_robot("szabadka2")
    kernel, coding = reference_kernel(robot), Coding.of(robot, 10)
    plan = plan_walk(robot, SCENARIOS[0], 2e-4)
    assert plan is not None
    setup = plan(CONTROL_LAWS[0])
    brief = dataclasses.replace(setup, desired=setup.desired[:3])
    falling = dataclasses.replace(brief, fall_height=1.0)
    assert kernel.walk([brief, falling], coding, log=False).lane_use == LaneUse(4, 4)


@pytest.mark.slow
@pytest.mark.parametrize("log", [True, False])
def test_walks_of_many_threads_have_the_bits_of_walks_one_after_the_other(log: bool) -> None:
    kernel, coding = kernel_and_coding(VARIANTS["stick"])
    setups = varied_walks(kernel, VARIANTS["stick"], kernel.lanes + 3)
    one_after_the_other = kernel.walk(setups, coding, log=log)
    expected = [bits(result) for result in one_after_the_other]
    with ThreadPoolExecutor(8) as pool:
        calls = [pool.submit(kernel.walk, setups, coding, log=log) for _ in range(24)]
        walked = 0
        for call in calls:
            assert [bits(result) for result in call.result()] == expected
            walked += call.result().lane_use.walked
    assert walked == 24 * one_after_the_other.lane_use.walked


def taken_over(kernel: NativeKernel, coding: Coding, *, log: bool) -> int:
    """Rounds that a call of one walk walks for another one, which has many at the same time."""
    long, brief = still_walk(5000, 0.2), still_walk(50, 0.2)
    alone = kernel.walk([long], coding, log=log).lane_use.walked
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(kernel.walk, [brief] * (400 * kernel.lanes), coding, log=log)
        own = kernel.walk([long], coding, log=log).lane_use.walked
        assert own + other.result().lane_use.walked == alone + 20_000 * kernel.lanes
    return own - alone


def test_lanes_that_a_call_leaves_free_take_over_walks_of_another_thread() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    # Threads may come late on a busy machine: once in several tries they walk at the same time.
    assert any(taken_over(kernel, coding, log=False) for _ in range(20))


@pytest.mark.thorough("test_lanes_that_a_call_leaves_free_take_over_walks_of_another_thread")
@pytest.mark.slow
def test_a_call_takes_over_no_walks_of_calls_that_came_after_its_own_walks_had_ended() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    walk, own = still_walk(1000, 0.2), still_walk(1500, 0.2)
    earlier, later = [walk] * (20 * kernel.lanes), [walk] * (60 * kernel.lanes)
    of_earlier = kernel.walk(earlier, coding, log=False).lane_use.walked
    alone = kernel.walk([own], coding, log=False).lane_use.walked

    def walk_later() -> None:
        # A call with logs takes nothing over, and so lasts as long as its walk.
        kernel.walk([still_walk(5000, 0.2)], coding, log=True)
        kernel.walk(later, coding, log=False)

    def takes_over_of_the_earlier_alone() -> bool:
        with ThreadPoolExecutor(2) as pool:
            pool.submit(kernel.walk, earlier, coding, log=False)
            pool.submit(walk_later)
            walked = kernel.walk([own], coding, log=False).lane_use.walked
            return alone < walked <= alone + of_earlier

    # Threads may come late on a busy machine.
    assert any(takes_over_of_the_earlier_alone() for _ in range(3))


@pytest.mark.thorough("test_lanes_that_a_call_leaves_free_take_over_walks_of_another_thread")
def test_walks_with_logs_are_not_delayed_by_others() -> None:
    kernel, coding = kernel_and_coding(VARIANTS["dead_zone"])
    assert [taken_over(kernel, coding, log=True) for _ in range(3)] == [0, 0, 0]


class Interrupted:
    """A kernel's library in which another thread walks on when a call is interrupted."""

    def __init__(self) -> None:
        self.walking = True

    def gaitswarm_walk(self, *_: object) -> None:
        if self.walking:
            raise KeyboardInterrupt

    def gaitswarm_left(self, _: object) -> int:
        return int(self.walking)


def test_memory_of_an_interrupted_call_outlives_its_use_by_other_threads() -> None:
    library = Interrupted()
    pool = Pool(cast("ctypes.CDLL", library))
    owner, coding, walkers = np.empty(1), LaneCounts(), (ctypes.c_double * 2)()
    written_to = weakref.ref(owner)
    with pytest.raises(KeyboardInterrupt):
        pool.walk(walkers, coding, [owner])
    del owner
    gc.collect()
    assert written_to() is not None
    library.walking = False
    pool.walk(walkers, coding, None)
    gc.collect()
    assert written_to() is None
