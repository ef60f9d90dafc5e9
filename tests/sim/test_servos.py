"""Servos by the friction and position control of Rhoban's BAM.

Expected numbers are BAM's (https://github.com/Rhoban/bam, commit 1b5a1ce, Apache-2.0): of
`Model.compute_frictions`, and of `simulate.Simulator` with steps of 0.5 ms.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from gaitswarm.sim.controllers import ControlLaw
from gaitswarm.sim.controllers.base import JointPd
from gaitswarm.sim.errors import RobotFileError, SimulationInputError
from gaitswarm.sim.firmware.folder import check_drives_by_pwm
from gaitswarm.sim.kernel.control_tick import InnerLoop
from gaitswarm.sim.kernel.dynamics.drives import DryFriction
from gaitswarm.sim.kernel.parameters import DRY_FRICTION
from gaitswarm.sim.kernel.walk import Coding, WalkSetup
from gaitswarm.sim.mujoco import forces
from gaitswarm.sim.proposal.document import Proposal, walking_proposal
from gaitswarm.sim.proposal.legs import LegHints
from gaitswarm.sim.robot.description import listed_actuator
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.simulate import check_drives, simulate
from tests.examples.pendulum import TRAJECTORIES, Pendulum, bench, swing, times
from tests.examples.walks import servo_quadruped_files, short_walk, walk
from tests.robots.test_proposal import dog

FRICTIONS = [
    # actuator, torque of the motor and on the link [N m], rate [rad/s], largest friction [N m]
    ("mx64", 0.09, -3.6, 0.0, 0.21831841),
    ("mx64", 3.59, -1.51, 0.0, 1.9589212),
    ("mx64", -0.61, 2.62, 0.2, 0.43618899),
    ("mx64", 0.4, -3.78, 0.2, 0.34890993),
    ("mx64", 2.03, -0.31, 4.0, 0.75193948),
    ("mx64", 2.31, -1.57, 0.2, 1.256228),
    ("xl330", -0.04, 0.29, 0.2, 0.043563821),
    ("xl330", -0.24, -0.19, 0.2, 0.088820065),
    ("xl330", 0.2, -0.18, 0.2, 0.077507541),
    ("xl330", 0.38, 0.37, 0.2, 0.14070736),
    ("xl330", 0.18, -0.03, 4.0, 0.052792936),
    ("xl330", -0.27, 0.38, 0.2, 0.11290903),
]

HEAVY, LIGHT, LONG = Pendulum(1.0, 0.2, 0.15), Pendulum(0.15, 0.03, 0.1), Pendulum(8.0, 1.0, 0.4)

EROB = ControlLaw(joint_pd=JointPd(4.89677 * 25.0, 4.89677 * 5.0))
"""BAM's law of eRobs at 25 A/rad and a damping of 1."""

SWINGS = [
    # actuator, volts, pendulum, trajectory, law; angles [rad] each half second, from 0.5 s on
    (
        *("mx64", 15.0, HEAVY, "sin_sin", ControlLaw(servo=32.0)),
        [0.9645, 0.7787, 1.6109, 1.5455, 1.0319, 0.1371, -0.7998, -0.7219, -1.5718, -1.4134],
    ),
    (
        *("mx64", 15.0, HEAVY, "up_and_down", ControlLaw(servo=8.0)),
        [0.0567, 0.2804, 0.5886, 0.9155, 1.1878, 1.3132, 1.3135, 1.3135, 1.3135, 1.2776],
    ),
    (
        *("xl330", 7.5, LIGHT, "up_and_down", ControlLaw(servo=400.0)),
        [0.0718, 0.3032, 0.6179, 0.9494, 1.2243, 1.3536, 1.3548, 1.3548, 1.326, 1.2518],
    ),
    (
        *("erob80-50", 48.0, LONG, "up_and_down", EROB),
        [0.0677, 0.3047, 0.6064, 0.9124, 1.157, 1.2589, 1.2589, 1.2589, 1.2146, 1.1442],
    ),
]


def made_with(actuator: str) -> tuple[Proposal, Robot]:
    made = walking_proposal(dog(), "dog", hints=LegHints(actuators={"*": actuator}))
    return made, parse_robot(made.toml, made.urdf)


@pytest.mark.parametrize(("actuator", "motor", "external", "rate", "limit"), FRICTIONS)
def test_friction_has_the_limit_of_bam(
    actuator: str, motor: float, external: float, rate: float, limit: float
) -> None:
    """BAM's external torque acts on the joint; ours is passed to the link."""
    numbers = {name: float(getattr(listed_actuator(actuator), name)) for name in DRY_FRICTION}
    assert float(DryFriction(numbers, 0.0, -external).limit(motor, rate)) == pytest.approx(
        limit, rel=1e-5
    )
    of_mujoco = forces.DryFriction({name: np.array([x]) for name, x in numbers.items()})
    of_mujoco.loads = np.array([-external])
    assert of_mujoco.limits(np.array([motor]), np.array([rate]))[0] == pytest.approx(
        limit, rel=1e-5
    )


