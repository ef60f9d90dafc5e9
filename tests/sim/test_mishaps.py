"""A robot that is dropped, and one whose leg is jammed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pytest

from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.parameters import GRAVITY, Layout, pack_parameters
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotVariant, load_robot
from gaitswarm.sim.scenario import find_scenario
from gaitswarm.sim.simulate import Simulation, check_reach
from tests.examples.robots import changed
from tests.examples.walks import logged_walk, short_walk, walk

JAMMED = 2
"""Index of the right middle leg."""

PI = {"P": 0.45, "I": 0.1}

RULES_5_AND_6: Final[Mapping[str, tuple[ControllerName, str]]] = {
    "A": ("fuzzy-pi", "FW56"),
    "B": ("fuzzy-pi", "FW56"),
    "C": ("fuzzy-pi", "FW56"),
    "fuzzy-pso-ps": ("fuzzy-pi-3", "W56"),
}
"""By published optimum: its controller, and the weight of the rules."""


def test_a_robot_is_dropped_from_above_its_stance() -> None:
    stance, above = (logged_walk(short_walk(drop=drop), PI, "pi") for drop in (0.0, 0.05))
    assert above.base_position[0, 2] == stance.base_position[0, 2] + 0.05
    assert not above.foot_force[0].any()
    assert above.foot_force[:, :, 2].max() > 1.5 * stance.foot_force[:, :, 2].max()


def test_a_drop_is_no_loss_of_height() -> None:
    outcome = walk(short_walk(drop=0.05), PI, "pi").outcome
    assert outcome.statuses.tolist() == [Status.OK]
    assert abs(outcome.objectives[0, 5]) < 0.01


def test_a_body_that_sinks_loses_height() -> None:
    scenario = short_walk()
    height = logged_walk(scenario, PI, "pi").base_position[:, 2]
    assert height[-1] < height[0] - 5e-4
    loss = walk(scenario, PI, "pi").outcome.objectives[0, 5]
    assert loss == pytest.approx(height[0] - height[-1], abs=1e-4)


def test_a_jammed_leg_stays_where_it_was_and_the_others_walk() -> None:
    log = logged_walk(short_walk(stuck_leg="right_middle"), PI, "pi")
    coxa, femur, tibia = np.ptp(log.joint_angle, axis=0).reshape(6, 3).T
    others = np.arange(6) != JAMMED
    assert max(coxa[JAMMED], femur[JAMMED], tibia[JAMMED]) < 0.02
    assert (coxa[others] > 0.3).all()
    assert (femur[others] > 0.3).all()
    assert (tibia[others] > 0.1).all()


def test_a_motor_that_pushes_at_an_obstacle_is_hot_and_loads_its_gear() -> None:
    free, stuck = (short_walk(stuck_leg=leg) for leg in (None, "right_middle"))
    calm, strained = (walk(scenario, PI, "pi").measurements for scenario in (free, stuck))
    assert strained.motor_heat[0] > 1.5 * calm.motor_heat[0]
    assert strained.peak_current[0] > calm.peak_current[0]
    log = logged_walk(stuck, PI, "pi")
    actuators, joint = load_robot("szabadka2").actuators(), 3 * JAMMED
    pushed = actuators.torque[joint] * log.current[:, joint]
    at_its_worst = int(np.argmax(np.abs(pushed)))
    # All that the motor gives passes through the gearhead, whatever holds the link.
    assert log.load_torque[at_its_worst, joint] == pytest.approx(pushed[at_its_worst], rel=0.1)
    assert abs(pushed[at_its_worst]) > 2.0


@pytest.mark.variants("variant0")
@pytest.mark.parametrize("variant", [RobotVariant(), RobotVariant(backlash=(2.5, 1.0, 1.0))])
def test_kernels_agree_on_a_jammed_leg_that_is_dropped(variant: RobotVariant) -> None:
    scenario = short_walk(stuck_leg="left_rear", drop=0.01, cycle_time=0.25)
    fast, slow = (
        walk(scenario, PI, "pi", robot=variant, backend=backend)
        for backend in ("native", "reference")
    )
    assert fast.outcome.statuses.tolist() == slow.outcome.statuses.tolist() == [Status.OK]
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-7)
    np.testing.assert_allclose(fast.measurements.array(), slow.measurements.array(), rtol=1e-7)


def test_all_scenarios_of_a_robot_share_a_kernel_jammed_or_not() -> None:
    robot = load_robot("szabadka2")
    free, stuck = (
        pack_parameters(robot, short_walk(stuck_leg=leg), 2e-4) for leg in (None, "left_rear")
    )
    held = Layout(robot).slices["jam_stiffness"]
    assert free.shape == stuck.shape
    assert not free[held].any()
    jammed = [robot.joint_names[joint] for joint in np.flatnonzero(stuck[held])]
    assert jammed == ["left_rear_coxa", "left_rear_femur", "left_rear_tibia"]


def test_the_published_optimum_falls_onto_its_feet_and_walks_on() -> None:
    drop, straight = find_scenario("drop"), find_scenario("straight")
    dropped, level = walk(drop, log=True), walk(straight)
    (log,) = dropped.logs
    assert log is not None
    landed = int(np.argmax(log.foot_force[:, :, 2].sum(axis=1) > 0.0))
    fallen = log.base_position[0, 2] - log.base_position[landed, 2]
    # The springs of a stance are compressed by what carries the weight.
    assert 0.02 < fallen <= 0.03
    assert log.time[landed] == pytest.approx(math.sqrt(2.0 * fallen / GRAVITY), abs=0.005)
    assert dropped.outcome.statuses.tolist() == [Status.OK]
    assert dropped.outcome.objectives[0, 1] > 2.0 * level.outcome.objectives[0, 1]
    assert dropped.measurements.speed[0] == pytest.approx(level.measurements.speed[0], rel=0.02)


def test_the_published_optimum_walks_slower_and_hotter_with_a_stuck_leg() -> None:
    stuck, free = (walk(find_scenario(name)) for name in ("stuck-leg", "straight"))
    assert stuck.outcome.statuses.tolist() == [Status.OK]
    assert 0.0 < stuck.measurements.speed[0] < 0.9 * free.measurements.speed[0]
    assert stuck.measurements.motor_heat[0] > 2.0 * free.measurements.motor_heat[0]


def with_a_stuck_leg(
    study: str, *, protected: bool = True, cycles: float = 3.0, **options: Any
) -> Simulation:
    """A published optimum with its rules 5 and 6, or with the weight 0 in place of theirs."""
    controller, weight = RULES_5_AND_6[study]
    design = dict(CONTROLLERS[controller].published[study])
    if not protected:
        design[weight] = 0.0
    stuck = find_scenario("stuck-leg").model_copy(update={"cycles": cycles})
    simulated = walk(stuck, design, controller, **options)
    assert simulated.outcome.statuses.tolist() == [Status.OK]
    return simulated


def peak_and_heat(study: str, **options: Any) -> tuple[float, float]:
    """Peak current and motor heat with rules 5 and 6, each as a share of that without."""
    guarded, open_ = (
        with_a_stuck_leg(study, protected=protected, **options).measurements
        for protected in (True, False)
    )
    return (
        float(guarded.peak_current[0] / open_.peak_current[0]),
        float(guarded.motor_heat[0] / open_.motor_heat[0]),
    )


@pytest.mark.parametrize(
    ("study", "peak", "heat"),
    [("A", 0.98, 1.005), ("B", 1.005, 0.98), ("fuzzy-pso-ps", 0.65, 0.55)],
)
def test_rules_5_and_6_protect_the_motors_of_a_stuck_leg(
    study: str, peak: float, heat: float
) -> None:
    """The protection of 4.3.2: less peak current or less heat, by the same design else."""
    found = peak_and_heat(study)
    assert found[0] < peak
    assert found[1] < heat


def test_the_small_weight_of_optimum_c_protects_nothing() -> None:
    assert peak_and_heat("C") == pytest.approx((1.0, 1.0), abs=0.03)


@pytest.mark.variants("A")
@pytest.mark.parametrize("study", ["A", "fuzzy-pso-ps"])
def test_without_the_low_pass_of_the_current_the_protection_chatters(study: str) -> None:
    """A reversed motor's current falls at once, so that it is driven ahead again, and so on."""
    unfiltered = changed(load_robot(DEFAULT_ROBOT), sensors={"current_filter": 0.0})
    assert peak_and_heat(study, robot=unfiltered)[0] > 1.05
    reversals = {}
    for name, robot in (("filtered", load_robot(DEFAULT_ROBOT)), ("unfiltered", unfiltered)):
        (log,) = with_a_stuck_leg(study, cycles=2.0, robot=robot, log=True).logs
        assert log is not None
        current = log.current[:, robot.joint_names.index("right_middle_femur")]
        reversals[name] = np.count_nonzero(np.diff(np.sign(current)))
    assert reversals["unfiltered"] > 100 + reversals["filtered"]


def test_a_leg_that_the_robot_does_not_have_cannot_be_jammed() -> None:
    scenario = short_walk(stuck_leg="right_wing")
    for refuse in (
        lambda: walk(scenario, PI, "pi"),
        lambda: check_reach(scenario, [], [], robot="szabadka2"),
    ):
        with pytest.raises(SimulationInputError, match=r"^stuck_leg: .*right_wing.*left_rear"):
            refuse()
