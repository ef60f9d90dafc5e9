"""Proposals from a URDF alone: legs, feet, stance, actuators, gaits, errors."""

from __future__ import annotations

import itertools
import tomllib
from importlib import resources

import numpy as np
import pytest

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.proposal.drive import ActuatorChoice
from gaitswarm.sim.proposal.legs import find_legs
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.limbs import feet_in_body
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.robot.urdf import parse_urdf
from gaitswarm.sim.scenario import Scenario
from tests.examples.walks import quadruped_files

HEXAPOD = (resources.files("gaitswarm.sim.robot") / "szabadka2" / "robot.urdf").read_text(
    encoding="utf-8"
)
QUADRUPED = quadruped_files().urdf
INERTIAL = """<inertial><origin xyz="0 0 -0.1"/><mass value="0.3"/>
  <inertia ixx="1e-3" iyy="1e-3" izz="1e-4" ixy="0" iyz="0" ixz="0"/></inertial>"""


def proposed(urdf: str) -> Robot:
    proposal = propose_robot(urdf, "mine")
    return parse_robot(proposal.toml, proposal.urdf)


def dog(*, foot: str = "sphere", effort: float = 30.0, arm: str = "", joints: int = 3) -> str:
    """Four legs that hang down: roll at the hip, pitch at hip and knee, as most quadrupeds have.

    foot: `sphere` and `cylinder` are shapes of the shank, `link` a link at its end, `none` nothing.
    """
    shapes = {
        "sphere": '<collision><origin xyz="0 0 -0.2"/><geometry><sphere radius="0.02"/></geometry>'
        "</collision>",
        "cylinder": '<collision><origin xyz="0 0 -0.1"/><geometry>'
        '<cylinder radius="0.01" length="0.2"/></geometry></collision>',
    }
    parts = [f'<robot name="dog"><link name="trunk">{INERTIAL.replace("0.3", "8")}</link>']
    for leg, x, y in (("FL", 1, 1), ("FR", 1, -1), ("RL", -1, 1), ("RR", -1, -1)):
        before = "trunk"
        for k, (part, axis, at, low, high) in enumerate(
            (
                ("hip", "1 0 0", f"{0.2 * x} {0.05 * y} 0", -0.8, 0.8),
                ("thigh", "0 1 0", f"0 {0.08 * y} 0", -1.0, 3.5),
                ("calf", "0 1 0", "0 0 -0.2", -2.7, -0.8),
            )[:joints]
        ):
            shape = shapes.get(foot, "") if k == joints - 1 else ""
            parts.append(
                f'<joint name="{leg}_{part}_joint" type="revolute"><parent link="{before}"/>'
                f'<child link="{leg}_{part}"/><origin xyz="{at}"/><axis xyz="{axis}"/>'
                f'<limit lower="{low}" upper="{high}" effort="{effort}" velocity="20"/></joint>'
                f'<link name="{leg}_{part}">{INERTIAL}{shape}</link>'
            )
            before = f"{leg}_{part}"
        if foot == "link":
            parts.append(
                f'<link name="{leg}_toe"/><joint name="{leg}_weld" type="fixed">'
                f'<parent link="{before}"/><child link="{leg}_toe"/>'
                '<origin xyz="0 0 -0.21"/></joint>'
            )
    return "".join([*parts, arm, "</robot>"])


STATUE = f'<robot name="statue"><link name="trunk">{INERTIAL}</link></robot>'
ARM = "".join(
    f'<joint name="arm{k}" type="{kind}"><parent link="{before}"/><child link="arm{k}"/>'
    f'<origin xyz="0.1 0 0.1"/><axis xyz="0 1 0"/>'
    f'<limit lower="{low}" upper="2" effort="5" velocity="3"/></joint>'
    f'<link name="arm{k}">{INERTIAL}</link>'
    for k, (before, kind, low) in enumerate(
        [("trunk", "revolute", -2), ("arm0", "revolute", 0.5), ("arm1", "prismatic", 0)]
    )
)


@pytest.mark.parametrize(
    ("urdf", "legs", "phases"),
    [
        (HEXAPOD, 6, {0.0: 3, 0.5: 3}),
        (QUADRUPED, 4, {0.0: 2, 0.5: 2}),
        (dog(), 4, {0.0: 2, 0.5: 2}),
    ],
    ids=["hexapod", "sprawling quadruped", "dog"],
)
def test_all_legs_are_found_and_neighbours_alternate(
    urdf: str, legs: int, phases: dict[float, int]
) -> None:
    robot = proposed(urdf)
    found = [leg.phase for leg in robot.description.legs]
    assert len(found) == legs
    assert {phase: found.count(phase) for phase in found} == phases
    by_side: dict[float, list[tuple[float, float]]] = {}
    for leg, phase in zip(robot.legs, found, strict=True):
        by_side.setdefault(leg.side, []).append((leg.hip[0], phase))
    for row in by_side.values():
        ordered = [phase for _, phase in sorted(row)]
        assert all(a != b for a, b in itertools.pairwise(ordered))


