"""Legs with any names, frames and mounting: feet, joint angles, limits."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.errors import BeyondJointLimit, RobotFileError
from gaitswarm.sim.gait.inverse_kinematics import chain_angles, leg_angles
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.legs import turned as turned_about
from gaitswarm.sim.robot.robot import Robot, assembled, parse_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples.walks import quadruped_files, short_walk, walk

STANCE = "[0.0, 0.5, -1.2]"
LEVEL = Scenario(name="level", cycle_time=1.0, radius=0.2, hip_height=0.14, stride=0.04, fir_ms=0)
HEAD = """
  <joint name="neck" type="revolute">
    <parent link="body"/><child link="head"/><origin xyz="0.15 0 0.05" rpy="0.1 0 0.3"/>
    <axis xyz="0 1 0"/>{limit}
  </joint>
  <link name="head">
    <inertial><origin xyz="0.04 0 0"/><mass value="0.3"/>
      <inertia ixx="1e-4" iyy="2e-4" izz="3e-4" ixy="0" iyz="0" ixz="0"/></inertial>
  </link>
</robot>"""
NECK = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def with_stance(toml: str, stance: str = STANCE) -> str:
    """A robot.toml whose legs' gaits are planned by steps from a stance."""
    return re.sub(r"(\nactuators = \[\"coxa.*)", rf"\1\nstance = {stance}", toml)


def quadruped(
    toml: Callable[[str], str] = lambda text: text, urdf: Callable[[str], str] = lambda text: text
) -> Robot:
    files = quadruped_files()
    return parse_robot(toml(with_stance(files.toml)), urdf(files.urdf))


def turned(urdf: str) -> str:
    """Every frame turned in its parent's."""
    return urdf.replace("<origin xyz=", '<origin rpy="0.4 -0.7 0.9" xyz=')


def renamed(text: str) -> str:
    """Joints and feet with other names."""
    return re.sub(r"(right|left)_(front|rear)_(coxa|femur|tibia|foot)\b", r"\3 of \2 \1", text)


def named(toml: str) -> str:
    """The same names in robot.toml."""
    return re.sub(
        r'name = "(right|left)_(front|rear)"',
        r'name = "\2 \1"'
        r'\njoints = ["coxa of \2 \1", "femur of \2 \1", "tibia of \2 \1"]'
        r'\nfoot = "foot of \2 \1"',
        toml,
    )


def chain(robot: Robot, leg: int = 0) -> ChainLeg:
    found = robot.legs[leg]
    assert isinstance(found, ChainLeg)
    return found


def far(urdf: str) -> str:
    """Without limits that a turned frame's stance would have to keep."""
    return re.sub(r'lower="\S+" upper="\S+"', 'lower="-4" upper="4"', urdf)


@pytest.mark.parametrize("frames", [lambda text: text, turned], ids=["parallel", "turned"])
def test_a_foot_is_where_pinocchio_has_it(frames: Callable[[str], str]) -> None:
    robot = quadruped(urdf=lambda text: frames(far(text)))
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    data = model.createData()
    joints = [model.joints[model.getJointId(name)].idx_q for name in robot.joint_names]
    for angles in np.random.default_rng(1).uniform(-2.0, 2.0, (15, robot.n_joints)):
        q = pin.neutral(model)
        q[joints] = angles
        pin.framesForwardKinematics(model, data, q)
        for number, leg in enumerate(robot.description.legs):
            expected = data.oMf[model.getFrameId(leg.foot)].translation
            own = angles[3 * number : 3 * number + 3]
            found, slopes = chain(robot, number).feet(own[None])
            np.testing.assert_allclose(found[0], expected, atol=1e-14)
            nudged = [chain(robot, number).feet(own[None] + e)[0][0] for e in 1e-6 * np.eye(3)]
            np.testing.assert_allclose(slopes[0], (np.array(nudged) - found[0]).T / 1e-6, atol=1e-6)


