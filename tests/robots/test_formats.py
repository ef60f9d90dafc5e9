"""Robots in xacro and MJCF: what a URDF of them has, and what an untrusted text may not do."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.cli.main import run
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal import formats
from gaitswarm.sim.proposal.document import propose_robot, walking_proposal
from gaitswarm.sim.proposal.formats import as_urdf, expanded, format_of
from gaitswarm.sim.robot.description import ActuatorKind
from gaitswarm.sim.robot.robot import parse_robot
from gaitswarm.sim.robot.urdf import parse_urdf
from tests.robots.test_proposal import INERTIAL, dog

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
LEG = f"""
<robot {XACRO}>
  <xacro:macro name="leg" params="name x y">
    <xacro:part name="${{name}}_hip" parent="trunk" axis="1 0 0"
      xyz="${{0.2 * x}} ${{0.05 * y}} 0" low="-0.8" high="0.8"/>
    <xacro:part name="${{name}}_thigh" parent="${{name}}_hip" axis="0 1 0"
      xyz="0 ${{0.08 * y}} 0" low="-1.0" high="3.5"/>
    <xacro:part name="${{name}}_calf" parent="${{name}}_thigh" axis="0 1 0"
      xyz="0 0 -$(arg shank)" low="-2.7" high="-0.8"/>
  </xacro:macro>
  <xacro:macro name="part" params="name parent axis xyz low high">
    <joint name="${{name}}_joint" type="revolute"><parent link="${{parent}}"/>
      <child link="${{name}}"/><origin xyz="${{xyz}}"/><axis xyz="${{axis}}"/>
      <limit lower="${{low}}" upper="${{high}}" effort="30" velocity="20"/></joint>
    <link name="${{name}}">{INERTIAL}
      <xacro:if value="${{name[3:] == 'calf'}}"><collision><origin xyz="0 0 -0.2"/><geometry>
        <sphere radius="${{math.sqrt(0.0004)}}"/></geometry></collision></xacro:if></link>
  </xacro:macro>
</robot>"""
INCLUDE = '<xacro:include filename="$(find dog_parts)/urdf/leg.xacro"/>'
DOG = f"""
<robot name="dog" {XACRO}>
  <xacro:arg name="shank" default="0.2"/>
  {INCLUDE}
  <link name="trunk">{INERTIAL.replace("0.3", "8")}</link>
  <xacro:leg name="FL" x="1" y="1"/> <xacro:leg name="FR" x="1" y="-1"/>
  <xacro:leg name="RL" x="-1" y="1"/> <xacro:leg name="RR" x="-1" y="-1"/>
</robot>"""
ALONE = DOG.replace(INCLUDE, "".join(LEG.strip().splitlines(keepends=True)[1:-1]))


def leg(name: str, x: int, y: int) -> str:
    """Two joints of the hip in one body, all joints away from their bodies' origins."""
    return f"""
  <body name="{name}_thigh" pos="{0.2 * x} {0.05 * y} 0.01" euler="0 0 10">
    <inertial pos="0 0 -0.1" mass="1" diaginertia="0.01 0.01 0.001" euler="0 20 0"/>
    <joint name="{name}_roll" axis="1 0 0" pos="0.03 0.02 0.02" range="-45 45"/>
    <joint name="{name}_pitch" axis="0 1 0" pos="0 {0.08 * y} 0" range="-60 200" ref="5"/>
    <geom class="looks" mesh="lost"/>
    <body name="{name}_calf" pos="0 {0.08 * y} -0.22">
      <inertial pos="0 0 -0.1" mass="0.2" diaginertia="0.001 0.001 0.0001"/>
      <joint name="{name}_knee" axis="0 1 0" pos="0 0 0.02" range="-155 -45"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.1" size="0.01" mass="0"/>
      <geom type="sphere" pos="0 0 -0.18" size="0.02"/>
    </body>
  </body>"""


