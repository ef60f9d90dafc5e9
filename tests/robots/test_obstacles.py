"""Obstacles in other people's files: surplus joints, wheels, feet, packages, tight limits."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gaitswarm.cli.main import run
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal import document
from gaitswarm.sim.proposal.document import Proposal, propose_robot, walking_proposal
from gaitswarm.sim.proposal.legs import AS_IT_IS, LegHints
from gaitswarm.sim.proposal.stance import HEIGHTS
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.robot import Robot, parse_robot
from tests.robots.test_mesh_feet import box
from tests.robots.test_proposal import ARM, INERTIAL, dog

LEGS = ("FL", "FR", "RL", "RR")


def longer(joint: str, *, legs: tuple[str, ...] = LEGS) -> str:
    """A dog whose legs have a fourth joint: a type and limits."""
    more = "".join(
        f'<joint name="{leg}_toe_joint" {joint}<parent link="{leg}_calf"/>'
        f'<child link="{leg}_toe"/><origin xyz="0 0 -0.2"/><axis xyz="0 1 0"/></joint>'
        f'<link name="{leg}_toe">{INERTIAL.replace("0.3", "0.1")}</link>'
        for leg in legs
    )
    return dog(foot="none").replace("</robot>", f"{more}</robot>")


LIMITS = '<limit lower="-1" upper="1" effort="9" velocity="9"/>'
TOES = longer(f'type="revolute">{LIMITS}')


def proposed(urdf: str, hints: LegHints) -> tuple[Proposal, Robot]:
    made = propose_robot(urdf, "mine", "auto", AS_IT_IS, hints)
    return made, parse_robot(made.toml, made.urdf)


def test_wheels_are_held_and_named() -> None:
    made, robot = proposed(longer('type="continuous">'), LegHints())
    assert robot.n_joints == 12
    assert set(robot.description.held_joints) == {f"{leg}_toe_joint" for leg in LEGS}
    assert "joint 'FL_toe_joint' is held at 0 rad, as it turns a wheel" in made.guesses


def test_the_last_of_four_joints_are_held_where_all_legs_have_four() -> None:
    made, robot = proposed(TOES, LegHints())
    assert dict(robot.description.held_joints) == {f"{leg}_toe_joint": 0.0 for leg in LEGS}
    note = next(note for note in made.guesses if "'FL_toe_joint' is held" in note)
    assert "legs have three joints; or lock others, as `--lock FL_hip_joint=0`" in note


def test_named_joints_are_held_instead_at_their_angle() -> None:
    made, robot = proposed(
        TOES, LegHints(locks={"F?_calf_joint": -1.2, "RL_calf_joint": -1.4} | {"RR_c*": -1.4})
    )
    assert dict(robot.description.held_joints) == {
        "FL_calf_joint": -1.2,
        "FR_calf_joint": -1.2,
        "RL_calf_joint": -1.4,
        "RR_calf_joint": -1.4,
    }
    assert robot.description.legs[0].joints == ("FL_hip_joint", "FL_thigh_joint", "FL_toe_joint")
    assert "joint 'FL_calf_joint' is held at -1.2 rad, as requested" in made.guesses


def test_arms_with_more_joints_than_legs_do_not_become_legs() -> None:
    made, robot = proposed(dog(arm=ARM), LegHints())
    assert len(robot.legs) == 4
    assert "joint 'arm0' is held at 0 rad" in made.guesses


def test_longer_legs_of_a_biped_are_refused_with_the_remedy() -> None:
    two = "".join(
        f'<joint name="{leg}_{k}" type="revolute"><parent link="{before}"/>'
        f'<child link="{leg}{k}"/><origin xyz="0 {y} -0.1"/>{LIMITS}</joint>'
        f'<link name="{leg}{k}">{INERTIAL}</link>'
        for leg, y in (("L", 0.1), ("R", -0.1))
        for k, before in enumerate(["trunk", f"{leg}0", f"{leg}1", f"{leg}2"])
    )
    urdf = f'<robot name="man"><link name="trunk">{INERTIAL}</link>{two}</robot>'
    with pytest.raises(RobotFileError, match=r"2 chains of 4 joints; hold .*`--lock L_3=0`"):
        propose_robot(urdf, "man")


@pytest.mark.parametrize(
    ("hints", "said"),
    [
        (
            LegHints(locks={"arm*": 0.0}),
            r"no movable joint 'arm\*' to lock; there are FL_hip_joint",
        ),
        (LegHints(feet={"paw": (0, 0, 0)}), "no leg ends with a link 'paw'.*end with FL_calf"),
    ],
    ids=["lock", "foot"],
)
def test_hints_that_match_nothing_are_refused(hints: LegHints, said: str) -> None:
    with pytest.raises(RobotFileError, match=said):
        propose_robot(dog(), "dog", "auto", AS_IT_IS, hints)


def test_a_given_foot_overrides_the_shapes() -> None:
    _, robot = proposed(dog(), LegHints(feet={"?L_calf": (0.0, 0.0, -0.15)}))
    np.testing.assert_allclose([leg.lengths[2] for leg in robot.legs], [0.15, 0.2, 0.15, 0.2])


def test_another_height_is_taken_where_limits_leave_no_room_to_step_in_the_usual_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    straight = dog().replace('lower="-2.7" upper="-0.8"', 'lower="-1.4" upper="-0.2"')
    # 75 % and 85 % of the legs' reach.
    monkeypatch.setattr(document, "HEIGHTS", HEIGHTS[::4])
    made = walking_proposal(straight, "mine")
    robot = parse_robot(made.toml, made.urdf)
    assert any("at 85% of the legs' reach" in note for note in made.guesses)
    for leg in robot.legs:
        assert isinstance(leg, ChainLeg)
        assert (leg.limits[:, 0] <= leg.stance).all() and (leg.stance <= leg.limits[:, 1]).all()


def test_large_robots_walk_in_steps_of_their_size() -> None:
    large = dog()
    for number in ("0.2", "0.05", "0.08", "0.1", "0.02"):
        for sign in ("", "-"):
            large = large.replace(f" {sign}{number} ", f" {sign}{10 * float(number)} ")
            large = large.replace(f' {sign}{number}"', f' {sign}{10 * float(number)}"')
    made, _ = proposed(large.replace('"0.2 ', '"2.0 ').replace('"-0.2 ', '"-2.0 '), LegHints())
    assert made.job["scenarios"][0]["radius"] > 1.0
    assert made.job["scenarios"][0]["hip_height"] > 1.0


def test_meshes_of_a_package_are_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Next to the file, in folders above it, in those that are named, and by package.xml."""
    places = ["dog/urdf/meshes", "dog/meshes", "meshes", "named/meshes", "clone/meshes"]
    urdf = tmp_path / "dog" / "urdf" / "dog.urdf"
    meshes = ""
    for number, place in enumerate(places):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / f"part{number}.obj").write_text(box(0.01, 0.02, 0.21))
        name = f"package://pack/meshes/part{number}.obj"
        meshes += f'<visual><geometry><mesh filename="{name}"/></geometry></visual>'
    (tmp_path / "clone" / "package.xml").write_text("<package><name>pack</name></package>")
    text = dog(foot="none").replace('<link name="FL_calf">', f'<link name="FL_calf">{meshes}')
    urdf.write_text(text, encoding="utf-8")
    options = ["--package", f"pack={tmp_path / 'named'}", "--package", str(tmp_path / "clone")]
    made = ["robot", "init", str(urdf), "-o", str(tmp_path / "made"), *options, "--json"]
    assert run(made) == 0
    found = json.loads(capsys.readouterr().out)["meshes"]
    assert (len(found["copied"]), found["left_out"]) == (len(places), [])


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (["--lock", "FL_calf_joint"], "lock: 'FL_calf_joint' is not JOINT=ANGLE"),
        (["--lock", "FL_calf_joint=low"], "lock: 'low' is not a number"),
        (["--foot", "FL_calf=0,0"], "foot: '0,0' is not 3 numbers separated by commas"),
        (["--foot", "FL_calf=0,0,nan"], "foot: '0,0,nan' is not 3 numbers"),
    ],
)
def test_malformed_hints_are_refused_by_option(
    option: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dog.urdf").write_text(dog(), encoding="utf-8")
    made = ["robot", "init", str(tmp_path / "dog.urdf"), "-o", str(tmp_path / "made"), *option]
    assert run(made) == 2
    assert said in " ".join(capsys.readouterr().err.split())