def test_vectors_are_turned_to_the_bits_of_numpys_cross_product() -> None:
    draw = np.random.default_rng(1)
    axis = draw.normal(size=3)
    axis /= np.linalg.norm(axis)
    angles, vectors = draw.uniform(-np.pi, np.pi, 200), draw.normal(size=(200, 3))
    along = (vectors @ axis)[:, None] * axis
    expected = along + np.cos(angles)[:, None] * (vectors - along)
    expected += np.sin(angles)[:, None] * np.cross(axis, vectors)
    found = turned_about(vectors, axis, np.sin(angles), np.cos(angles))
    assert found.tobytes() == expected.tobytes()


def test_steps_from_a_stance_find_the_angles_of_the_closed_form() -> None:
    closed = load_robot("szabadka2")
    shipped = closed.description.model_dump(mode="json", by_alias=True)
    for leg in shipped["legs"]:
        leg["stance"] = (0.0, 0.5, -1.2)
    description = type(closed.description).model_validate(shipped)
    stepped = assembled(description, closed.urdf.text)
    for scenario in (SCENARIOS[0], SCENARIOS[5]):
        found, expected = desired_angles(stepped, scenario), desired_angles(closed, scenario)
        assert found.reachable
        np.testing.assert_allclose(found.angles, expected.angles, atol=2e-12)


def test_a_leg_of_turned_frames_puts_its_foot_on_the_path() -> None:
    robot = quadruped(
        lambda text: text.replace(STANCE, "[0.3, -0.4, 0.9]"), lambda text: turned(far(text))
    )
    leg = chain(robot)
    begin = np.array(leg.foot(leg.stance.tolist()))
    way = np.linspace(-1.0, 1.0, 41)[:, None]
    targets = begin + way * [0.03, 0.0, -0.02]
    angles, miss = chain_angles(leg, targets)
    assert not miss.any()
    np.testing.assert_allclose(leg.feet(angles)[0], targets, atol=1e-13)
    # One branch: angles pass through the stance and make no jump.
    np.testing.assert_allclose(angles[20], leg.stance, atol=1e-12)
    assert np.abs(np.diff(angles, axis=0)).max() < 0.1


def test_equal_targets_have_bit_identical_angles_anywhere_in_a_walk() -> None:
    leg = chain(quadruped())
    begin, way = np.array(leg.foot(leg.stance.tolist())), np.linspace(-1.0, 1.0, 9)[:, None]
    targets = begin + way * [0.03, 0.01, -0.02]
    angles, miss = chain_angles(leg, targets)
    order = np.array([3, 8, 3, 0, 1, 2, 2, 7, 6, 5, 4, 0])
    again, missed = chain_angles(leg, targets[order])
    np.testing.assert_array_equal(again, angles[order])
    np.testing.assert_array_equal(missed, miss[order])


def test_a_target_out_of_reach_is_missed_by_its_distance() -> None:
    leg = chain(quadruped())
    x, y, z = leg.hip
    coxa, femur, tibia = leg.lengths
    below = np.array([[x, y - coxa, z - 0.3], [x, y - coxa - femur - tibia - 0.02, z]])
    angles, miss = chain_angles(leg, below)
    assert miss.tolist() == np.linalg.norm(below - leg.ends(angles), axis=1).tolist()
    _, expected = leg_angles(
        leg.lengths, np.zeros(2), np.array([coxa, coxa + femur + tibia + 0.02]), below[:, 2] - z
    )
    np.testing.assert_allclose(miss, expected, rtol=1e-6)


def test_names_of_joints_and_feet_do_not_matter() -> None:
    files = quadruped_files()
    as_it_is = RobotFiles(toml=with_stance(files.toml), urdf=files.urdf)
    others = RobotFiles(toml=named(with_stance(files.toml)), urdf=renamed(files.urdf))
    assert "coxa of front right" in load_robot(others).joint_names
    gait = short_walk(cycle_time=0.5, radius=0.2, hip_height=0.14, stride=0.03)
    first, second = (walk(gait, robot=robot) for robot in (as_it_is, others))
    np.testing.assert_array_equal(first.outcome.objectives, second.outcome.objectives)


