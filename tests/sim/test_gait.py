"""Foot curves, inverse kinematics, smoothing, and the pose at rest."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import UnreachablePose
from gaitswarm.sim.gait.curves import foot_curve
from gaitswarm.sim.gait.inverse_kinematics import leg_angles
from gaitswarm.sim.gait.trajectory import desired_angles, n_ticks, require_reachable
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.limbs import feet_below_body, resting_height
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario


def test_support_is_a_straight_line_at_constant_speed_and_swing_a_half_ellipse() -> None:
    phase = np.linspace(0.0, 1.0, 1001)[:-1]
    forward, lift = foot_curve("half_ellipse", phase, stride=0.16, height=0.03, duty_factor=0.56)
    support = phase < 0.56
    np.testing.assert_allclose(np.diff(forward[support]), -0.16 / 0.56 * 0.001, rtol=1e-9)
    assert not lift[support].any()
    assert forward[0] == 0.08
    swing = ~support
    np.testing.assert_allclose((forward[swing] / 0.08) ** 2 + (lift[swing] / 0.03) ** 2, 1.0)
    assert lift.max() == pytest.approx(0.03, rel=1e-4)


def test_the_curve_is_closed_and_continuous() -> None:
    phase = np.array([0.56 - 1e-9, 0.56, 1.0 - 1e-9, 0.0])
    forward, lift = foot_curve("half_ellipse", phase, stride=0.16, height=0.03, duty_factor=0.56)
    np.testing.assert_allclose(forward, [-0.08, -0.08, 0.08, 0.08], atol=1e-8)
    np.testing.assert_allclose(lift, 0.0, atol=1e-8)


@given(st.integers(0, 5), st.floats(-0.07, 0.07), st.floats(0.08, 0.13), st.floats(-0.14, -0.10))
def test_inverse_kinematics_is_undone_by_pinocchios_forward_kinematics(
    leg: int, forward: float, lateral: float, vertical: float
) -> None:
    robot = load_robot("szabadka2")
    geometry = robot.legs[leg]
    angles, miss = leg_angles(
        geometry.lengths, np.array([forward]), np.array([lateral]), np.array([vertical])
    )
    assert miss[0] == 0.0
    assert angles[0, 2] < 0.0, "knee up: the tibia bends down from the femur"
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    for name, angle in zip(robot.description.legs[leg].joints, angles[0], strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.framesForwardKinematics(model, data, q)
    foot = data.oMf[model.getFrameId(robot.description.legs[leg].foot)].translation
    hip = np.array(geometry.hip)
    expected = hip + np.array([forward, geometry.side * lateral, vertical])
    np.testing.assert_allclose(foot, expected, atol=1e-12)


def test_a_target_out_of_reach_is_missed_by_its_distance(robot: Robot) -> None:
    lengths = robot.legs[0].lengths
    _, miss = leg_angles(lengths, np.zeros(2), np.full(2, lengths[0]), np.array([-0.25, -0.03]))
    np.testing.assert_allclose(miss, [0.05, 0.01])


def test_every_scenario_is_within_reach_and_the_stride_bound_is_near_its_limit(
    robot: Robot,
) -> None:
    for scenario in SCENARIOS:
        assert desired_angles(robot, scenario).reachable
    laden = SCENARIOS[2]
    reach = {
        stride: desired_angles(robot, laden.model_copy(update={"stride": stride})).reachable
        for stride in (0.18, 0.20)
    }
    assert reach == {0.18: True, 0.20: False}


def test_tripods_alternate(robot: Robot) -> None:
    scenario = SCENARIOS[0]
    coxa = desired_angles(robot, scenario).angles[:, ::3]
    np.testing.assert_allclose(coxa[:, 0], coxa[:, 3], atol=1e-12)
    np.testing.assert_allclose(coxa[:, 0], coxa[:, 4], atol=1e-12)
    half = n_ticks(scenario) // 6
    settled = slice(20, 20 + 2 * half)
    later = slice(20 + half, 20 + 3 * half)
    np.testing.assert_allclose(coxa[later, 0], coxa[settled, 1], atol=1e-9)


def test_a_right_turn_shortens_the_right_strides(robot: Robot) -> None:
    swing = np.ptp(desired_angles(robot, SCENARIOS[5]).angles[:, ::3], axis=0)
    right, left = swing[[0, 2, 4]], swing[[1, 3, 5]]
    assert (right < 0.6 * left).all()


def test_a_turn_of_both_sides_lengthens_the_outer_strides_by_what_it_takes_from_the_inner(
    robot: Robot,
) -> None:
    turn = SCENARIOS[5].model_copy(update={"turn": 0.25, "turn_mode": "both"})
    inner = turn.model_copy(update={"turn_mode": "inner"})
    (right, left), straight = ((turn.stride_of(side) for side in (-1, 1)), turn.stride)
    assert (right, left) == (0.75 * straight, 1.25 * straight)
    assert (inner.stride_of(-1), inner.stride_of(1)) == (0.75 * straight, straight)
    to_the_left = turn.model_copy(update={"turn": -0.25})
    assert (to_the_left.stride_of(-1), to_the_left.stride_of(1)) == (left, right)

    swing = np.ptp(desired_angles(robot, turn).angles[:, ::3], axis=0)
    narrow = np.ptp(desired_angles(robot, inner).angles[:, ::3], axis=0)
    np.testing.assert_allclose(swing[[0, 2, 4]], narrow[[0, 2, 4]])
    assert (swing[[1, 3, 5]] > 1.1 * narrow[[1, 3, 5]]).all()


def test_a_stride_that_a_turn_lengthens_out_of_reach_names_scenario_leg_and_millimetres(
    robot: Robot,
) -> None:
    turn = SCENARIOS[5].model_copy(update={"turn": 1.0, "stride": 0.25})
    require_reachable(robot, turn)
    both = turn.model_copy(update={"turn_mode": "both"})
    with pytest.raises(UnreachablePose, match=r"turn-right-fast.*left_\w+.* mm"):
        require_reachable(robot, both)


@given(st.sampled_from(SCENARIOS), st.floats(0.01, 0.3), st.floats(1.0, 6.0))
def test_a_walk_may_start_if_all_of_its_angles_are_reachable(
    walk: Scenario, stride: float, cycles: float
) -> None:
    robot = load_robot("szabadka2")
    longer = walk.model_copy(update={"stride": stride, "cycles": cycles})
    miss = desired_angles(robot, longer).miss.max()
    if miss > 0.0:
        with pytest.raises(UnreachablePose) as refused:
            require_reachable(robot, longer)
        assert refused.value.miss == miss
    else:
        require_reachable(robot, longer)


def test_checking_reach_takes_no_longer_for_long_walks_and_filters(robot: Robot) -> None:
    longest = SCENARIOS[0].model_copy(
        update={"cycle_time": 10.0, "cycles": 100.0, "fir_ms": 1000, "fir_window": "hamming"}
    )
    begun = time.process_time()
    for k in range(32):
        require_reachable(robot, longest.model_copy(update={"hip_height": 0.15 + 1e-4 * k}))
    # Filtered to its end, one of them takes a minute.
    assert time.process_time() - begun < 10.0


def test_a_share_of_swing_is_the_rest_of_one_of_support(robot: Robot) -> None:
    support = SCENARIOS[0].model_copy(update={"duty_factor": 0.6})
    swing = SCENARIOS[0].model_copy(update={"duty_factor": 0.4, "duty_phase": "swing"})
    np.testing.assert_array_equal(
        desired_angles(robot, swing).angles, desired_angles(robot, support).angles
    )


@pytest.mark.parametrize(
    ("start_phase", "first"), [(0.0, [1, 2, 5]), (0.5, [0, 3, 4])], ids=["0", "0.5"]
)
def test_where_the_gait_begins_says_which_legs_swing_first(
    robot: Robot, start_phase: float, first: list[int]
) -> None:
    scenario = SCENARIOS[0].model_copy(update={"start_phase": start_phase})
    angles = desired_angles(robot, scenario).angles
    quarter = angles[n_ticks(scenario) // 12]
    raised = feet_below_body(robot, quarter) - feet_below_body(robot, angles[0])
    assert np.flatnonzero(raised > 0.01).tolist() == first
    assert raised[[k for k in range(6) if k not in first]] == pytest.approx(0.0, abs=1e-6)


def test_a_gait_begins_with_the_pose_that_it_has_at_its_start_phase(robot: Robot) -> None:
    begun = SCENARIOS[0].model_copy(update={"start_phase": 0.3, "fir_ms": 0})
    whole = SCENARIOS[0].model_copy(update={"fir_ms": 0})
    later = round(0.3 * whole.cycle_time / CONTROL_PERIOD)
    angles = desired_angles(robot, begun).angles[:-later]
    np.testing.assert_allclose(angles, desired_angles(robot, whole).angles[later:], atol=1e-12)


@pytest.mark.parametrize("curve", ["half_ellipse", "quadratic_spline"])
def test_feet_of_a_backward_walk_are_those_of_a_forward_one_in_a_mirror(
    robot: Robot, curve: str
) -> None:
    ahead = SCENARIOS[0].model_copy(update={"curve": curve})
    angles = desired_angles(robot, ahead).angles
    mirrored = desired_angles(robot, ahead.model_copy(update={"direction": "backward"})).angles
    np.testing.assert_allclose(mirrored[:, ::3], -angles[:, ::3], atol=1e-12)
    for joint in (1, 2):
        np.testing.assert_allclose(mirrored[:, joint::3], angles[:, joint::3], atol=1e-12)


def test_slow_trajectories_are_held_between_updates(robot: Robot) -> None:
    slow = SCENARIOS[0].model_copy(update={"trajectory_rate": 20.0, "fir_ms": 0})
    angles = desired_angles(robot, slow).angles[:, 0]
    changes = np.flatnonzero(np.diff(angles)) + 1
    assert set(np.diff(changes)) == {25}


@pytest.mark.parametrize("name", ["szabadka2", "szabadka2-identified"])
def test_legs_that_move_alike_are_planned_once_and_have_the_angles_of_their_own(name: str) -> None:
    described = load_robot(name).description
    own = described.model_copy(update={"planned_soles": "own"})
    for robot in (load_robot(name), replace(load_robot(name), description=own)):
        for turn in (0.0, 0.5):
            scenario = SCENARIOS[5].model_copy(
                update={"turn": turn, "fir_ms": 0, "start_phase": 0.2}
            )
            planned = desired_angles(robot, scenario)
            alone = [angles_of_one_leg(robot, scenario, leg) for leg in range(6)]
            np.testing.assert_array_equal(planned.angles, np.concatenate(alone, axis=1))
            np.testing.assert_array_equal(planned.start, planned.angles[0])
            np.testing.assert_array_equal(planned.codes(1e4), np.rint(planned.angles * 1e4))


def angles_of_one_leg(robot: Robot, scenario: Scenario, leg: int) -> np.ndarray:
    geometry = robot.legs[leg]
    phase = robot.description.legs[leg].phase + scenario.start_phase
    time = np.arange(n_ticks(scenario)) * CONTROL_PERIOD
    forward, lift = foot_curve(
        "half_ellipse",
        np.mod(time / scenario.cycle_time + phase, 1.0),
        stride=scenario.stride_of(geometry.side),
        height=scenario.height,
        duty_factor=scenario.support_share,
    )
    lateral = np.full_like(forward, scenario.radius - abs(geometry.hip[1]))
    vertical = lift - (scenario.hip_height - robot.planned_soles()[leg])
    return np.round(leg_angles(geometry.lengths, forward, lateral, vertical)[0], 12)


def test_scenarios_and_robots_whose_legs_move_alike_share_a_trajectory(robot: Robot) -> None:
    level = SCENARIOS[0]
    steep = level.model_copy(update={"name": "steep", "load": 3.0, "slope": 15.0, "drop": 0.01})
    assert desired_angles(robot, steep) is desired_angles(robot, level)
    identified = load_robot("szabadka2-identified")
    assert desired_angles(identified, level) is desired_angles(load_robot("szabadka2"), level)
    assert not desired_angles(robot, level).columns.flags.writeable


@pytest.mark.variants("*turn*", "*fir_window*", "*curve*")
@pytest.mark.parametrize(
    "change",
    [
        {"cycle_time": 1.6},
        {"radius": 0.17},
        {"hip_height": 0.14},
        {"direction": "backward"},
        {"turn": 0.1},
        {"stride": 0.05},
        {"height": 0.03},
        {"duty_factor": 0.5},
        {"duty_phase": "swing"},
        {"start_phase": 0.5},
        {"fir_ms": 20},
        {"fir_window": "hamming"},
        {"trajectory_rate": 50.0},
        {"curve": "quadratic_spline"},
        {"cycles": 2.0},
    ],
    ids=str,
)
def test_trajectories_differ_in_everything_they_depend_on(
    robot: Robot, change: dict[str, object]
) -> None:
    usual = desired_angles(robot, SCENARIOS[0])
    other = desired_angles(robot, SCENARIOS[0].model_copy(update=change))
    assert usual.columns.shape != other.columns.shape or (usual.columns != other.columns).any()


def scenario_2011(w_s: float, turn: float = 0.0) -> Scenario:
    """A level walk by the commands of 2011 (appendix .2.1); w_s sets the cycle's length."""
    cycle_time = 25.2 / w_s
    return Scenario(
        name="2011",
        cycle_time=cycle_time,
        radius=0.16,
        hip_height=0.15,
        turn=turn,
        turn_mode="both",
        curve="quadratic_spline",
        duty_factor=0.5,
        trajectory_rate=42 / cycle_time,
        fir_ms=0,
        start_phase=0.5,
    )