@pytest.mark.parametrize("urdf", [HEXAPOD, QUADRUPED, dog()], ids=["hexapod", "quadruped", "dog"])
def test_the_stance_is_level_within_limits_and_its_walks_can_be_planned(urdf: str) -> None:
    proposal = propose_robot(urdf, "mine")
    robot = parse_robot(proposal.toml, proposal.urdf)
    feet = []
    for leg in robot.legs:
        assert isinstance(leg, ChainLeg)
        assert (leg.stance > leg.limits[:, 0]).all() and (leg.stance < leg.limits[:, 1]).all()
        feet.append(leg.foot(leg.stance.tolist()))
    np.testing.assert_allclose(np.ptp([foot[2] for foot in feet]), 0.0, atol=1e-5)
    np.testing.assert_allclose(np.ptp([abs(foot[1]) for foot in feet]), 0.0, atol=1e-5)
    assert [walk["name"] for walk in proposal.job["scenarios"]] == ["slow", "fast"]
    for walk in proposal.job["scenarios"]:
        scenario = Scenario.model_validate(walk)
        require_reachable(robot, scenario)
        # The walk is about the stance: in mid-support its joints are where they stand.
        first = robot.legs[0]
        assert isinstance(first, ChainLeg)
        away = np.abs(desired_angles(robot, scenario).angles[:, :3] - first.stance)
        assert away.min(axis=0).max() < 0.1


def test_legs_that_turn_about_upright_axes_do_not_step_below_the_body() -> None:
    swung = dog().replace('axis xyz="1 0 0"', 'axis xyz="0 0 1"')
    for limits, wider in (
        ("-0.8 0.8", "-2.03 2.51"),
        ("-1.0 3.5", "-2 2"),
        ("-2.7 -0.8", "-2.4 2.4"),
    ):
        low, high = limits.split()
        lower, upper = wider.split()
        swung = swung.replace(f'lower="{low}" upper="{high}"', f'lower="{lower}" upper="{upper}"')
    robot = proposed(swung)
    feet = feet_in_body(
        robot, np.concatenate([leg.stance for leg in robot.legs if isinstance(leg, ChainLeg)])
    )
    hips = np.array([leg.hip for leg in robot.legs])
    assert (np.abs(feet[:, :2]) > np.abs(hips[:, :2])).all()
    assert (np.sign(feet[:, :2]) == np.sign(hips[:, :2])).all()


def test_a_dog_stands_on_legs_below_its_hips() -> None:
    robot = proposed(dog())
    for leg in robot.legs:
        assert isinstance(leg, ChainLeg)
        x, _, z = leg.foot(leg.stance.tolist())
        assert x == pytest.approx(leg.hip[0], abs=1e-5)
        assert abs(leg.stance[0]) < 0.15
        assert 0.6 < -z / 0.4 < 0.9


@pytest.mark.parametrize(
    ("foot", "name", "end", "sole"),
    [
        ("sphere", "FL_calf_foot", 0.2, 0.02),
        ("cylinder", "FL_calf_foot", 0.2, None),
        ("link", "FL_toe", 0.21, None),
    ],
)
def test_a_foot_is_a_link_a_sphere_or_the_far_end_of_the_last_shape(
    foot: str, name: str, end: float, sole: float | None
) -> None:
    leg = find_legs(parse_urdf(dog(foot=foot))).legs[0]
    np.testing.assert_allclose(leg.end.at, [0.0, 0.0, -end], atol=1e-12)
    assert leg.end.sole == sole
    robot = proposed(dog(foot=foot))
    assert robot.description.legs[0].foot == name
    assert robot.description.legs[0].name == "FL"
    assert robot.legs[0].lengths[2] == pytest.approx(end)
    if sole is not None:
        assert robot.description.contact.sole == sole


def test_an_arm_is_held_within_its_limits_and_reported() -> None:
    proposal = propose_robot(dog(arm=ARM), "mine")
    robot = parse_robot(proposal.toml, proposal.urdf)
    assert robot.description.held_joints == {"arm0": 0.0, "arm1": 0.5, "arm2": 0.0}
    assert robot.n_joints == 12
    assert "joint 'arm1' is held at 0.5 rad" in proposal.guesses


