"""Robots with legs all around: legs stand where they point, and walk within reach."""

from __future__ import annotations

import math
import re
from functools import cache

import numpy as np
import pytest

from gaitswarm.robots import check_robot
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.gait.trajectory import require_reachable
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal import document
from gaitswarm.sim.proposal.document import Proposal, walking_proposal
from gaitswarm.sim.proposal.stance import HEIGHTS
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate
from tests.robots.radial import radial_robot

LAYOUTS = {
    "two": (2, math.pi / 2.0),
    "three": (3, 0.0),
    "four, ahead": (4, 0.0),
    "four": (4, math.pi / 4.0),
    "five": (5, 0.3),
    "six, ahead": (6, 0.0),
    "six": (6, math.pi / 6.0),
    "eight, ahead": (8, 0.0),
    "eight": (8, math.pi / 8.0),
    "twelve": (12, math.pi / 12.0),
}


@cache
def made(layout: str, limit: float = 0.8) -> tuple[Proposal, Robot]:
    proposal = walking_proposal(radial_robot(*LAYOUTS[layout], limit), "round")
    return proposal, parse_robot(proposal.toml, proposal.urdf)


@pytest.mark.variants("six-0.8", "five-1.57")
@pytest.mark.parametrize("limit", [0.8, 1.57])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_leg_stands_where_it_points_and_both_walks_are_in_reach(
    layout: str, limit: float
) -> None:
    proposal, robot = made(layout, limit)
    assert len(robot.legs) == LAYOUTS[layout][0]
    feet = []
    for leg in robot.legs:
        assert isinstance(leg, ChainLeg)
        assert abs(leg.stance[0]) < 0.01, "no hip is turned"
        feet.append(leg.foot(leg.stance.tolist()))
    assert np.ptp([math.hypot(x, y) for x, y, _ in feet]) < 1e-5, "all are as far from the middle"
    assert np.ptp([z for *_, z in feet]) < 1e-5, "all are level"
    for walk in proposal.job["scenarios"]:
        require_reachable(robot, Scenario.model_validate(walk))


@pytest.mark.variants
@pytest.mark.parametrize("layout", ["six", "six, ahead"])
def test_neighbours_of_a_round_hexapod_step_in_turns(layout: str) -> None:
    _, robot = made(layout)
    phases = [leg.phase for leg in robot.description.legs]
    assert phases in ([0.0, 0.5] * 3, [0.5, 0.0] * 3)


@pytest.mark.variants("three")
@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_round_robot_carries_its_weight_on_its_feet(layout: str) -> None:
    proposal, _ = made(layout)
    checked = check_robot(RobotFiles(toml=proposal.toml, urdf=proposal.urdf))
    assert checked.warnings == []
    assert checked.standing.normal_forces == pytest.approx(checked.standing.weight, rel=0.02)


@pytest.mark.variants
@pytest.mark.parametrize("layout", [layout for layout in LAYOUTS if layout != "two"])
def test_of_some_designs_a_round_robot_walks_both_of_its_walks(layout: str) -> None:
    proposal, robot = made(layout)
    designs = np.random.default_rng(1).uniform([0.2, 0.0, 0.0], [1.0, 0.5, 0.02], (8, 3))
    for walk in proposal.job["scenarios"]:
        scenario = Scenario.model_validate(walk)
        outcome = simulate(scenario, "pid", ["P", "I", "D"], designs, robot=robot).outcome
        paces = np.where(outcome.statuses == Status.OK, outcome.objectives[:, 4], np.inf)
        fastest = designs[[paces.argmin()]]
        walked = simulate(scenario, "pid", ["P", "I", "D"], fastest, robot=robot, log=True)
        (log,) = walked.logs
        assert walked.outcome.statuses.tolist() == [Status.OK] and log is not None
        # On three legs one swings while two carry, and the body tips onto it.
        least = 0.15 if layout == "three" else 0.5
        ahead = log.base_position[-1, 0] - log.base_position[0, 0]
        assert ahead > least * scenario.stride * scenario.cycles


@pytest.mark.thorough("test_legs_without_room_for_steps_are_refused_by_joint")
def test_steps_are_as_long_as_narrow_joints_allow_and_that_is_reported() -> None:
    proposal, robot = made("six", limit=0.15)
    usual, _ = made("six")
    for walk, whole in zip(proposal.job["scenarios"], usual.job["scenarios"], strict=True):
        assert walk["stride"] < whole["stride"] and walk["height"] < whole["height"]
        require_reachable(robot, Scenario.model_validate(walk))
        (note,) = (note for note in proposal.guesses if f"the walk {walk['name']!r}" in note)
        assert "of the usual stride and lift, as legs reach no further" in note


def test_legs_without_room_for_steps_are_refused_by_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(document, "HEIGHTS", HEIGHTS[:1])
    said = (
        r"robot\.urdf, line (\d+): joint ('leg\d_coxa'): legs cannot step around their stance,"
        r" .*: joint '\w+' of leg 'leg\d' would turn 0\.\d+ rad beyond its limit; check this"
    )
    with pytest.raises(RobotFileError, match=said) as refused:
        made("three", limit=0.01)
    found = re.search(said, str(refused.value))
    assert found and f"joint name={found[2]}".replace("'", '"') in _line(found[1])
    raised = radial_robot(3).replace('xyz="0.12 0.0 0"', 'xyz="0.12 0.0 0.4"', 1)
    level = r"joint 'leg\d_coxa' begins a leg whose foot cannot be level with the others"
    with pytest.raises(RobotFileError, match=rf"line \d+: {level}"):
        walking_proposal(raised, "round")


def _line(number: str) -> str:
    return radial_robot(*LAYOUTS["three"], 0.01).splitlines()[int(number) - 1]


def test_legs_are_named_by_what_their_joints_share() -> None:
    _, robot = made("six")
    assert [leg.name for leg in robot.legs] == [f"leg{k}" for k in range(6)]
    text = radial_robot(3).replace("_coxa", "_j1").replace("_femur", "_j2").replace("_tibia", "_j3")
    proposal = walking_proposal(text, "round")
    robot = parse_robot(proposal.toml, proposal.urdf)
    assert [leg.name for leg in robot.legs] == [f"leg{k}" for k in range(3)]
