"""Targets that the simulator itself has met, so that the truth behind them is known."""

from __future__ import annotations

from typing import Any, Final

from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.identifiable import with_parameters
from tests.examples.walks import PUBLISHED_A, SHORT_WALK, short_walk, walk

PI: Final = {"P": 0.45, "I": 0.1}

TRUTH: Final[dict[str, float]] = {"battery_voltage": 10.2, "body_mass": 4.1}
TRUE_LAW: Final = "stick"

WALKS: Final[list[dict[str, Any]]] = [
    {"name": "stiff", "controller": "pi", "design": PI, "scenarios": [SHORT_WALK]},
    {"name": "fuzzy", "controller": "fuzzy-pi", "design": PUBLISHED_A, "scenarios": [SHORT_WALK]},
]


def true_targets() -> list[dict[str, Any]]:
    """What a robot with the hidden parameters and law of friction comes to."""
    robot = with_parameters(load_robot(RobotVariant(name="szabadka2", contact_law=TRUE_LAW)), TRUTH)
    targets = []
    for asked in WALKS:
        found = walk(short_walk(), asked["design"], asked["controller"], robot=robot)
        (objectives,) = found.outcome.objectives
        torque, acceleration, angular, energy, reciprocal_speed, _ = objectives.tolist()
        values = {
            "torque": torque,
            "acceleration": acceleration,
            "angular_acceleration": angular,
            "energy": energy,
            "speed": 1.0 / reciprocal_speed,
            "power": energy / reciprocal_speed,
        }
        targets += [
            {"walk": asked["name"], "quantity": name, "value": value, "tolerance": 0.1}
            for name, value in values.items()
        ]
    return targets


def spec(**changes: object) -> CalibrationSpec:
    """A small calibration to made-up targets."""
    document: dict[str, object] = {
        "kind": "calibration",
        "robot": "szabadka2",
        "walks": WALKS,
        "targets": [{"walk": "stiff", "quantity": "speed", "value": 0.15, "tolerance": 0.1}],
        "variables": ["battery_voltage", "contact_law"],
        "optimizer": {"particles": 6},
        "iterations": 2,
    }
    return CalibrationSpec.model_validate(document | changes)
