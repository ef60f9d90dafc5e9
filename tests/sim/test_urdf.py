"""Reading URDFs: inertias as Pinocchio's, the tree of links, and errors."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import parse_urdf
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate
from tests.sim.pinocchio_oracle import ROBOTS, robot_named

CAMERA = """
  <link name="mast"/>
  <joint name="weld" type="fixed">
    <parent link="body"/><child link="mast"/><origin xyz="0.1 0 0.2" rpy="0.1 -0.4 0.2"/>
  </joint>
  <link name="camera">
    <inertial>
      <origin xyz="0.01 0.02 0.03" rpy="0.3 0.2 -0.5"/>
      <mass value="0.3"/>
      <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0.001" iyz="0.0002" ixz="-0.0003"/>
    </inertial>
  </link>
  <joint name="a_screw" type="fixed">
    <parent link="mast"/><child link="camera"/><origin xyz="0 -0.05 0.1" rpy="1 -0.4 0.2"/>
  </joint>
</robot>"""


def with_camera(robot: Robot) -> str:
    return robot.urdf.text.replace("</robot>", CAMERA)


def model_of(urdf: str) -> pin.Model:
    return pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())


@pytest.mark.parametrize("name", ["szabadka2", "quadruped"])
def test_body_and_mass_are_pinocchios_to_the_last_bit(name: str) -> None:
    robot = robot_named(name)
    model = model_of(robot.urdf.text)
    body = model.inertias[1]
    assert (robot.body.mass, robot.mass) == (body.mass, pin.computeTotalMass(model))
    np.testing.assert_array_equal(robot.body.centre, body.lever)
    np.testing.assert_array_equal(robot.body.rotational, body.inertia)


@pytest.mark.parametrize("name", ROBOTS)
def test_links_that_are_fixed_to_one_another_are_one_body_as_in_pinocchio(name: str) -> None:
    urdf = parse_urdf(with_camera(robot_named(name)))
    model = model_of(urdf.text)
    assert urdf.total_mass == pytest.approx(pin.computeTotalMass(model), rel=1e-15)
    for body, theirs in zip(urdf.bodies.values(), list(model.inertias)[1:], strict=True):
        assert body.mass == pytest.approx(theirs.mass, rel=1e-15)
        np.testing.assert_allclose(body.centre, theirs.lever, rtol=0, atol=1e-15)
        np.testing.assert_allclose(body.rotational, theirs.inertia, rtol=0, atol=1e-15)


def test_a_mass_of_its_own_scales_the_body_and_leaves_its_shape() -> None:
    robot = robot_named("quadruped")
    description = robot.description.model_copy(update={"body_mass": 4.8})
    heavy = Robot(description, robot.urdf, robot.legs)
    assert heavy.body.mass == 2.0 * robot.body.mass
    assert heavy.mass == pytest.approx(robot.mass + 2.4)
    np.testing.assert_array_equal(heavy.body.rotational, 2.0 * robot.body.rotational)


def test_links_come_parents_before_their_children() -> None:
    text = load_robot(RobotVariant()).urdf.text
    shuffled = parse_urdf("<robot>" + CAMERA.replace("</robot>", text[text.index("<link") :]))
    names = list(shuffled.links)
    assert names[0] == "body"
    assert all(names.index(j.parent) < names.index(j.child) for j in shuffled.joints)


BALL = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)
A, B, C = (f'<link name="{name}"/>' for name in "abc")
TENSOR = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'


def joint(name: str, parent: str, child: str, inside: str = "") -> str:
    return f'<joint name="{name}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def inertial(inside: str) -> str:
    return f'<link name="a"><inertial>{inside}</inertial></link>'


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ("", "it has no <link>"),
        (A + B, "found: 'a', 'b'"),
        (A + A, "link 'a' is defined twice; rename one"),
        (A + joint("j", "a", "b"), "joint 'j' refers to a missing link 'b'"),
        (
            A + B + C + joint("j", "b", "c") + joint("k", "c", "b"),
            "link 'b' is not attached to the body",
        ),
        (
            A + B + joint("j", "a", "b") + joint("k", "a", "b"),
            "joint 'k' carries link 'b', which another joint already carries",
        ),
        (
            A + B + C + joint("j", "a", "b") + joint("j", "b", "c"),
            "joint 'j' is defined twice; rename one",
        ),
        (
            A + B + joint("j", "a", "b", '<origin rpy="0 90 0"/>'),
            "joint 'j': rpy='0 90 0' of <origin> seems to be in degrees",
        ),
        (
            A + B + joint("j", "a", "b").replace("<joint", '<joint type="revolute"'),
            "joint 'j' has no <limit> with effort and velocity",
        ),
        (inertial('<mass value="1"/>'), "link 'a': its <inertial> needs a <mass> and an <inertia>"),
        (
            inertial(f'<mass value="heavy"/>{TENSOR}'),
            "link 'a': value='heavy' of <mass> is not a number",
        ),
        (
            inertial('<mass value="1"/>' + TENSOR.replace('izz="1" ', "")),
            "link 'a': izz='' of <inertia> is not a number",
        ),
        (
            A + B + joint("j", "a", "b", '<origin xyz="0 nan 0"/>'),
            "joint 'j': xyz='0 nan 0' of <origin> is not three numbers",
        ),
        (
            A + B + joint("j", "a", "b", '<axis xyz="0 0 0"/>'),
            "joint 'j': its axis must not be zero",
        ),
        (
            A + B + joint("j", "a", "b", '<axis xyz="0 1"/>'),
            "joint 'j': xyz='0 1' of <axis> is not three numbers",
        ),
    ],
)
def test_what_cannot_be_read_is_named(robot: str, said: str) -> None:
    with pytest.raises(RobotFileError, match=r"^robot\.urdf(, line 1)?: ") as refused:
        parse_urdf(f"<robot>{robot}</robot>")
    assert said in str(refused.value)


def test_an_axis_is_made_a_unit_vector_and_a_fixed_joint_needs_none() -> None:
    hinge = joint("j", "a", "b", '<axis xyz="0 3 -4"/>')
    weld = joint("k", "b", "c", '<axis xyz="0 0 0"/>').replace("<joint", '<joint type="fixed"')
    trunk = A.replace("/>", ">" + BALL + "</link>")
    found = parse_urdf(f"<robot>{trunk + B + C + hinge + weld}</robot>").joints[0].axis
    np.testing.assert_allclose(found, [0.0, 0.6, -0.8], rtol=1e-15)
    plain = parse_urdf(f"<robot>{trunk + B + joint('j', 'a', 'b')}</robot>").joints[0].axis
    np.testing.assert_array_equal(plain, [1.0, 0.0, 0.0])


def test_what_is_no_xml_is_reported_by_line_and_column() -> None:
    with pytest.raises(RobotFileError, match=r"robot\.urdf, line 2: .*: mismatched tag \(column 2"):
        parse_urdf("<robot><link>\n</robot>")


@pytest.mark.parametrize(
    "entities",
    [
        '<!ENTITY secret SYSTEM "file:///etc/hostname">',
        "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10)),
        "",
    ],
)
def test_a_document_type_is_refused_and_with_it_every_entity(entities: str) -> None:
    document = f"<!DOCTYPE robot [{entities}]><robot><link name='a'/>&secret;&e9;</robot>"
    with pytest.raises(RobotFileError, match="line 1: declares a document type"):
        parse_urdf(document)


def test_a_camera_on_its_body_weighs_the_robot_down() -> None:
    robot = robot_named("quadruped")
    laden = Robot(robot.description, parse_urdf(with_camera(robot)), robot.legs)
    assert laden.mass == pytest.approx(robot.mass + 0.3)
    still = SCENARIOS[0].model_copy(update={"stride": 0.001, "height": 0.0, "cycles": 1.0})
    design = np.array([[0.45, 0.1]])
    heights = [
        float(log.base_position[0, 2])
        for who in (robot, laden)
        for log in simulate(still, "pi", ("P", "I"), design, robot=who, log=True).logs
        if log is not None
    ]
    assert heights[1] < heights[0]
