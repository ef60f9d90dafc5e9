"""Limbs as Pinocchio reads the URDF, and as data of a kernel shared by robots."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib import resources

import casadi as ca
import numpy as np
import pytest

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.kernel.dynamics.kinds import robot_constants
from gaitswarm.sim.kernel.dynamics.physics_step import Traced, physics_model
from gaitswarm.sim.kernel.dynamics.spatial import Scalar, leaves
from gaitswarm.sim.kernel.emitted.source import kernel_identity, kernel_source
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import SHIPPED, RobotFiles, load_robot
from gaitswarm.sim.robot.legs import Placement
from gaitswarm.sim.robot.limbs import limb_of, limbs_of
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.robot.urdf import BodyInertia, parse_urdf
from tests.examples.paths import QUADRUPED
from tests.examples.walks import short_walk, walk
from tests.sim.pinocchio_oracle import Oracle, robot_named

Pair = tuple[Scalar, Scalar]

BRIEF = short_walk(cycle_time=0.25)


def mounted_quadruped() -> Robot:
    """The quadruped whose femurs hang on turned brackets that are fixed to the coxas."""
    robot = robot_named("turned quadruped")
    text = re.sub(r'parent link="(\w+)_coxa_link"', r'parent link="\1_bracket"', robot.urdf.text)
    brackets = "".join(BRACKET.format(leg.name) for leg in robot.description.legs)
    return replace(robot, urdf=parse_urdf(text.replace("</robot>", f"{brackets}</robot>")))


BRACKET = """
  <link name="{0}_bracket"/>
  <joint name="{0}_weld" type="fixed">
    <parent link="{0}_coxa_link"/><child link="{0}_bracket"/>
    <origin xyz="0.01 0.02 -0.03" rpy="-0.3 0.2 0.5"/>
  </joint>"""


@pytest.mark.parametrize("name", [*SHIPPED, "quadruped", "turned quadruped", "on brackets"])
def test_limbs_are_as_pinocchio_reads_the_urdf(name: str) -> None:
    if name == "on brackets":
        robot = mounted_quadruped()
    else:
        robot = load_robot(name) if name in SHIPPED else robot_named(name)
    model = Oracle(robot).model
    for number, limb in enumerate(limbs_of(robot)):
        leg, placements = robot.description.legs[number], []
        for joint in leg.joints:
            index = model.getJointId(joint)
            before, inertia = model.jointPlacements[index], model.inertias[index]
            placements.append(
                Placement(
                    # Rates of a joint's subspace, linear first.
                    np.asarray(model.joints[index].createData().S).ravel()[3:],
                    np.asarray(before.rotation),
                    np.asarray(before.translation),
                    BodyInertia(
                        float(inertia.mass), np.asarray(inertia.lever), np.asarray(inertia.inertia)
                    ),
                )
            )
        foot = model.frames[model.getFrameId(leg.foot)].placement.translation
        theirs = limb_of(robot, number, placements, np.asarray(foot))
        np.testing.assert_allclose(list(leaves(limb)), list(leaves(theirs)), rtol=1e-12, atol=1e-12)


def files_of(folder: str) -> RobotFiles:
    kept = resources.files("gaitswarm.sim.robot") / folder
    toml, urdf = ((kept / f"robot.{kind}").read_text(encoding="utf-8") for kind in ("toml", "urdf"))
    return RobotFiles(toml=toml, urdf=urdf)


def heavier_and_longer() -> Robot:
    """Szabad(ka)-II with other motors, and lengths and masses that differ from limb to limb."""
    files, rng = files_of("szabadka2"), np.random.default_rng(4)

    def scaled(match: re.Match[str]) -> str:
        factor = float(rng.uniform(1.02, 1.15))
        return " ".join(
            [f'{match[1]}="{" ".join(repr(factor * float(part)) for part in match[2].split())}"']
        )

    urdf = re.sub(r'(value|xyz)="(0\.[12][0-9]+|0 -?0\.[01][0-9]* 0)"', scaled, files.urdf)
    toml = files.toml.replace("resistance = 4.09", "resistance = 4.6")
    toml = toml.replace("torque_constant = 0.0134", "torque_constant = 0.015")
    return load_robot(RobotFiles(toml=toml, urdf=urdf))


@pytest.mark.slow
def test_robots_with_limbs_of_one_kind_share_a_library_and_walk_by_their_own_constants() -> None:
    robot, other = load_robot("szabadka2"), heavier_and_longer()
    assert len({limb.mobility for limb in limbs_of(other)}) == len(other.legs)
    assert kernel_identity(other) == kernel_identity(robot)
    assert kernel_source(other) == kernel_source(robot)
    assert len(robot_constants(other)) == len(robot_constants(robot))
    assert (robot_constants(other) != robot_constants(robot)).mean() > 0.5
    assert native_kernel(other) is not native_kernel(robot)
    assert physics_model(other) is not physics_model(robot)
    first, fast = (walk(BRIEF, robot=machine).outcome for machine in (robot, other))
    slow = walk(BRIEF, robot=other, backend="reference").outcome
    assert fast.statuses.tolist() == [Status.OK]
    np.testing.assert_allclose(fast.objectives, slow.objectives, rtol=1e-9)
    assert (np.abs(fast.objectives / first.objectives - 1.0)[0, :5] > 1e-3).all()


def test_comments_blanks_and_names_in_a_robots_files_make_no_other_kernel() -> None:
    toml, urdf = ((QUADRUPED / f"robot.{kind}").read_text() for kind in ("toml", "urdf"))
    robot = parse_robot(toml, urdf)
    rewritten = parse_robot(
        "# Rewritten.\n" + toml.replace("left_", "port_").replace(" = ", "="),
        urdf.replace("left_", "port_").replace("<link", "<!-- A link. -->\n\n   <link"),
    )
    assert kernel_identity(rewritten) == kernel_identity(robot)
    assert rewritten.joint_names != robot.joint_names


def test_limbs_about_other_axes_are_of_another_kind() -> None:
    robot = load_robot("szabadka2")
    tilted = robot.urdf.text.replace('<axis xyz="-1 0 0"/>', '<axis xyz="-1 0.1 0"/>')
    assert kernel_identity(replace(robot, urdf=parse_urdf(tilted))) != kernel_identity(robot)


PAN = """
  <link name="camera"/>
  <joint name="pan" type="continuous">
    <parent link="body"/><child link="camera"/><axis xyz="0 0 1"/>
  </joint>
