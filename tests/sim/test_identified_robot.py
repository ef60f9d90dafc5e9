"""The robot that the thesis identified: szabadka2 with the optimum of table 2.7."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import SHIPPED, RobotVariant, load_robot
from gaitswarm.sim.robot.identifiable import identifiable_variables
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate

LEGS = ("right_front", "left_front", "right_middle", "left_middle", "right_rear", "left_rear")
"""Legs 1 to 6 of the thesis."""

PER_CENT, KILO, MILLI = 0.01, 1000.0, 0.001

Row = tuple[float, float, float]

WHOLE: dict[str, Row] = {
    "battery_voltage": (9.22, 9.0, 9.35),
    "battery_resistance": (0.208, 0.2, 0.226),
    "body_mass": (4.43, 4.42, 5.06),
}
"""Table 2.7: optimum, and its interval's ends."""

BY_LEG: dict[str, tuple[float, tuple[Row, ...]]] = {
    "efficiency_{}_coxa": (PER_CENT, (
        (35, 34, 37), (32, 31, 37), (33, 32, 40), (32, 28, 36), (36, 32, 36), (44, 40, 45))),
    "efficiency_{}_femur": (PER_CENT, (
        (34, 27, 37), (89, 37, 95), (88, 80, 89), (95, 93, 95), (70, 39, 73), (57, 30, 59))),
    "efficiency_{}_tibia": (PER_CENT, (
        (32, 31, 38), (35, 29, 38), (38, 36, 41), (43, 35, 43), (36, 30, 36), (33, 33, 37))),
    "stiffness_{}": (KILO, (
        (4.59, 4.48, 4.9), (3.4, 3.12, 3.91), (4.63, 4.63, 5.19),
        (2.7, 2.58, 2.98), (1.23, 1.11, 1.45), (7.5, 6.3, 7.5))),
    "damping_{}": (KILO, (
        (1.5, 1.44, 1.7), (1.56, 1.38, 1.83), (0.2, 0.17, 0.2),
        (2.27, 2.26, 2.67), (0.44, 0.42, 0.49), (2.04, 1.8, 2.23))),
    "sole_{}": (MILLI, (
        (8.7, 8.7, 9.9), (10, 10, 10), (5.5, 5.0, 6.1),
        (5.4, 5.0, 5.4), (5.0, 5, 5.4), (8.3, 7.4, 8.6))),
    "friction_{}": (1.0, (
        (1.63, 1.38, 1.63), (2.52, 1.88, 2.66), (2.82, 2.57, 2.9),
        (0.1, 0.1, 0.13), (0.71, 0.59, 1.07), (0.31, 0.22, 0.31))),
}  # fmt: skip
"""Table 2.7 by leg, and the unit that it is printed in."""

TABLE_2_7: dict[str, Row] = WHOLE | {
    name.format(leg): (unit * row[0], unit * row[1], unit * row[2])
    for name, (unit, rows) in BY_LEG.items()
    for leg, row in zip(LEGS, rows, strict=True)
}
"""Optimum and interval of each of `identifiable_variables`, in its unit."""

PI = np.array([[0.45, 0.1]])
BRIEF = SCENARIOS[0].model_copy(update={"cycles": 1.0})


def identified() -> Robot:
    return load_robot("szabadka2-identified")


def test_it_has_the_optimum_of_table_2_7() -> None:
    robot = identified()
    supply, optimum = robot.description.supply, {k: row[0] for k, row in TABLE_2_7.items()}
    has = {
        "battery_voltage": supply.voltage,
        "battery_resistance": supply.resistance,
        "body_mass": robot.body.mass,
    }
    for joint, efficiency in zip(robot.joint_names, robot.actuators().efficiency, strict=True):
        has[f"efficiency_{joint}"] = float(efficiency)
    for leg, contact in zip(LEGS, robot.contacts(), strict=True):
        for field in ("stiffness", "damping", "sole", "friction"):
            has[f"{field}_{leg}"] = getattr(contact, field)
    assert len(has) == 45
    assert has == pytest.approx(optimum, rel=1e-12)