def test_a_gait_beyond_a_joints_limit_names_leg_joint_and_angle() -> None:
    robot = quadruped(urdf=lambda text: text.replace('upper="1.2"', 'upper="0.05"', 1))
    with pytest.raises(BeyondJointLimit) as caught:
        require_reachable(robot, LEVEL)
    angles = desired_angles(quadruped(), LEVEL).angles[:, 0]
    assert (caught.value.leg, caught.value.joint) == ("right_front", "right_front_coxa")
    assert caught.value.excess == pytest.approx(angles.max() - 0.05, abs=1e-9)
    assert "joint 'right_front_coxa' of leg 'right_front' would turn" in str(caught.value)
    assert not desired_angles(robot, LEVEL).reachable


def test_a_stance_beyond_a_limit_is_refused() -> None:
    with pytest.raises(RobotFileError, match=r"has joint 'right_front_tibia' at -3 rad.*-2\.8"):
        quadruped(lambda text: text.replace(STANCE, "[0.0, 0.5, -3.0]"))


def test_a_turned_leg_requires_a_stance() -> None:
    files = quadruped_files()
    with pytest.raises(RobotFileError, match=r"give leg 'right_front' of robot\.toml a stance"):
        parse_robot(files.toml, turned(files.urdf))


def test_a_held_joint_is_part_of_what_carries_it() -> None:
    angle = 0.7
    robot = quadruped(
        lambda text: f"{text}\n[held_joints]\nneck = {angle}\n",
        lambda text: text.replace("</robot>", HEAD.format(limit=NECK)),
    )
    free = quadruped_files().urdf.replace("</robot>", HEAD.format(limit=NECK))
    model = pin.buildModelFromXML(free, pin.JointModelFreeFlyer())
    q = pin.neutral(model)
    q[model.joints[model.getJointId("neck")].idx_q] = angle
    locked = pin.buildReducedModel(model, [model.getJointId("neck")], q)
    expected, body = locked.inertias[1], robot.body
    assert robot.n_joints == 12
    assert body.mass == pytest.approx(expected.mass, rel=1e-14)
    np.testing.assert_allclose(body.centre, expected.lever, atol=1e-15)
    np.testing.assert_allclose(body.rotational, expected.inertia, atol=1e-15)


@pytest.mark.parametrize(
    ("kind", "held", "said"),
    [
        ("revolute", "", r"belong to no leg: 'neck'; list them under \[held_joints\]"),
        ("revolute", "arm = 0.0", r"held_joints: robot\.urdf has no joint 'arm'"),
        ("prismatic", "neck = 0.1", r"'neck' is prismatic and does not turn; hold it at 0"),
    ],
)
def test_other_joints_are_held_or_refused(kind: str, held: str, said: str) -> None:
    head = HEAD.format(limit=NECK).replace("revolute", kind)
    with pytest.raises(RobotFileError, match=said):
        quadruped(
            lambda text: f"{text}\n[held_joints]\n{held}\n" if held else text,
            lambda text: text.replace("</robot>", head),
        )


def test_a_slider_is_held_at_rest() -> None:
    head = HEAD.format(limit=NECK).replace("revolute", "prismatic")
    robot = quadruped(
        lambda text: f"{text}\n[held_joints]\nneck = 0.0\n",
        lambda text: text.replace("</robot>", head),
    )
    assert robot.mass == pytest.approx(quadruped().mass + 0.3)


def test_a_continuous_joint_turns_without_limits() -> None:
    robot = quadruped(
        urdf=lambda text: text.replace('_tibia" type="revolute"', '_tibia" type="continuous"')
    )
    assert np.isfinite(chain(robot).limits[:2]).all()
    assert (np.abs(chain(robot).limits[2]) > 1e6).all()
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    assert model.nq == 7 + robot.n_joints


def test_limits_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(RobotFileError, match=r"'right_front_coxa'.*-1\.2 lies above the upper"):
        quadruped(
            urdf=lambda text: text.replace('lower="-1.2" upper="1.2"', 'lower="-1.2" upper="-2"', 1)
        )
