"""First links without a body, as for simulators: the robot's body is free anyway."""

from __future__ import annotations

import pinocchio as pin
import pytest

from gaitswarm.robots import check_robot
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.document import Proposal, propose_robot
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.sim.robot.robot import parse_robot
from tests.robots.radial import radial_robot
from tests.robots.test_proposal import QUADRUPED, dog


def in_world(urdf: str, kind: str, first: str, xyz: str = "0 0 0", between: bool = False) -> str:
    """A robot attached to `world`, or to a link fixed to it, by a joint of some type."""
    place = ""
    if between:
        place = (
            '<link name="place"/><joint name="in_world" type="fixed"><parent link="world"/>'
            '<child link="place"/></joint>'
        )
    return urdf.replace(
        "</robot>",
        f'<link name="world"/>{place}<joint name="free" type="{kind}">'
        f'<parent link="{"place" if between else "world"}"/><child link="{first}"/>'
        f'<origin xyz="{xyz}"/></joint></robot>',
    )


def stances(made: Proposal) -> list[tuple[float, float, float] | None]:
    return [leg.stance for leg in parse_robot(made.toml, made.urdf).description.legs]


@pytest.mark.variants("*-urdf1-body")
@pytest.mark.parametrize(
    ("urdf", "first"), [(dog(), "trunk"), (QUADRUPED, "body"), (radial_robot(6), "base")]
)
@pytest.mark.parametrize(
    ("kind", "xyz", "between"),
    [
        ("floating", "0 0 0", False),
        ("floating", "1 0 0.5", False),
        ("floating", "0 0 0", True),
        ("fixed", "0 0 0.5", False),
    ],
    ids=["floating", "floating, dropped", "floating, in a place", "fixed, above the ground"],
)
def test_a_robot_on_a_world_is_the_robot(
    urdf: str, first: str, kind: str, xyz: str, between: bool
) -> None:
    made, free = (
        propose_robot(in_world(urdf, kind, first, xyz, between), "mine"),
        propose_robot(urdf, "mine"),
    )
    assert stances(made) == stances(free)
    assert made.job == free.job


@pytest.mark.variants
@pytest.mark.parametrize("kind", ["floating", "fixed"])
@pytest.mark.parametrize("above", [0.5, -0.3])
def test_a_robot_on_a_world_is_read_as_pinocchio_reads_it_and_stands(
    kind: str, above: float
) -> None:
    """Its frame is moved up to its hips: a body whose origin is on the ground counts as fallen."""
    made = propose_robot(in_world(dog(), kind, "trunk", f"0 0 {above}"), "mine")
    robot = parse_robot(made.toml, made.urdf)
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    assert model.nv == 6 + 12
    assert pin.computeTotalMass(model) == pytest.approx(robot.mass)
    assert [leg.hip[2] for leg in robot.legs] == pytest.approx([0.0] * 4, abs=1e-9)
    moved = f"{abs(above)} m {'above' if above > 0.0 else 'below'} that of 'world'"
    assert any(moved in note for note in made.guesses) == (kind == "fixed")
    checked = check_robot(RobotFiles(toml=made.toml, urdf=made.urdf))
    assert checked.warnings == []
    assert checked.standing.normal_forces == pytest.approx(checked.standing.weight, rel=0.02)


def test_a_floating_joint_elsewhere_is_refused_by_name() -> None:
    loose = dog().replace(
        '<joint name="FL_calf_joint" type="revolute">',
        '<joint name="FL_calf_joint" type="floating">',
    )
    with pytest.raises(RobotFileError, match="'FL_calf_joint' is floating"):
        propose_robot(loose, "mine")
