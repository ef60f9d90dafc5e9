"""Effects of the default robot's feet, those of table 2.7, on its walks."""

from __future__ import annotations

from typing import Final

import numpy as np
import pytest

from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.replay import replay
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples.robots import with_feet
from tests.examples.walks import Floats, heading, logged_walk, share_of_the_intended_speed, walk

pytestmark = pytest.mark.slow

LEVEL: Final = [scenario for scenario in SCENARIOS if not scenario.slope]
TURN: Final = SCENARIOS[5]
EVEN_SOLES: Final = {"sole": 0.01, "stiffness": 10_000.0}
"""The datasheet's, for which gaits are planned."""


@pytest.mark.variants("normal-fast", "turn-right-fast")
@pytest.mark.parametrize("scenario", LEVEL, ids=lambda s: s.name)
def test_on_the_level_the_default_robots_short_soft_soles_cost_speed(scenario: Scenario) -> None:
    robot = load_robot(DEFAULT_ROBOT)
    share = share_of_the_intended_speed(scenario)
    even = share_of_the_intended_speed(scenario, robot=with_feet(robot, **EVEN_SOLES))
    assert 0.85 < share < 1.02
    assert 0.9 < even < 1.05
    assert even > share + 0.03


def load_on_swinging_feet(robot: Robot, scenario: Scenario) -> float:
    """Share of the weight that is on feet while they go forward."""
    log = logged_walk(scenario, {"P": 1.0, "I": 0.0}, "pi", robot=robot)
    x = replay(robot, log, rate=500).foot_position[:, :, 0]
    weight = log.foot_force[:, :, 2]
    swinging = np.gradient(x, log.time, axis=0) > 0.03
    return float(weight[swinging].sum() / weight.sum())


@pytest.mark.thorough("test_on_the_level_the_default_robots_short_soft_soles_cost_speed")
def test_feet_on_short_soft_soles_drag_while_they_swing() -> None:
    """They sink, so that a foot which goes forward still carries."""
    robot = load_robot(DEFAULT_ROBOT)
    own, even = (
        load_on_swinging_feet(r, SCENARIOS[0]) for r in (robot, with_feet(robot, **EVEN_SOLES))
    )
    assert own > 3.0 * even


def test_on_the_slope_the_default_robot_creeps_back() -> None:
    """Soles that rub by `dead_zone` hold nothing at rest; sticking ones do."""
    (slope,) = (s for s in SCENARIOS if s.slope)
    sticking = RobotVariant(contact_law="stick")
    assert share_of_the_intended_speed(slope) < 0.75
    assert share_of_the_intended_speed(slope, robot=sticking) > 0.85


def velocities(log: WalkLog) -> tuple[Floats, Floats]:
    """Of the body along its heading and to the left of it, at every tick [m/s]."""
    yaw, velocity = heading(log), np.gradient(log.base_position, log.time, axis=0)
    x, y = velocity[:, 0], velocity[:, 1]
    return np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x


@pytest.mark.variants
@pytest.mark.parametrize("turn", [0.5, 0.0, -0.5])
def test_the_default_robot_drifts_to_its_right_which_is_no_distance(turn: float) -> None:
    result = walk(TURN.model_copy(update={"turn": turn, "cycles": 2.0}), log=True)
    (log,) = result.logs
    assert log is not None
    ahead, aside = velocities(log)
    assert result.outcome.objectives[0, 4] == pytest.approx(1.0 / ahead.mean(), rel=2e-3)
    assert -0.3 * ahead.mean() < aside.mean() < -0.05 * ahead.mean()


def test_the_drift_comes_from_soles_of_different_friction() -> None:
    """0.1 to 2.82 by leg."""
    alike = with_feet(load_robot(DEFAULT_ROBOT), friction=1.0)
    brief = SCENARIOS[0].model_copy(update={"cycles": 2.0})
    ahead, aside = velocities(logged_walk(brief, robot=alike))
    assert abs(aside.mean()) < 0.04 * ahead.mean()


@pytest.mark.thorough("test_a_turn_bends_to_its_side_and_distance_follows_the_heading")
def test_a_turn_bends_the_default_robots_way_to_either_side_of_what_is_straight_on() -> None:
    right, straight, left = (
        heading(logged_walk(TURN.model_copy(update={"turn": turn})))[-1]
        for turn in (0.5, 0.0, -0.5)
    )
    assert right < -0.05
    assert right + 0.05 < straight < left - 0.05
    assert left > 0.05
