"""One synthetic walk of a cycle, its robot and its simulated counterpart."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.measurement.measured_log import MeasuredLog, simulated_log
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario, find_scenario
from scripts.measured_logs import format_measured_log
from scripts.synthesize import synthetic_log
from tests.examples.walks import PUBLISHED_A, logged_walk


@dataclass(frozen=True, slots=True)
class TwoWalks:
    robot: Robot
    scenario: Scenario
    walk: WalkLog
    simulated: MeasuredLog
    synthetic: MeasuredLog
    text: str


@pytest.fixture(scope="session")
def walks() -> TwoWalks:
    robot, scenario = (
        load_robot("szabadka2"),
        find_scenario("normal-fast").model_copy(update={"cycles": 1.0}),
    )
    walk = logged_walk(scenario, robot=robot)
    synthetic = synthetic_log(robot, scenario, "fuzzy-pi", PUBLISHED_A, seed=7)
    return TwoWalks(
        robot,
        scenario,
        walk,
        simulated_log(robot, walk),
        synthetic,
        format_measured_log(synthetic),
    )
