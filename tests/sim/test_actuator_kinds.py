"""Kinds of actuators in a robot.toml: parsing and error messages."""

from __future__ import annotations

import re

import pytest

from gaitswarm.firmware import FirmwareRequest
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec, WalksSpec
from gaitswarm.sim.errors import RobotFileError, SimulationInputError
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.robot.description import TorqueActuator
from gaitswarm.sim.robot.identifiable import identifiable_variables, with_parameters
from gaitswarm.sim.robot.robot import parse_robot
from tests.examples.walks import quadruped_files, short_walk, torque_quadruped_files

DC, TORQUE = quadruped_files(), torque_quadruped_files()
PD = {"Kp": 40.0, "Kd": 1.0, "feed_forward": 0.8}


def refusal(toml: str) -> str:
    with pytest.raises(RobotFileError) as caught:
        parse_robot(toml, DC.urdf)
    return str(caught.value)


def test_an_actuator_without_a_kind_is_a_dc_motor_and_is_written_without_one() -> None:
    description = load_robot(DC).description
    assert description.actuator_kind == "dc"
    written = description.model_dump(mode="json")
    assert "kind" not in written["actuators"]["coxa"]
    assert {"torque_command"}.isdisjoint(written)
    named = DC.toml.replace("[actuators.coxa]", '[actuators.coxa]\nkind = "dc"')
    assert parse_robot(named, DC.urdf).description == description


def test_a_torque_controlled_robot_is_read_and_written() -> None:
    robot = load_robot(TORQUE)
    description = robot.description
    assert description.actuator_kind == "torque" and robot.is_torque_controlled
    assert description.output == (2047, 1, 1 / 2047)
    assert description.inner_rate == 1000
    assert type(description).model_validate(description.model_dump(mode="json")) == description
    femur = description.actuators["femur"]
    assert isinstance(femur, TorqueActuator)
    assert robot.actuators().armature[1] == pytest.approx(8e-5 * 81)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("torque_limit = 12.0", "", "actuators.femur.torque_limit: is missing"),
        ("torque_limit = 12.0", "torque_limit = -1", r"line \\d+: actuators.femur.torque_limit"),
        ("gear_ratio = 12.0", "gear_ratio = 12.0\nknee_sped = 1.0",
         "tibia.knee_sped: unknown key; did you mean .knee_speed"),
        ('kind = "torque"', 'kind = "hydraulic"', "actuators.coxa: kind: must be dc"),
        ("knee_speed = 12.0", "", "give both speed_limit and knee_speed, or neither"),
        ("knee_speed = 12.0", "knee_speed = 40.0", "knee_speed: 40 rad/s must be less than"),
        ("rate = 1000", "rate = 750", "torque_command.rate: must be a multiple of 500"),
        ("[torque_command]", "[pwm]\ncounts = 9\nfull_scale = 9\n[torque_command]",
         "pwm: applies to DC motors"),
        ("voltage = 24.0", "voltage = 24.0\nnominal_voltage = 24.0",
         "supply.nominal_voltage: applies to the PWM"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(old: str, new: str, said: str) -> None:
    assert old in TORQUE.toml
    assert re.search(said.replace("\\\\", "\\"), refusal(TORQUE.toml.replace(old, new, 1)))


def test_the_message_has_the_meaning_of_the_kinds_own_field() -> None:
    said = refusal(TORQUE.toml.replace("viscous_friction = 0.02", "viscous_friction = -1", 1))
    assert "at the joint [N m s/rad]" in said


@pytest.mark.parametrize(
    ("begin", "end", "said"),
    [
        ("[pwm]", "[sensors]", "pwm: required for DC motors"),
        ("nominal_voltage", "\n", "supply.nominal_voltage: required for DC motors"),
    ],
)
def test_dc_motors_require_the_same_fields_as_before_kinds(begin: str, end: str, said: str) -> None:
    start = DC.toml.index(begin)
    assert said in refusal(DC.toml[:start] + DC.toml[DC.toml.index(end, start) :])


def test_kinds_cannot_be_mixed() -> None:
    torque = TORQUE.toml[TORQUE.toml.index("[actuators.tibia]") : TORQUE.toml.index("[supply]")]
    start = DC.toml.index("[actuators.tibia]")
    mixed = DC.toml[:start] + torque + DC.toml[DC.toml.index("[supply]") :]
    assert "all legs must have actuators of one kind" in refusal(mixed)


def job(robot: RobotFiles, controller: str) -> WalksSpec:
    document = {"robot": robot, "controller": controller, "iterations": 1}
    return JobSpec.model_validate(document | {"scenarios": [short_walk()]})


def test_a_job_with_a_joint_pd_on_dc_motors_is_refused_when_it_is_submitted() -> None:
    with pytest.raises(InvalidRequest, match="this robot has DC motors") as caught:
        job(DC, "joint-pd").check_can_be_simulated()
    assert caught.value.field == "controller"
    for controller in ("joint-pd", "pid", "fuzzy-pi"):
        job(TORQUE, controller).check_can_be_simulated()


def test_firmware_is_refused_by_name() -> None:
    request = FirmwareRequest.model_validate(
        {"robot": TORQUE, "controller": "joint-pd", "design": PD, "scenarios": [short_walk()]}
    )
    with pytest.raises(InvalidRequest, match="PWM of DC motors; quadruped has torque") as caught:
        request.check()
    assert caught.value.field == "robot"


def test_there_is_no_gearhead_to_be_identified() -> None:
    robot = load_robot(TORQUE)
    names = {variable.name for variable in identifiable_variables(robot)}
    assert not any(name.startswith("efficiency") for name in names)
    with pytest.raises(SimulationInputError, match="efficiency: torque-controlled"):
        with_parameters(robot, {"efficiency": 0.5})
    rubbing = with_parameters(robot, {"coulomb_friction": 0.3})
    assert set(rubbing.actuators().coulomb_friction.tolist()) == {0.3}