def test_torque_and_speed_are_the_urdfs_where_they_can_be_meant() -> None:
    said = parse_robot(*_files(dog(effort=30.0), "dc")).actuators()
    stall = said.torque * 24.0 / said.resistance
    np.testing.assert_allclose(stall, 30.0, rtol=1e-4)
    np.testing.assert_allclose(24.0 / said.torque, 20.0, rtol=1e-4)
    for effort in (1000.0, 0.0, 0.1):
        guessed = parse_robot(*_files(dog(effort=effort), "dc")).actuators()
        stall = guessed.torque * 24.0 / guessed.resistance
        assert (stall > 1.0).all() and (stall < 100.0).all()
        assert "torque guessed" in propose_robot(dog(effort=effort), "mine").toml


def test_torque_actuators_have_the_urdfs_limits_and_a_design_space_that_fits_them() -> None:
    proposal = propose_robot(dog(effort=30.0), "mine", "torque")
    actuators = parse_robot(proposal.toml, proposal.urdf).actuators()
    np.testing.assert_allclose(actuators.torque_limit, 30.0)
    # All of the torque up to half of 20 rad/s, none at 20 rad/s.
    line = actuators.stall_torque[0], actuators.torque_drop[0]
    np.testing.assert_allclose([line[0] - rate * line[1] for rate in (10.0, 20.0)], [30.0, 0.0])
    assert proposal.job["controller"] == "joint-pd"
    stiffness, damping, feed_forward = proposal.job["variables"]
    assert stiffness["low"] < 30.0 < stiffness["high"]
    assert damping["low"] < 1.0 < damping["high"]
    assert feed_forward == "feed_forward"


@pytest.mark.variants("quasi-direct drives", "hexapod of DC motors")
@pytest.mark.parametrize(
    ("urdf", "kind"),
    [
        (dog(effort=30.0), "torque"),
        (dog(effort=1000.0), "dc"),
        (dog(effort=30.0).replace('velocity="20"', 'velocity="6"', 1), "dc"),
        (HEXAPOD, "dc"),
    ],
    ids=[
        "quasi-direct drives",
        "no torque that can be meant",
        "a slow joint",
        "hexapod of DC motors",
    ],
)
def test_actuators_are_torque_controlled_where_the_urdf_speaks_for_it(urdf: str, kind: str) -> None:
    assert proposed(urdf).description.actuator_kind == kind
    assert parse_robot(*_files(urdf, "torque")).description.actuator_kind == "torque"
    assert parse_robot(*_files(urdf, "dc")).description.actuator_kind == "dc"


@pytest.mark.parametrize(
    ("actuator", "fields"),
    [
        ("dc", ["efficiency", "voltage"]),
        ("torque", ["gear_ratio", "voltage", "rate"]),
    ],
)
def test_every_guess_has_a_comment(actuator: ActuatorChoice, fields: list[str]) -> None:
    toml = propose_robot(dog(arm=ARM), "mine", actuator).toml
    for field in ("load_height", *fields, "stiffness", "sole", "friction", "stance"):
        line = next(line for line in toml.splitlines() if line.startswith(f"{field} ="))
        assert "#" in line, line
    assert tomllib.loads(toml)["name"] == "mine"


@pytest.mark.parametrize(
    ("urdf", "said"),
    [
        (dog(joints=2), r"legs need three revolute joints.*'trunk' carries 4 chains of 2 joints"),
        (
            dog(foot="none").replace("0 0 -0.1", "0 0 0").replace("0 0 -0.2", "0 0 0"),
            r"link 'FL_calf' has no foot: give",
        ),
        (STATUE, "it has no movable joint"),
        (dog().replace('value="0.3"', 'value="nan"', 1), r"link 'FL_hip': value='nan' of <mass>"),
        (
            dog()
            .replace('xyz="0 0 -0.2"/><axis', 'xyz="0 0 0.2"/><axis')
            .replace('<origin xyz="0 0 -0.2"/><geometry>', '<origin xyz="0 0 0.2"/><geometry>')
            .replace('lower="-2.7" upper="-0.8"', 'lower="-0.1" upper="0.1"')
            .replace('lower="-1.0" upper="3.5"', 'lower="-0.1" upper="0.1"'),
            r"-z seems to point up in its frame, as feet reach above the hips",
        ),
    ],
    ids=["two joints", "no foot", "no joints", "mass of NaN", "upside down"],
)
def test_what_has_no_such_legs_is_refused_with_the_reason(urdf: str, said: str) -> None:
    with pytest.raises(RobotFileError, match=said):
        propose_robot(urdf, "mine")


def _files(urdf: str, actuator: ActuatorChoice = "auto") -> tuple[str, str]:
    proposal = propose_robot(urdf, "mine", actuator)
    return proposal.toml, proposal.urdf
