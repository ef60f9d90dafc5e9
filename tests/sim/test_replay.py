"""A walk to look at again: poses of links against the log, known geometry and Pinocchio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.replay import Replay, replay, ticks_at
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotVariant, load_robot
from gaitswarm.sim.robot.limbs import feet_below_body
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples.paths import QUADRUPED
from tests.examples.robots import with_feet
from tests.examples.walks import quadruped_files, walk

pytestmark = pytest.mark.slow

BRIEF = SCENARIOS[0].model_copy(update={"cycles": 1.0})


def walked(robot: Robot, scenario: Scenario = BRIEF) -> tuple[WalkLog, Status]:
    result = walk(scenario, robot=robot, log=True)
    (log,) = result.logs
    assert log is not None
    return log, Status(result.outcome.statuses[0])


@pytest.fixture(scope="module")
def log(robot: Robot) -> WalkLog:
    return walked(robot)[0]


def rotated(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors turned by quaternions x y z w: (..., 4), (3,) -> (..., 3)."""
    axis, w = quaternion[..., :3], quaternion[..., 3:]
    return vector + 2.0 * np.cross(axis, np.cross(axis, vector) + w * vector)


def test_the_bodys_pose_is_the_logs(robot: Robot, log: WalkLog) -> None:
    shown = replay(robot, log, rate=500)
    assert shown.links[0].name == "body"
    np.testing.assert_allclose(shown.link_pose[:, 0, :3], log.base_position, atol=1e-15)
    turn = np.sum(shown.link_pose[:, 0, 3:] * log.base_orientation, axis=1)
    np.testing.assert_allclose(np.abs(turn), 1.0, atol=1e-12)