</robot>"""
FEMUR = '<joint name="right_front_femur" type="revolute">\n    <parent link="'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("</robot>", PAN, "these movable joints belong to no leg: 'pan'; list them under"),
        (
            '"right_front_coxa" type="revolute"',
            '"right_front_coxa" type="fixed"',
            "joint 'right_front_coxa' of leg 'right_front' is fixed, not revolute",
        ),
        (
            '"right_front_tibia" type="revolute"',
            '"right_front_tibia" type="prismatic"',
            "joint 'right_front_tibia' of leg 'right_front' is prismatic, not revolute",
        ),
        (
            FEMUR + "right_front_coxa_link",
            FEMUR + "body",
            "leg 'right_front': joint 'right_front_femur' comes before its parent",
        ),
        (
            '<parent link="right_front_tibia_link"/>\n    <child link="right_front_foot"/>',
            '<parent link="right_front_femur_link"/>\n    <child link="right_front_foot"/>',
            "leg 'right_front': its `foot` 'right_front_foot' is not on its last link",
        ),
    ],
    ids=["one more joint", "a joint less", "a slider", "no chain", "a foot on the femur"],
)
def test_legs_that_are_no_chains_of_hinges_to_their_feet_are_refused_by_name(
    old: str, new: str, said: str
) -> None:
    robot = load_robot("szabadka2")
    assert robot.urdf.text.count(old) == 1
    other = replace(robot, urdf=parse_urdf(robot.urdf.text.replace(old, new)))
    with pytest.raises(RobotFileError, match=rf"^robot\.(urdf|toml): {re.escape(said)}"):
        limbs_of(other)


def test_a_traced_function_comes_to_the_same_with_other_symbols_and_numbers() -> None:
    runs = []

    def lever(arm: Pair, force: Pair) -> tuple[Scalar, Pair]:
        runs.append(arm)
        return arm[0] * force[1] - arm[1] * force[0], (arm[0] / arm[1], 2.0)

    x, y, z = (ca.SX.sym(name) for name in "xyz")
    examples: tuple[Pair, Pair] = (x, y), (z, 3.0)
    traced = Traced(lever, *examples)
    for arm, force in (((y, z), (x, 3.0)), ((2.0, 4.0), (x, 3.0)), ((0.0, y), (0.0, 3.0))):
        moment, (ratio, two) = traced(arm, force)
        expected, (quotient, _) = lever(arm, force)
        wanted, found = (
            ca.Function("f", [x, y, z], [ca.vertcat(*values)])(0.3, 0.7, 1.1)
            for values in ((expected, quotient), (moment, ratio))
        )
        np.testing.assert_array_equal(found, wanted)
        assert two == 2.0
    # Nothing times nothing is left of a moment.
    assert traced((0.0, y), (0.0, 3.0))[0].is_zero()
    assert len(runs) == 4
