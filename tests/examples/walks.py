"""Walks: the published design, short and steep scenarios, a robot that is not shipped."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation, simulate
from tests.examples.paths import QUADRUPED

Floats = NDArray[np.float64]

PUBLISHED_A: Final[dict[str, float]] = dict(CONTROLLERS["fuzzy-pi"].published["A"])
"""The thesis's optimum for preference A, a design of `fuzzy-pi`."""

LONG_STRIDES: Final[dict[str, Any]] = {"stride": 0.16, "height": 0.03, "curve": "half_ellipse"}
"""Fields of a scenario whose strides are nearly three times the default's."""

SHORT_WALK: Final[dict[str, Any]] = {
    "name": "short",
    "cycle_time": 1.0,
    "radius": 0.16,
    "hip_height": 0.15,
    "cycles": 1,
}
"""One step of a second on level ground, as a document."""


UPHILL_WALK: Final[dict[str, Any]] = SHORT_WALK | {
    "name": "uphill",
    "cycle_time": 1.5,
    "radius": 0.2,
    "hip_height": 0.14,
    "slope": 10.0,
}
"""A slower step up a slope, as a document."""


def short_walk(**changes: object) -> Scenario:
    """`SHORT_WALK` as a scenario, with some of its fields changed."""
    return Scenario.model_validate(SHORT_WALK | changes)


STEEP: Final = short_walk(
    name="steep", cycle_time=1.5, cycles=3, load=2.0, slope=20.0, slope_direction=30.0
)
"""Everything that tilts or weighs down a robot at once."""


def walk(
    scenario: Scenario,
    design: Mapping[str, float] = PUBLISHED_A,
    controller: str = "fuzzy-pi",
    **options: Any,
) -> Simulation:
    """One design walks. options: of `simulate`."""
    values = np.array([list(design.values())])
    return simulate(scenario, controller, list(design), values, **options)


def intended_speed(scenario: Scenario) -> float:
    """Speed [m/s] of a body whose feet follow their curve: a turn shortens one side's strides."""
    stride = scenario.stride * (1.0 - 0.5 * abs(scenario.turn))
    return stride / (scenario.duty_factor * scenario.cycle_time)


def share_of_the_intended_speed(scenario: Scenario, **options: Any) -> float:
    """What a stiff drive, P of 1, reaches of `intended_speed`. options: of `simulate`."""
    outcome = walk(scenario, {"P": 1.0, "I": 0.0}, "pi", **options).outcome
    return float(1.0 / (outcome.objectives[0, 4] * intended_speed(scenario)))


def heading(log: WalkLog) -> Floats:
    """Yaw of the body at every tick [rad], left positive."""
    x, y, z, w = log.base_orientation.T
    return np.asarray(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def logged_walk(
    scenario: Scenario,
    design: Mapping[str, float] = PUBLISHED_A,
    controller: str = "fuzzy-pi",
    **options: Any,
) -> WalkLog:
    """The log of `walk`."""
    (log,) = walk(scenario, design, controller, log=True, **options).logs
    assert log is not None
    return log


def quadruped_files() -> RobotFiles:
    """The robot that is not shipped, as text."""
    return RobotFiles(
        toml=(QUADRUPED / "robot.toml").read_text(encoding="utf-8"),
        urdf=(QUADRUPED / "robot.urdf").read_text(encoding="utf-8"),
    )


def servo_quadruped_files() -> RobotFiles:
    """The same robot with servos that have a position control."""
    files = quadruped_files()
    loops = [
        f"[actuators.{joint}.servo]\nposition_gain = 0.158\ndefault_p = 32.0\n"
        for joint in ("coxa", "femur", "tibia")
    ]
    return files.model_copy(update={"toml": "\n".join([files.toml, *loops])})


def torque_quadruped_files(
    *, backlash: float = 0.0, line: bool = True, rate: int = 1000
) -> RobotFiles:
    """The same robot with torque-controlled actuators.

    backlash: [rad]. line: whether a datasheet's knee limits torques, else the battery's voltage.
    rate: of the joint PD [Hz].
    """
    files = quadruped_files()
    begin, end = files.toml.index("[motors."), files.toml.index("[sensors]")
    knee = "speed_limit = 30.0\nknee_speed = 12.0\n" if line else ""
    actuators = f"""
[actuators.coxa]
kind = "torque"
gear_ratio = 9.0
torque_constant = 0.06
resistance = 0.3
rotor_inertia = 8e-5
torque_limit = 8.0
{knee}viscous_friction = 0.02
backlash = {backlash}

[actuators.femur]
kind = "torque"
gear_ratio = 9.0
torque_constant = 0.06
resistance = 0.3
rotor_inertia = 8e-5
torque_limit = 12.0
{knee}coulomb_friction = 0.1
backlash = {backlash}

[actuators.tibia]
kind = "torque"
gear_ratio = 12.0
torque_constant = 0.06
resistance = 0.25
rotor_inertia = 8e-5
torque_limit = 10.0
{knee}backlash = {backlash}

[supply]
voltage = 24.0
resistance = 0.05

[torque_command]
rate = {rate}

"""
    toml = files.toml[:begin] + actuators.lstrip() + files.toml[end:]
    return RobotFiles(toml=toml, urdf=files.urdf)


def random_state(rng: np.random.Generator, joints: int) -> tuple[Floats, Floats]:
    """A pose near walking height with any attitude, and violent velocities.

    q and v as the kernel has them: quaternion x y z w, twist in the body's own frame.
    """
    quaternion = rng.normal(size=4)
    q = np.concatenate(
        [
            rng.uniform([-1, -1, 0.0], [1, 1, 0.2]),
            quaternion / np.linalg.norm(quaternion),
            rng.uniform(-1.5, 1.5, joints),
        ]
    )
    return q, rng.normal(size=6 + joints) * 3.0
