"""Actuators by name: their numbers, and robots that are made with them."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from gaitswarm.cli.main import run
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.document import walking_proposal
from gaitswarm.sim.proposal.legs import LegHints
from gaitswarm.sim.robot.description import DryFriction, listed_actuators
from gaitswarm.sim.robot.robot import Robot, parse_robot
from tests.robots.test_proposal import dog


def made_with(actuators: dict[str, str]) -> Robot:
    made = walking_proposal(dog(), "dog", hints=LegHints(actuators=actuators))
    return parse_robot(made.toml, made.urdf)


@pytest.mark.variants("mx64", "erob80-50")
@pytest.mark.parametrize("name", listed_actuators())
def test_a_robot_made_with_a_listed_actuator_has_its_numbers(name: str) -> None:
    listed, robot = listed_actuators()[name], made_with({"*": name})
    a = robot.actuators()
    assert a.torque.tolist() == [listed.gear_ratio * listed.torque_constant] * 12
    assert a.resistance[0] == listed.resistance
    assert a.armature[0] == pytest.approx(listed.armature)
    assert a.viscous[0] == listed.viscous_friction
    for field in DryFriction.model_fields:
        assert getattr(a, field)[0] == getattr(listed, field), field
    assert robot.description.supply.voltage == listed.voltage
    assert any(listed.title in guess for guess in robot.description.guesses)


def test_the_last_matching_pattern_names_the_actuator() -> None:
    robot = made_with({"*": "mx64", "*_hip_joint": "mx106", "RL_*": "mx64"})
    of_legs = {leg.name: leg.actuators for leg in robot.description.legs}
    assert of_legs["FL"] == ("mx106", "mx64", "mx64")
    assert of_legs["RL"] == ("mx64", "mx64", "mx64")


def test_servos_of_different_voltages_share_the_lowest() -> None:
    robot = made_with({"*": "mx64", "*_calf_joint": "xl320"})
    assert robot.description.supply.voltage == 7.4


@pytest.mark.parametrize(
    ("actuators", "said"),
    [
        ({"*_hip_joint": "mx64"}, "joint 'FL_thigh_joint' has no actuator"),
        ({"*": "mx64", "paw": "mx106"}, "no leg has a joint 'paw' .*there are FL_hip_joint"),
        ({"*": "mx46"}, "'mx46' is not listed; did you mean 'mx64'"),
        ({"*": "mx64", "FL_*": "erob80-50"}, "'erob80-50' is torque-controlled and 'mx64' is not"),
    ],
)
def test_unusable_names_are_refused_with_the_remedy(actuators: dict[str, str], said: str) -> None:
    with pytest.raises(RobotFileError, match=said):
        made_with(actuators)


def test_an_actuator_that_cannot_carry_the_robot_is_said_to_be_too_weak() -> None:
    robot = made_with({"*": "mx106", "*_calf_joint": "xl320"})
    (warning,) = (guess for guess in robot.description.guesses if "too weak" in guess)
    assert re.match(
        r"warning: xl320 is too weak: .* N m at \w+_calf_joint, .* has 0.24 N m", warning
    )


@pytest.mark.parametrize(
    ("name", "kg_cm", "seconds"), [("mg996r", 11, 0.14), ("ds3218", 21.5, 0.14)]
)
def test_hobby_servos_have_the_torque_and_speed_of_their_datasheets(
    name: str, kg_cm: float, seconds: float
) -> None:
    """At stall the gear bears the torques on both sides; without load only the motor's."""
    a = listed_actuators()[name]
    motor = a.torque_constant * a.voltage / a.resistance
    load, dry = a.load_friction, a.coulomb_friction
    torque = (motor * (1.0 - load) - dry) / (1.0 + load)
    assert torque / 0.0980665 == pytest.approx(kg_cm, rel=0.02)
    drop = dry / (1.0 - load) * a.resistance / a.torque_constant
    assert math.pi / 3.0 / ((a.voltage - drop) / a.torque_constant) == pytest.approx(
        seconds, rel=0.01
    )


def test_the_command_takes_names_for_all_or_some_joints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dog.urdf").write_text(dog(), encoding="utf-8")
    command = ["robot", "init", str(tmp_path / "dog.urdf"), "--output", str(tmp_path / "dog")]
    assert run([*command, "--actuator", "mx64", "--actuator", "*_hip_joint=mx106"]) == 0
    toml = (tmp_path / "dog" / "robot.toml").read_text(encoding="utf-8")
    assert 'actuators = ["mx106", "mx64", "mx64"]' in toml
    capsys.readouterr()
    assert run([*command[:-1], str(tmp_path / "no"), "--actuator", "xl33"]) == 2
    assert "did you mean 'xl330'" in capsys.readouterr().err


def test_help_lists_all_names(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["robot", "init", "--help"]) == 0
    text = capsys.readouterr().out
    assert [name for name in listed_actuators() if name not in text] == []


def test_the_documentation_lists_their_names_and_motors() -> None:
    text = (Path(__file__).parents[2] / "docs" / "robots.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| `")]
    shown = {cells[0].strip("`"): cells[1:] for cells in rows if len(cells) == 7}
    assert list(shown) == list(listed_actuators())
    for name, actuator in listed_actuators().items():
        title, voltage, torque, _, speed, _ = shown[name]
        assert (title, voltage) == (actuator.title, f"{actuator.voltage:g} V")
        assert float(torque.split()[0]) == pytest.approx(actuator.stall_torque, rel=0.05)
        assert float(speed.split()[0]) == pytest.approx(actuator.no_load_speed, rel=0.05)