@pytest.mark.slow
@pytest.mark.variants("mx64*sin_sin*", "erob*")
@pytest.mark.parametrize(("actuator", "volts", "pendulum", "trajectory", "law", "angles"), SWINGS)
def test_a_servo_moves_a_pendulum_as_in_bam(
    actuator: str,
    volts: float,
    pendulum: Pendulum,
    trajectory: str,
    law: ControlLaw,
    angles: list[float],
) -> None:
    """Coulomb and viscous friction alone (BAM's M1) would be off by 0.025 to 0.1 rad."""
    robot = bench(actuator, volts, pendulum)
    mine = swing(robot, TRAJECTORIES[trajectory](times()), law)
    np.testing.assert_allclose(mine[250:2750:250], angles, rtol=0.0, atol=0.003)


def duty(robot: Robot, error: float, p: float) -> float:
    """Of the first joint's servo, for an error [rad]."""
    coding = Coding.of(robot, 6)
    n = robot.n_joints
    setup = WalkSetup(
        start=np.zeros(7 + n),
        internal_state=np.empty(0),
        parameters=np.empty(0),
        desired=np.full((1, n), round(error * coding.angle_counts), dtype=np.int32),
        control_law=ControlLaw(servo=p),
        fall_height=0.0,
        cycle=1,
    )
    loop = InnerLoop(robot, setup, coding)
    loop.begin(0, np.zeros(n, dtype=np.int64))
    return float(loop.command(np.zeros(n), np.zeros(n))[0])


def test_duty_is_the_error_times_p_within_the_pwm_limit() -> None:
    _, robot = made_with("mx64")
    step = 2.0 * np.pi / 4096
    assert duty(robot, 10.2 * step, 32.0) == pytest.approx(0.158 * 32.0 * 10 * step, rel=1e-3)
    assert duty(robot, 10.2 * step, 16.0) == pytest.approx(0.158 * 16.0 * 10 * step, rel=1e-3)
    assert duty(robot, -1.0, 32.0) == -0.9625


def test_hobby_servos_have_a_dead_band_and_their_own_p() -> None:
    made, robot = made_with("mg996r")
    assert duty(robot, 0.003, 1.0) == 0.0
    assert duty(robot, 0.02, 1.0) == duty(robot, 0.02, 7.0) == pytest.approx(0.2, rel=0.05)
    assert made.job["fixed"] == {"P": 1.0}
    assert "P" not in [variable["name"] for variable in made.job["variables"]]
    assert {walk["trajectory_rate"] for walk in made.job["scenarios"]} == {50.0}


def test_a_proposal_tunes_p_in_units_of_the_register() -> None:
    made, _ = made_with("xl330")
    assert made.job["controller"] == "servo"
    assert made.job["variables"][0] == {
        "name": "P",
        "low": 100.0,
        "high": 800.0,
        "unit": "register",
    }


@pytest.mark.slow
def test_kernels_agree_with_servos() -> None:
    _, robot = made_with("mx64")
    brief = short_walk(cycle_time=0.25, stride=0.01, height=0.01, hip_height=0.3, radius=0.12)
    fast, slow = (
        walk(brief, {"P": 32.0}, "servo", robot=robot, backend=backend)
        for backend in ("native", "reference")
    )
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-6)


def test_the_controller_needs_servos() -> None:
    with pytest.raises(SimulationInputError, match="servo commands angles to servos"):
        check_drives(ControlLaw(servo=32.0), "szabadka2")
    with pytest.raises(SimulationInputError, match="servo commands angles to servos"):
        simulate(short_walk(), "servo", ["P"], np.array([[32.0]]))


def test_firmware_is_not_for_servos() -> None:
    with pytest.raises(SimulationInputError, match="export their angles by"):
        check_drives_by_pwm(servo_quadruped_files())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ((r"(?s)\[actuators.mx64.servo\].*?\n\n", ""), r"actuators.mx64.servo: required, as other"),
        (("default_p = 400.0", "default_p = 300.0"), None),
    ],
)
def test_all_joints_have_servos_of_one_register(change: tuple[str, str], said: str | None) -> None:
    made = walking_proposal(
        dog(), "dog", hints=LegHints(actuators={"*": "mx64", "*_hip_joint": "mx106"})
    )
    if said is None:
        toml = made.toml.replace("default_p = 32.0", "default_p = 400.0", 1)
        said = r"theirs are in different units \(default_p 32 and 400\)"
    else:
        toml = re.sub(*change, made.toml, count=1)
    with pytest.raises(RobotFileError, match=said):
        parse_robot(toml, made.urdf)