def test_the_poses_of_all_links_are_pinocchios(robot: Robot, log: WalkLog) -> None:
    """Joint by joint from the URDF, in another order of computation."""
    shown = replay(robot, log, rate=10)
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    data = model.createData()
    tick = ticks_at(10, len(log.time))[7]
    q = np.concatenate([log.base_position[tick], log.base_orientation[tick], np.zeros(18)])
    for name, angle in zip(robot.joint_names, log.joint_angle[tick], strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.forwardKinematics(model, data, q)
    for k, link in enumerate(shown.links):
        frame = model.frames[model.getFrameId(link.name, pin.FrameType.BODY)]
        there = data.oMi[frame.parentJoint] * frame.placement
        here = pin.XYZQUATToSE3(shown.link_pose[7, k])
        assert here.isApprox(there, 1e-12), link.name


def test_a_foot_is_where_its_tibia_ends(robot: Robot, log: WalkLog) -> None:
    shown = replay(robot, log, rate=50)
    names = [link.name for link in shown.links]
    for k, leg in enumerate(robot.legs):
        tibia = shown.link_pose[:, names.index(f"{leg.name}_tibia_link")]
        end = tibia[:, :3] + rotated(tibia[:, 3:], np.array([0.0, leg.side * leg.lengths[2], 0.0]))
        np.testing.assert_allclose(shown.foot_position[:, k], end, atol=1e-12)
        foot = shown.link_pose[:, names.index(f"{leg.name}_foot"), :3]
        np.testing.assert_allclose(shown.foot_position[:, k], foot, atol=1e-15)


def test_at_the_start_feet_are_at_the_gaits_height(robot: Robot, log: WalkLog) -> None:
    """Soles of 10 mm, pressed together by 6.76 kg on six springs of 10 kN/m."""
    shown = replay(robot, log, rate=50)
    height = 0.010 - robot.mass * 9.81 / 60_000.0
    np.testing.assert_allclose(shown.foot_position[0, :, 2], height, atol=1e-9)
    assert (shown.foot_force[0, :, 2] > 0.0).all()


def test_a_sole_touches_the_ground_where_there_is_force(robot: Robot, log: WalkLog) -> None:
    shown = replay(robot, log, rate=500)
    height, force = shown.foot_position[:, :, 2], shown.foot_force[:, :, 2]
    assert (height[force > 1.0] < 0.010).all()
    assert (height[force > 1.0] > 0.005).all()
    assert (force[height > 0.010] == 0.0).all()
    assert height.max() > 0.030


def test_quaternions_are_of_length_one_and_do_not_jump(robot: Robot, log: WalkLog) -> None:
    """A robot that turns about twice, by 1 degree a tick; q and -q are the same attitude."""
    half = np.radians(np.arange(len(log.time))) / 2.0
    none = np.zeros_like(half)
    turning = replace(
        log, base_orientation=np.stack([none, none, np.sin(half), np.cos(half)], axis=1)
    )
    turns = replay(robot, turning, rate=50).link_pose[:, :, 3:]
    np.testing.assert_allclose(np.linalg.norm(turns, axis=2), 1.0, atol=1e-12)
    assert (np.sum(turns[1:] * turns[:-1], axis=2) > 0.9).all()


@pytest.mark.parametrize(
    ("rate", "first", "n"),
    [(500, [0, 1, 2], 750), (50, [0, 10, 20], 75), (30, [0, 17, 33], 45), (7, [0, 71, 143], 11)],
)
def test_frames_are_the_nearest_ticks_with_their_exact_time(
    robot: Robot, log: WalkLog, rate: float, first: list[int], n: int
) -> None:
    shown = replay(robot, log, rate=rate)
    assert ticks_at(rate, 750)[:3].tolist() == first
    assert len(shown.time) == n
    np.testing.assert_array_equal(shown.time, log.time[ticks_at(rate, 750)])
    np.testing.assert_array_equal(shown.current, log.current[ticks_at(rate, 750)])
    assert shown.duration == pytest.approx(1.5)
    assert shown.time[-1] < shown.duration <= shown.time[-1] + 1.0 / rate + 0.002


def logged_share_of_the_acceleration(robot: Robot) -> float:
    """Root mean square of a replay's, by f2; that sees every physics step, the log 4 ms."""
    result = walk(BRIEF, robot=robot, log=True)
    (log,) = result.logs
    assert log is not None
    norm = np.linalg.norm(replay(robot, log, rate=500).body_acceleration, axis=1)
    return float(np.sqrt(np.mean(norm**2)) / result.outcome.objectives[0, 1])


def test_the_bodys_acceleration_is_the_objectives(robot: Robot) -> None:
    assert logged_share_of_the_acceleration(robot) == pytest.approx(1.0, rel=0.03)


@pytest.mark.thorough("test_a_sole_touches_the_ground_where_there_is_force")
def test_touch_downs_on_the_default_robots_dampers_are_shorter_than_the_logs_ticks() -> None:
    """Up to 2270 N s/m; with 150 N s/m under the same robot the log sees them."""
    default = load_robot(DEFAULT_ROBOT)
    soft = with_feet(default, damping=150.0)
    assert 0.5 < logged_share_of_the_acceleration(default) < 0.8
    assert logged_share_of_the_acceleration(soft) == pytest.approx(1.0, rel=0.03)


def test_with_backlash_the_link_is_shown_not_its_motor() -> None:
    robot = load_robot(RobotVariant(backlash=(2.5, 1.0, 1.0)))
    log, _ = walked(robot, BRIEF.model_copy(update={"cycle_time": 0.5}))
    shown = replay(robot, log, rate=100)
    assert np.abs(shown.joint_angle - shown.motor_angle).max() > 0.015
    below = shown.link_pose[0, 0, 2] + feet_below_body(robot, shown.joint_angle[0])
    np.testing.assert_allclose(shown.foot_position[0, :, 2], below, atol=1e-12)
    names = [link.name for link in shown.links]
    body, coxa = (
        shown.link_pose[:, names.index(name), 3:] for name in ("body", "left_front_coxa_link")
    )
    # Coxas of left legs turn about -z; the angle between the two frames is the link's.
    cosine = np.abs(np.sum(body * coxa, axis=1))
    turned = np.abs(shown.joint_angle[:, robot.joint_names.index("left_front_coxa")])
    np.testing.assert_allclose(2.0 * np.arccos(np.minimum(cosine, 1.0)), turned, atol=1e-6)


def test_a_walk_that_fell_is_shown_up_to_its_end(robot: Robot) -> None:
    log, status = walked(robot, BRIEF.model_copy(update={"slope": 45.0}))
    assert status is Status.FELL
    shown = replay(robot, log, rate=500)
    assert 0 < len(shown.time) < 750
    assert shown.duration == pytest.approx(shown.time[-1] + 0.002)
    for name in ("link_pose", "foot_force", "load_torque", "body_acceleration", "supply"):
        assert np.isfinite(getattr(shown, name)).all(), name
    # It ended because the body tilted over 45 degrees, and not before.
    up = rotated(shown.link_pose[:, 0, 3:], np.array([0.0, 0.0, 1.0]))[:, 2]
    assert up.min() == up[-1] == pytest.approx(0.5**0.5, abs=0.02)


@pytest.mark.parametrize("ticks", [0, 1])
def test_a_walk_that_hardly_began_can_be_shown(robot: Robot, log: WalkLog, ticks: int) -> None:
    voltage = log.voltage.copy()
    voltage[ticks:] = np.nan
    shown = replay(robot, replace(log, voltage=voltage), rate=50)
    assert shown.link_pose.shape == (ticks, len(shown.links), 7)
    assert np.isfinite(shown.body_acceleration).all()
    assert shown.duration == ticks * 0.002


def test_a_robot_of_ones_own_is_shown() -> None:
    robot = load_robot(quadruped_files())
    crawl = (QUADRUPED / "crawl.json").read_text(encoding="utf-8")
    scenario = Scenario.model_validate_json(crawl)
    log, _ = walked(robot, scenario.model_copy(update={"cycles": 1.0}))
    shown: Replay = replay(robot, log, rate=50)
    assert len(shown.links) == 1 + 4 * 4
    assert shown.foot_position.shape[1:] == (4, 3)
    np.testing.assert_allclose(
        shown.foot_position[0, :, 2],
        shown.link_pose[0, 0, 2] + feet_below_body(robot, shown.joint_angle[0]),
        atol=1e-12,
    )