LEGS = {"FL": (1, 1), "FR": (1, -1), "RL": (-1, 1), "RR": (-1, -1)}
MJCF = f"""
<mujoco model="cat">
  <compiler angle="degree" autolimits="true" meshdir="parts"/>
  <default>
    <default class="looks"><geom type="mesh" contype="0" conaffinity="0"/></default>
  </default>
  <asset><mesh name="lost" file="lost.stl"/>
    <texture name="t" type="2d" file="lost.png"/><material name="m" texture="t"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1" material="m"/>
    <body name="trunk" pos="0 0 0.4"><freejoint/>
      <geom type="box" size="0.2 0.1 0.05" mass="8"/>
      {"".join(leg(name, *at) for name, at in LEGS.items())}
    </body>
  </worldbody>
  <actuator>
    {"".join(f'<position joint="{name}_roll" kp="50" forcerange="-20 20"/>' for name in LEGS)}
    {"".join(f'<motor joint="{name}_pitch" gear="3" ctrlrange="-9 9"/>' for name in LEGS)}
    {"".join(f'<general joint="{name}_knee"/>' for name in LEGS)}
  </actuator>
</mujoco>"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """The folder of a package with a xacro file of a leg."""
    folder = tmp_path / "elsewhere" / "parts"
    (folder / "urdf").mkdir(parents=True)
    (folder / "urdf" / "leg.xacro").write_text(LEG, encoding="utf-8")
    return folder


def test_formats_are_told_apart_by_their_elements() -> None:
    assert format_of(DOG) == "xacro"
    assert format_of(MJCF) == "mjcf"
    assert format_of(dog()) == "urdf"
    written_by_xacro = dog().replace('<robot name="dog">', f'<robot name="dog" {XACRO}>')
    assert format_of(written_by_xacro) == format_of("<robot") == format_of("") == "urdf"


def test_a_xacro_file_becomes_the_robot_of_its_urdf(
    package: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, made = tmp_path / "dog.xacro", tmp_path / "made"
    file.write_text(DOG, encoding="utf-8")
    assert run(["robot", "init", str(file), "-o", str(made)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "give its folder: `--package dog_parts=FOLDER`" in said and "dog.xacro" in said
    options = ["--package", f"dog_parts={package}", "--json"]
    assert run(["robot", "init", str(file), "-o", str(made), *options]) == 0
    capsys.readouterr()
    expected = walking_proposal(dog(), "dog")
    assert (made / "robot.toml").read_text(encoding="utf-8") == expected.toml
    assert json.loads((made / "job.json").read_text(encoding="utf-8")) == expected.job
    longer = tmp_path / "longer"
    assert run(["robot", "init", str(file), "-o", str(longer), *options, "--arg", "shank=0.3"]) == 0
    robot = parse_robot(*((longer / f"robot.{kind}").read_text() for kind in ("toml", "urdf")))
    assert robot.legs[0].lengths[1] == pytest.approx(0.3)


def test_a_missing_argument_is_named_with_the_remedy() -> None:
    with pytest.raises(RobotFileError, match=r"argument shank; give its value \(`--arg NAME=VAL"):
        expanded(ALONE.replace('<xacro:arg name="shank" default="0.2"/>', ""))


@pytest.mark.parametrize(("text", "extra"), [(DOG, "xacro"), (MJCF, "mujoco")])
def test_an_extra_that_is_not_installed_is_named(
    text: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(formats, "find_spec", lambda _: None)
    with pytest.raises(RobotFileError, match=rf"pip install 'gaitswarm\[{extra}\]'"):
        as_urdf(text)


def test_an_untrusted_xacro_text_computes() -> None:
    urdf, left_out = as_urdf(ALONE)
    assert (propose_robot(urdf, "dog").toml, left_out) == (propose_robot(dog(), "dog").toml, [])


@pytest.mark.parametrize(
    "text",
    [
        "<xacro:include filename='/etc/hostname'/>",
        "<a b='$(find dog_parts)'/>",
        "<a b='$(env HOME)'/>",
        "<a b='$(eval 1 + 1)'/>",
        "<a b='${xacro.load_yaml(\"/etc/hostname\")}'/>",
        "<a b='${load_yaml(\"/etc/hostname\")}'/>",
        "<a b='${\"%s\".format(list)}'/>",
        "<a b='${list.__class__}'/>",
        "<a b='${python.type(1)}'/>",
        "<a b='${python.vars()}'/>",
        "<a b='${[x for x in [1]]}'/>",
        "<a b='${(lambda: 1)()}'/>",
        "<xacro:property name='p' value='${python.vars()}'/><a b='${p}'/>",
        "<xacro:property name='p' value='${python.vars()}' lazy_eval='false'/><a b='${p}'/>",
    ],
)
def test_an_untrusted_xacro_text_reaches_no_files_and_no_objects(text: str) -> None:
    with pytest.raises(RobotFileError, match=r"needs other files|does more than compute"):
        as_urdf(f"<robot name='r' {XACRO}><xacro:property name='n' value='1'/>{text}</robot>")


def test_mjcf_becomes_a_urdf_with_the_same_motion() -> None:
    urdf, left_out = as_urdf(MJCF)
    assert left_out[0] == "meshes that are not at hand: lost"
    model = mujoco.MjModel.from_xml_string(
        MJCF.replace('<geom class="looks" mesh="lost"/>', "")
        .replace('<mesh name="lost" file="lost.stl"/>', "")
        .replace(
            '<texture name="t" type="2d" file="lost.png"/><material name="m" texture="t"/>', ""
        )
        .replace('material="m"', "")
    )
    data, ours = mujoco.MjData(model), pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    assert parse_urdf(urdf).total_mass == pytest.approx(float(model.body_mass.sum()))
    names = [model.joint(k).name for k in range(1, model.njnt)]
    rng = np.random.default_rng(1)
    for _ in range(3):
        angles = rng.uniform(-1.0, 1.0, len(names))
        data.qpos[:] = [0, 0, 0, 1, 0, 0, 0, *(angles + model.qpos0[7:])]
        q = pin.neutral(ours)
        columns = [ours.joints[ours.getJointId(name)].idx_v for name in names]
        for column, angle in zip(columns, angles, strict=True):
            q[column + 1] = angle
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        ours_data = ours.createData()
        mass = pin.crba(ours, ours_data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        np.testing.assert_allclose(mass[np.ix_(columns, columns)], full[6:, 6:], atol=1e-8)
        pin.forwardKinematics(ours, ours_data, q)
        places = [ours_data.oMi[ours.getJointId(name)].translation for name in names]
        np.testing.assert_allclose(places, data.xanchor[1:], atol=1e-8)


def test_mjcf_gives_limits_torques_and_feet() -> None:
    urdf, _ = as_urdf(MJCF)
    joints = {joint.name: joint for joint in parse_urdf(urdf).joints}
    np.testing.assert_allclose(np.degrees(joints["FL_roll"].limits), [-45, 45], atol=1e-5)
    # From its reference on.
    np.testing.assert_allclose(np.degrees(joints["FL_pitch"].limits), [-65, 195], atol=1e-5)
    efforts = [joints[f"FL_{name}"].effort for name in ("roll", "pitch", "knee")]
    assert efforts == pytest.approx([20.0, 27.0, 0.0])
    assert [joints[f"FL_{name}"].velocity for name in ("roll", "pitch", "knee")] == [20, 20, 0]
    made = walking_proposal(urdf, "cat")
    robot = parse_robot(made.toml, made.urdf)
    assert robot.description.contact.sole == pytest.approx(0.02)
    assert [leg.name for leg in robot.description.legs] == list(LEGS)


def with_dynamics(roll: str, pitch: str, actuators: str) -> str:
    """The robot with attributes of the joints at its hips, and of their actuators."""
    return (
        MJCF.replace('range="-45 45"', f'range="-45 45" {roll}')
        .replace('ref="5"', f'ref="5" {pitch}')
        .replace("<position", f"<position {actuators}")
        .replace("<motor", f"<motor {actuators}")
    )


@pytest.mark.parametrize("kind", ["torque", "dc"])
def test_rotors_and_friction_of_mjcf_are_those_of_the_actuators(kind: ActuatorKind) -> None:
    joint = 'armature="0.01" frictionloss="0.3"'
    urdf, notes = as_urdf(with_dynamics(f'{joint} damping="2"', f'{joint} damping="0.1"', ""))
    # The damping of a joint with a position loop is the loop's.
    assert any("50 N m/rad and 2 N m s/rad" in note for note in notes)
    made = walking_proposal(urdf, "cat", kind)
    assert any("rotor inertia and friction from the MJCF" in note for note in made.guesses)
    actuators = parse_robot(made.toml, made.urdf).actuators()
    np.testing.assert_allclose(actuators.armature.reshape(4, 3)[:, :2], 0.01, rtol=1e-5)
    np.testing.assert_allclose(actuators.motor_friction.reshape(4, 3), [[0, 0.1, 0]] * 4, rtol=1e-5)
    np.testing.assert_allclose(actuators.coulomb_friction.reshape(4, 3), [[0.3, 0.3, 0]] * 4)


def test_rotors_of_actuators_count_through_their_gear() -> None:
    text = with_dynamics("", 'armature="0.01" damping="0.1"', 'armature="0.002" damping="0.03"')
    joints = {joint.name: joint for joint in parse_urdf(as_urdf(text)[0]).joints}
    assert joints["FL_roll"].dynamics == pytest.approx((0.002, 0.03, 0.0))
    assert joints["FL_pitch"].dynamics == pytest.approx((0.01 + 9 * 0.002, 0.1 + 9 * 0.03, 0.0))
    assert joints["FL_knee"].dynamics is None


def test_friction_that_would_hold_a_joint_is_left_out() -> None:
    urdf, _ = as_urdf(with_dynamics("", 'frictionloss="1" damping="5"', ""))
    made = walking_proposal(urdf, "cat", "torque")
    assert any("1 N m and 5 N m s/rad are too large" in note for note in made.guesses)
    actuators = parse_robot(made.toml, made.urdf).actuators()
    assert not (actuators.motor_friction.any() or actuators.coulomb_friction.any())


@pytest.mark.parametrize(
    ("mjcf", "said"),
    [
        (MJCF.replace("<worldbody>", '<include file="/etc/hostname"/><worldbody>'), "other files"),
        (MJCF.replace('pos="0 0 0.02" range="-155 -45"', 'type="ball"'), "is a ball or free"),
        (MJCF.replace('axis="1 0 0"', 'axis="1 0"'), "MuJoCo cannot compile it: .*axis"),
        ("<mujoco/>", "no <body>"),
    ],
    ids=["include", "ball", "broken", "empty"],
)
def test_mjcf_that_cannot_be_used_is_refused_with_the_reason(mjcf: str, said: str) -> None:
    with pytest.raises(RobotFileError, match=said):
        as_urdf(mjcf)


def test_meshes_of_mjcf_are_copied_and_shown_where_they_were(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "parts").mkdir()
    corners = [(x, y, z) for x in (0.0, 0.2) for y in (0.0, 0.04) for z in (0.0, -0.1)]
    faces = (
        "f 1 2 4\nf 1 4 3\nf 5 8 6\nf 5 7 8\nf 1 5 6\nf 1 6 2\nf 3 4 8\nf 3 8 7\nf 1 3 7\nf 1 7 5"
    )
    box = "\n".join([*(f"v {x} {y} {z}" for x, y, z in corners), faces, "f 2 6 8\nf 2 8 4", ""])
    (tmp_path / "parts" / "lost.obj").write_text(box, encoding="utf-8")
    placed = MJCF.replace('mesh="lost"', 'mesh="lost" pos="0.01 0.02 0.03" euler="0 0 30"')
    file = tmp_path / "cat.xml"
    file.write_text(placed.replace("lost.stl", "lost.obj"), encoding="utf-8")
    assert run(["robot", "init", str(file), "-o", str(tmp_path / "cat"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["meshes"]["copied"] == ["parts/lost.obj"]
    link = parse_urdf((tmp_path / "cat" / "robot.urdf").read_text()).links["FL_thigh"].element
    origin = link.find("visual/origin")
    assert origin is not None
    at, turn = (np.array([float(n) for n in origin.get(a, "").split()]) for a in ("xyz", "rpy"))
    # The link's frame is at its last joint, 0.08 m to the left.
    np.testing.assert_allclose(at, [0.01, 0.02 - 0.08, 0.03], atol=1e-7)
    np.testing.assert_allclose(turn, [0, 0, np.radians(30)], atol=1e-6)


def test_placeholder_masses_are_replaced_by_a_guess_or_by_the_given_mass(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "dog.urdf"
    bare = dog().replace('value="0.3"', 'value="1e-5"').replace('value="8"', 'value="1e-5"')
    file.write_text(bare.replace('"1e-3"', '"1.0"').replace('"1e-4"', '"1.0"'), encoding="utf-8")
    masses = []
    for number, options in enumerate(([], ["--mass", "12"])):
        made = tmp_path / f"made{number}"
        assert run(["robot", "init", str(file), "-o", str(made), "--json", *options]) == 0
        guesses = json.loads(capsys.readouterr().out)["guesses"]
        assert any("its masses are placeholders, 0.00013 kg" in guess for guess in guesses)
        assert any("'trunk' and 12 others would need a body larger" in guess for guess in guesses)
        assert not any("cannot have the principal moments" in guess for guess in guesses)
        tree = parse_urdf((made / "robot.urdf").read_text())
        masses.append(tree.total_mass)
        assert tree.body.mass == pytest.approx(0.5 * masses[-1])
    assert masses == pytest.approx([17.0, 12.0], rel=0.01)
