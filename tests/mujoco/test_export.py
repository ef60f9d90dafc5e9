"""The exported robot as a model that MuJoCo opens, shows and simulates."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from gaitswarm.sim.assembly import plan_walk
from gaitswarm.sim.controllers import control_law
from gaitswarm.sim.mujoco.model import exported
from gaitswarm.sim.robot import RobotFiles, RobotVariant, load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.terrain import Rough, height_grid
from tests.examples.commands import run_command
from tests.examples.paths import ROOT
from tests.examples.robots import SLOW, robot_folder
from tests.examples.walks import STEEP

DEFAULT = RobotVariant()


def opened(scenario: Scenario, robot: RobotVariant = DEFAULT) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(exported(load_robot(robot), scenario))


def test_its_keyframe_is_the_pose_in_which_the_walk_begins() -> None:
    robot, scenario = load_robot(DEFAULT), SCENARIOS[2]
    plan = plan_walk(robot, scenario, 4e-4)
    assert plan is not None
    start = plan(control_law("pi", (("P", 0.45), ("I", 0.1)))).start
    key = opened(scenario).key("start").qpos
    np.testing.assert_allclose(key, start[[0, 1, 2, 6, 3, 4, 5, *range(7, 25)]], atol=1e-12)


def test_it_stands_on_its_soles_while_motors_hold_it() -> None:
    """A tenth of a second, joints held by voltages that answer to their errors."""
    robot = load_robot(DEFAULT)
    m = opened(SCENARIOS[0])
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, m.key("start").id)
    stance, height = d.qpos[7:].copy(), float(d.qpos[2])
    while d.time < 0.1:
        d.ctrl[:] = np.clip(100.0 * (stance - d.qpos[7:]), -9.0, 9.0)
        mujoco.mj_step(m, d)
    wrench, pressed = np.zeros(6), 0.0
    for contact in range(d.ncon):
        mujoco.mj_contactForce(m, d, contact, wrench)
        pressed += wrench[0]
    assert pressed == pytest.approx(robot.mass * 9.81, rel=0.2)
    assert float(d.qpos[2]) == pytest.approx(height, abs=5e-3)


def test_load_and_slope_are_the_scenarios_and_shapes_weigh_nothing() -> None:
    plain, steep = opened(SCENARIOS[0]), opened(STEEP)
    mass = load_robot(DEFAULT).mass
    assert plain.body_mass.sum() == pytest.approx(mass, rel=1e-12)
    assert steep.body_mass.sum() == pytest.approx(mass + STEEP.load, rel=1e-12)
    assert np.linalg.norm(steep.opt.gravity) == pytest.approx(9.81)
    assert steep.opt.gravity[0] < 0.0 == plain.opt.gravity[0]
    # The ground, six soles, and something to see of each of nineteen bodies.
    assert plain.ngeom == 1 + 6 + 19
    assert [plain.actuator(k).name for k in range(2)] == [
        f"{joint}_voltage" for joint in load_robot(DEFAULT).joint_names[:2]
    ]


def test_what_is_fixed_to_a_link_is_part_of_its_body() -> None:
    robot = load_robot("szabadka2")
    camera = """
      <joint name="neck" type="fixed"><parent link="body"/><child link="camera"/>
        <origin xyz="0.1 0 0.05" rpy="0 0 1.5707963267948966"/></joint>
      <link name="camera"><inertial><mass value="0.5"/>
        <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
    </robot>"""
    files = ROOT / "sim/robot/szabadka2/robot.toml"
    urdf = robot.urdf.text.replace("</robot>", camera)
    with_camera = load_robot(RobotFiles(toml=files.read_text(encoding="utf-8"), urdf=urdf))
    m = mujoco.MjModel.from_xml_string(exported(with_camera, SCENARIOS[0]))
    assert m.body_mass.sum() == pytest.approx(robot.mass + 0.5, rel=1e-12)
    body = with_camera.body
    np.testing.assert_allclose(m.body("body").ipos, body.centre, atol=1e-12)


def test_the_command_writes_a_model(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    result = run_command("mjcf", "--robot", "szabadka2", "--scenario", "slope-fast", "-o", file)
    assert result.code == 0, result.err
    m = mujoco.MjModel.from_xml_path(str(file))
    assert (m.nu, m.nkey, m.npair) == (18, 1, 6)
    shown = run_command("mjcf", "--robot", "szabadka2", "--scenario", "slope-fast")
    assert shown.out.strip() == file.read_text(encoding="utf-8").strip()
    falling = run_command("mjcf", "--no-contacts")
    assert mujoco.MjModel.from_xml_string(falling.out).npair == 0


def test_a_robot_of_ones_own_begins_the_first_walk_of_its_folder(tmp_path: Path) -> None:
    folder = robot_folder(tmp_path / "dog")
    result = run_command("mjcf", "--robot", folder)
    assert result.code == 0, result.err
    assert result.out == run_command("mjcf", "--robot", folder, "--scenario", "slow").out
    assert result.out != run_command("mjcf", "--robot", folder, "--scenario", "fast").out


@pytest.mark.parametrize("changes", [{"radius": 0.5}, {"hip_height": 0.05, "height": 0.2}])
def test_a_pose_that_the_legs_do_not_reach_is_refused(
    tmp_path: Path, changes: dict[str, float]
) -> None:
    folder = robot_folder(tmp_path / "dog", scenarios=[SLOW | changes])
    result = run_command("mjcf", "--robot", folder, "-o", tmp_path / "dog.xml")
    assert result.code == 2
    assert "scenario 'slow': " in result.err and "; reduce stride" in result.err
    assert not (tmp_path / "dog.xml").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--scenario", "1,2"), "scenario: must name one scenario"),
        (("--scenario", "moon"), "unknown scenario 'moon'"),
        (("--robot", "moon"), "robot: unknown robot 'moon'"),
        (("-o", "/nowhere/robot.xml"), "output: cannot write /nowhere/robot.xml"),
    ],
)
def test_bad_input_names_the_option(options: tuple[str, ...], words: str) -> None:
    result = run_command("mjcf", *options)
    assert (result.code, words in result.err) == (2, True), result.err


def test_the_ground_of_the_scenario_is_a_height_field_below_the_soles() -> None:
    terrain = Rough(kind="rough", amplitude=0.02)
    m = opened(SCENARIOS[0].model_copy(update={"terrain": terrain}))
    d, normal, grid = mujoco.MjData(m), np.empty(3), height_grid(terrain)
    mujoco.mj_resetDataKeyframe(m, d, m.key("start").id)
    mujoco.mj_forward(m, d)
    assert grid is not None
    for place in np.array([[0.0, 0.0], [0.31, -0.2], [-0.4, 0.35]]):
        above = np.append(place, 1.0)
        fall = mujoco.mj_rayHfield(
            m, d, m.geom("ground").id, above, np.array([0.0, 0.0, -1.0]), normal
        )
        assert 1.0 - fall == pytest.approx(float(grid.height(*place)), abs=5e-3)
    assert d.ncon >= 3