def test_all_else_but_friction_and_currents_filter_is_the_datasheet_robots() -> None:
    robot, base = identified(), load_robot("szabadka2")
    assert robot.urdf.text == base.urdf.text
    assert robot.legs == base.legs
    assert robot.mass == pytest.approx(base.mass - 3.25 + 4.43)
    for field in ("motors", "pwm", "contact", "load_height"):
        assert getattr(robot.description, field) == getattr(base.description, field)
    # Table 2.6: v_d and v_lin belong to one law; 2.3.6.3: currents pass a low-pass.
    assert robot.description.contact_law == "dead_zone"
    filtered = base.description.sensors.model_copy(update={"current_filter": 0.02})
    assert robot.description.sensors == filtered
    theirs = dataclasses.asdict(base.actuators())
    for field, values in dataclasses.asdict(robot.actuators()).items():
        if field != "efficiency":
            np.testing.assert_array_equal(values, theirs[field])


def test_its_battery_gives_less_than_full_scale() -> None:
    supply = identified().description.supply
    assert supply.nominal_voltage == load_robot("szabadka2").description.supply.nominal_voltage
    assert supply.nominal_voltage is not None
    assert supply.voltage < supply.nominal_voltage


def test_bounds_of_the_search_enclose_every_interval_of_table_2_7() -> None:
    variables = {variable.name: variable for variable in identifiable_variables(identified())}
    assert variables.keys() == TABLE_2_7.keys()
    for name, (optimum, low, high) in TABLE_2_7.items():
        assert low - 1e-12 <= optimum <= high + 1e-12, name
        assert variables[name].low < low, name
        assert high < variables[name].high, name


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_robot_has_its_own_name_and_says_what_it_is(name: str) -> None:
    description = load_robot(name).description
    assert description.name == name
    assert f"{load_robot(name).mass:.2f} kg" in description.description


def test_gaits_are_planned_for_the_nominal_sole_unless_asked_for_each_legs_own() -> None:
    datasheet = desired_angles(load_robot("szabadka2"), BRIEF).angles
    np.testing.assert_array_equal(desired_angles(identified(), BRIEF).angles, datasheet)
    own = load_robot(RobotVariant(name="szabadka2-identified", planned_soles="own"))
    assert own.planned_soles() == tuple(contact.sole for contact in own.contacts())
    same = (desired_angles(own, BRIEF).angles == datasheet).reshape(-1, 6, 3).all(axis=(0, 2))
    # Leg 2's sole is as long as the datasheet's.
    assert same.tolist() == [False, True, False, False, False, False]


def test_a_variant_keeps_what_it_does_not_name() -> None:
    plain = identified().description
    assert load_robot(RobotVariant(name="szabadka2-identified")).description == plain
    stick = load_robot(RobotVariant(name="szabadka2-identified", contact_law="stick"))
    assert stick.description == plain.model_copy(update={"contact_law": "stick"})
    lashed = load_robot(RobotVariant(name="szabadka2-identified", backlash=(2.0, 0.0, 0.0)))
    np.testing.assert_array_equal(
        lashed.actuators().efficiency, identified().actuators().efficiency
    )
    assert lashed.has_backlash


def test_a_variant_that_was_stored_with_its_law_keeps_it() -> None:
    stored = {"name": "szabadka2", "contact_law": "linear_zone", "backlash": [0.0, 0.0, 0.0]}
    robot = load_robot(RobotVariant.model_validate(stored))
    assert robot.description == load_robot("szabadka2").description


def test_it_walks() -> None:
    walks = {name: simulate(BRIEF, "pi", ["P", "I"], PI, robot=name).outcome for name in SHIPPED}
    for outcome in walks.values():
        assert outcome.statuses.tolist() == [Status.OK]
    differs = walks["szabadka2"].objectives != walks["szabadka2-identified"].objectives
    assert differs.all()