@pytest.mark.parametrize(
    ("w_s", "cycle_time", "rate"), [(7.5, 3.36, 12.5), (10, 2.52, 16.7), (20, 1.26, 33.3)]
)
def test_the_robot_of_2011_was_sent_42_targets_a_cycle(
    w_s: float, cycle_time: float, rate: float
) -> None:
    scenario = scenario_2011(w_s)
    assert scenario.cycle_time == pytest.approx(cycle_time)
    assert scenario.trajectory_rate == pytest.approx(rate, abs=0.05)


@pytest.mark.parametrize("w_s", [7.5, 10.0, 12.0, 15.0, 20.0])
def test_twenty_of_them_are_of_swing_twenty_of_support_and_two_end_the_stride(
    robot: Robot, w_s: float
) -> None:
    scenario = scenario_2011(w_s)
    angles = desired_angles(robot, scenario).angles[: round(scenario.cycle_time / CONTROL_PERIOD)]
    targets = angles[np.append(True, np.diff(angles[:, 0]) != 0.0)]
    assert len(targets) == 42
    heights = np.array([feet_below_body(robot, joints) for joints in targets])
    lift = heights - heights.min()
    forward = np.tan(targets[:, ::3]) * (scenario.radius - 0.07)
    for leg in range(6):
        ends = np.isclose(abs(forward[:, leg]), scenario.stride / 2.0)
        assert ends.sum() == 2
        assert (lift[ends, leg] < 1e-9).all()
        assert (lift[~ends, leg] > 1e-4).sum() == 20
        assert (lift[~ends, leg] < 1e-9).sum() == 20
    assert np.flatnonzero(lift[5] > 1e-4).tolist() == [0, 3, 4], "legs 1, 4, 5 swing first"


def test_in_2011_a_turn_shortened_one_sides_stride_and_lengthened_the_others() -> None:
    scenario = scenario_2011(10, 0.25)
    assert scenario.stride_of(-1) == 0.75 * scenario.stride
    assert scenario.stride_of(1) == 1.25 * scenario.stride


def test_at_rest_the_springs_carry_the_weight(robot: Robot) -> None:
    joints = desired_angles(robot, SCENARIOS[0]).angles[0]
    height = resting_height(robot, joints, 66.3)
    compression = 0.010 - (height + feet_below_body(robot, joints))
    assert 1e4 * compression.clip(0).sum() == pytest.approx(66.3)
    assert height == pytest.approx(0.15, abs=2e-3)


def test_a_robot_rests_on_the_feet_that_reach_the_ground(robot: Robot) -> None:
    swinging = SCENARIOS[0].model_copy(update={"duty_factor": 0.45})
    joints = desired_angles(robot, swinging).angles[0]
    height = resting_height(robot, joints, 66.3)
    compression = 0.010 - (height + feet_below_body(robot, joints))
    assert (compression > 0).sum() == 3
    assert 1e4 * compression.clip(0).sum() == pytest.approx(66.3)
