"""A twin whose true parameters are known, and what was recorded of its walk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from sim.controllers import CONTROLLERS
from sim.identification.recorded_walk import RecordedWalk, record
from sim.measurement.measured_log import simulated_log
from sim.measurement.synchronise import synchronise
from sim.measurement.synthetic import Perturbation, synthetic_log
from sim.robot import Robot, load_robot
from sim.scenario import Scenario
from sim.simulate import simulate

DESIGN = dict(CONTROLLERS["fuzzy-pi"].published["A"])
SCENARIO = Scenario(name="brief", cycle_time=1.0, radius=0.16, hip_height=0.15, cycles=2.0)
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
        robot, SCENARIO, "fuzzy-pi", DESIGN, seed=3, perturbation=Perturbation.of(TRUTH)
    )
    values = np.array([list(DESIGN.values())])
    (walk,) = simulate(SCENARIO, "fuzzy-pi", list(DESIGN), values, log=True).logs
    assert walk is not None
    pair = synchronise(log, simulated_log(robot, walk), SCENARIO.cycle_time)
    return Twin(robot, record(pair, SCENARIO, "fuzzy-pi", DESIGN))
