"""Legs that are not recognized because of a mistake are refused, not held like an arm."""

from __future__ import annotations

import math

import pytest

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.proposal.legs import find_legs
from gaitswarm.sim.robot.urdf import parse_urdf
from tests.robots.radial import radial_robot
from tests.robots.test_proposal import ARM, QUADRUPED, dog
from tests.robots.wrong_files import SOURCE

CALF = '<joint name="FL_calf_joint" type="revolute">'
ANKLE = (
    '<joint name="FL_ankle" type="revolute"><parent link="FL_calf"/><child link="FL_toe"/>'
    '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="5" velocity="5"/></joint>'
    '<link name="FL_toe"/></robot>'
)


def changed(urdf: str, old: str, new: str) -> str:
    assert old in urdf
    return urdf.replace(old, new, 1)


@pytest.mark.parametrize(
    ("urdf", "said"),
    [
        (
            changed(SOURCE, CALF, CALF.replace("revolute", "prismatic")),
            r"'FL_calf_joint' is prismatic, .* 'FR_calf_joint' is revolute: change it, or .* hand",
        ),
        (changed(SOURCE, CALF, CALF.replace("revolute", "fixed")), "'FL_calf_joint' is fixed"),
        (changed(SOURCE, "</robot>", ANKLE), "'FL_hip_joint' begins a chain .* more joints"),
        (
            changed(radial_robot(6), 'leg2_femur" type="revolute"', 'leg2_femur" type="planar"'),
            "'leg2_femur' is planar",
        ),
        (
            QUADRUPED.replace(
                '"left_rear_femur" type="revolute"', '"left_rear_femur" type="fixed"'
            ),
            "'left_rear_femur' is fixed",
        ),
    ],
    ids=["slides", "is fixed", "one joint more", "all round", "quadruped"],
)
def test_a_chain_that_is_built_as_the_legs_are_is_refused_by_its_odd_joint(
    urdf: str, said: str
) -> None:
    with pytest.raises(RobotFileError, match=rf"robot\.urdf, line \d+: joint {said}"):
        propose_robot(urdf, "mine")


def test_arms_and_continuous_joints_of_legs_are_no_mistakes() -> None:
    continuous = changed(SOURCE, CALF, CALF.replace("revolute", "continuous"))
    assert len(find_legs(parse_urdf(continuous)).legs) == 4
    found = find_legs(parse_urdf(dog(arm=ARM)))
    assert len(found.legs) == 4 and len(found.held) == 3


def test_a_leg_turned_up_on_one_side_is_refused() -> None:
    """Its joints do not let it down."""
    up = QUADRUPED
    for part in ("femur", "tibia"):
        joint = f'<joint name="left_rear_{part}" type="revolute">'
        before, after = up.split(joint)
        limit = after[after.index("<limit") : after.index("/>", after.index("<limit")) + 2]
        up = (
            before
            + joint
            + after.replace(
                limit, f'<limit lower="{math.pi / 2}" upper="1.6" effort="10" velocity="10"/>', 1
            )
        )
    with pytest.raises(RobotFileError, match=r"'left_rear_coxa' begins .* reach as far down"):
        propose_robot(up, "mine")
