"""`gaitswarm.write_trajectories`: what servos get, and what ROS 2 accepts."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import gaitswarm
from gaitswarm.sim.assembly import control_steps, judge, kernel_of, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.gait.setpoints import setpoints
from gaitswarm.sim.gait.trajectory import Trajectory, desired_angles
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal.document import walking_proposal
from gaitswarm.sim.proposal.legs import LegHints
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.robot.limbs import feet_in_body
from tests.examples.walks import quadruped_files, short_walk
from tests.robots.test_proposal import dog

PI = {"P": 0.45, "I": 0.1}
WALK = short_walk(cycles=2)
MESSAGE = {"joint_names", "points"}
POINT = {"positions", "velocities", "time_from_start"}
DURATION = {"sec", "nanosec"}
"""Fields of trajectory_msgs/msg/JointTrajectory, JointTrajectoryPoint and of
builtin_interfaces/msg/Duration that are set; others are empty."""


def with_neck(angle: float) -> RobotFiles:
    """A robot with a joint that belongs to no leg."""
    files = quadruped_files()
    neck = (
        '<joint name="neck" type="revolute"><parent link="body"/><child link="head"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        '<link name="head"/></robot>'
    )
    return RobotFiles(
        toml=f"{files.toml}\n[held_joints]\nneck = {angle}\n",
        urdf=files.urdf.replace("</robot>", neck),
    )


def written(folder: Path, **options: Any) -> gaitswarm.TrajectoriesView:
    return gaitswarm.write_trajectories(
        PI, folder, controller="pi", **{"scenarios": WALK} | options
    )


def rows_of(file: Path) -> tuple[list[str], np.ndarray]:
    head, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    return head, np.array(rows, dtype=float)


def test_a_cycle_has_the_angles_of_the_simulation(tmp_path: Path) -> None:
    view = written(tmp_path / "f", rate=100.0)
    robot = load_robot("szabadka2")
    head, rows = rows_of(tmp_path / "f" / "short-cycle.csv")
    assert head == ["time", *robot.joint_names]
    assert view.scenarios[0].rows == {"start": 100, "cycle": 100, "stop": 101}
    np.testing.assert_allclose(rows[:, 0], np.arange(100) / 100.0)
    simulated = desired_angles(robot, WALK).angles[500::5]
    np.testing.assert_allclose(rows[:, 1:], simulated, atol=1e-6)


def test_a_walk_starts_and_stops_in_the_stance_without_jumps_or_dragged_feet() -> None:
    robot = load_robot("szabadka2")
    points = setpoints(robot, WALK, 500.0)
    walk, stance = points.walk, points.start[0]
    np.testing.assert_allclose(stance.reshape(6, 3), np.tile(stance[:3], (6, 1)), atol=1e-9)
    assert (walk[-1] == stance).all()
    usual = np.abs(np.diff(np.concatenate([points.cycle, points.cycle[:1]]), axis=0)).max()
    assert np.abs(np.diff(walk, axis=0)).max() < 1.02 * usual
    assert np.abs(points.velocities[[1, -2]]).max() < 1e-3
    lowest = [feet_in_body(robot, angles)[:, 2].min() for angles in walk[::10]]
    assert np.ptp(lowest) < 1e-4


def test_the_robot_walks_from_its_stance_and_back() -> None:
    robot = load_robot("szabadka2")
    walk, plain = setpoints(robot, WALK, 500.0).walk, desired_angles(robot, WALK)
    planned = Trajectory(walk, np.arange(18), plain.miss, plain.excess)
    coding, timestep = control_steps(robot)
    distances = []
    for trajectory in (planned, plain):
        plan = plan_walk(robot, WALK, timestep, trajectory=trajectory)
        assert plan is not None
        setup = plan(CONTROLLERS["pi"].compile(PI))
        (result,) = kernel_of(robot).walk([setup], coding, log=False)
        assert judge(setup, result, coding.substeps, timestep)[0] is Status.OK
        distances.append(result.sums[4] * timestep)
    # The first and the last cycle, in which strides grow and fall, are about half a cycle each.
    assert distances[0] == pytest.approx(1.5 * distances[1], rel=0.1)


def test_a_ros_2_controller_accepts_the_message(tmp_path: Path) -> None:
    """The rules of joint_trajectory_controller::validate_trajectory_msg."""
    view = written(tmp_path / "f", robot=with_neck(0.25))
    message = yaml.safe_load((tmp_path / "f" / "short.yaml").read_text(encoding="utf-8"))
    assert set(message) == MESSAGE
    assert message["joint_names"] == view.joints and len(set(view.joints)) == 13
    times = []
    for point in message["points"]:
        assert set(point) == POINT and set(point["time_from_start"]) == DURATION
        for field in ("positions", "velocities"):
            assert [type(value) for value in point[field]] == [float] * 13
        sec, nanosec = point["time_from_start"]["sec"], point["time_from_start"]["nanosec"]
        assert type(sec) is int and type(nanosec) is int and 0 <= nanosec < 10**9
        times.append(sec + 1e-9 * nanosec)
    np.testing.assert_allclose(np.diff(times), 0.02)
    assert times[0] == 2.0, "time to reach the stance"
    assert not np.any(message["points"][-1]["velocities"])
    assert len(times) == 50 + 2 * 50 + 51
    positions = np.array([point["positions"] for point in message["points"]])
    velocities = np.array([point["velocities"] for point in message["points"]])
    np.testing.assert_allclose(velocities[1:-1], (positions[2:] - positions[:-2]) / 0.04, atol=1e-4)


def test_joints_faster_than_their_motors_are_named(tmp_path: Path) -> None:
    """Without load, a servo turns at U duty / (k + R B / k)."""
    made = walking_proposal(dog(), "dog", hints=LegHints(actuators={"*": "xl330"}))
    robot = RobotFiles(toml=made.toml, urdf=made.urdf)
    slow, fast = (
        short_walk(cycle_time=cycle_time, stride=0.1, height=0.1, hip_height=0.3, radius=0.12)
        for cycle_time in (4.0, 0.3)
    )
    folder = tmp_path / "f"
    view = written(
        folder, robot=robot, scenarios=[slow, fast.model_copy(update={"name": "fast"})], rate=500.0
    )
    no_load = 5.0 / (0.366013 + 2.81139 * 0.00535967 / 0.366013)
    easy, hard = view.scenarios
    assert not easy.too_fast and hard.too_fast
    speeds, limits = zip(*hard.too_fast.values(), strict=True)
    assert limits == pytest.approx([no_load] * 4)
    assert max(speeds) == hard.largest_speed > no_load
    _, *rows = csv.reader((folder / "speeds.csv").read_text(encoding="utf-8").splitlines())
    assert [row[:2] for row in rows[12:]] == [["fast", joint] for joint in view.joints]
    beyond = [row[1] for row in rows[12:] if float(row[2]) > float(row[3])]
    assert beyond == [*hard.too_fast]


def test_held_joints_have_their_angle_or_no_column(tmp_path: Path) -> None:
    robot = with_neck(0.25)
    assert written(tmp_path / "all", robot=robot).joints[-1] == "neck"
    for part in ("start", "cycle", "stop"):
        head, rows = rows_of(tmp_path / "all" / f"short-{part}.csv")
        assert head[-1] == "neck" and (rows[:, -1] == 0.25).all()
    assert "neck" not in written(tmp_path / "legs", robot=robot, held=False).joints


def test_a_cycle_of_any_length_has_whole_rows_and_a_start_as_long_as_the_filter(
    tmp_path: Path,
) -> None:
    odd = short_walk(cycle_time=0.63, fir_ms=700)
    (view,) = written(tmp_path / "f", scenarios=odd).scenarios
    assert view.rows == {"start": 64, "cycle": 32, "stop": 65}
    assert view.step == pytest.approx(0.63 / 32)
    points = setpoints(load_robot("szabadka2"), odd, 500.0)
    whole = np.concatenate([points.cycle, points.cycle[:1]])
    assert np.abs(np.diff(whole, axis=0)[-1]).max() < 0.02, "it closes"


@pytest.mark.parametrize("rate", [4.0, 500.0])
def test_cycles_of_too_few_or_too_many_rows_are_refused(rate: float, tmp_path: Path) -> None:
    long = short_walk(cycle_time=1.5 if rate == 4.0 else 10.0, cycles=100)
    with pytest.raises(gaitswarm.InvalidRequest, match=r"choose a rate of .* Hz to") as refused:
        written(tmp_path / "f", scenarios=long, rate=rate)
    assert refused.value.field == "rate"
    assert not (tmp_path / "f").exists()
