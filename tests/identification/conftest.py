"""A twin with known parameters, and a recording of its walk."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from gaitswarm.sim.identification import RecordedWalk, record
from gaitswarm.sim.measurement.measured_log import simulated_log, synchronise
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot
from scripts.synthesize import Perturbation, synthetic_log
from tests.examples.walks import PUBLISHED_A, logged_walk, short_walk

SCENARIO = short_walk(name="brief", cycles=2, stride=0.16, height=0.03, curve="half_ellipse")
TRUTH = {
    "battery_voltage": 10.4,
    "body_mass": 4.3,
    "efficiency_right_front_coxa": 0.42,
    "stiffness_left_rear": 6000.0,
}


@dataclass(frozen=True, slots=True)
class Twin:
    robot: Robot
    recording: RecordedWalk


@pytest.fixture(scope="session")
def twin() -> Twin:
    robot = load_robot("szabadka2")
    log = synthetic_log(
        robot, SCENARIO, "fuzzy-pi", PUBLISHED_A, seed=3, perturbation=Perturbation.of(TRUTH)
    )
    simulated = simulated_log(robot, logged_walk(SCENARIO, robot=robot))
    pair = synchronise(log, simulated, SCENARIO.cycle_time)
    return Twin(robot, record(pair, SCENARIO, "fuzzy-pi", PUBLISHED_A))
