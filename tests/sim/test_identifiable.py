"""The 45 parameters of table 2.7: which there are, and that each changes what it names alone."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel.parameters import Layout, pack_parameters
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.bounds import ContactLaw, PlannedSoles
from gaitswarm.sim.robot.description import EnergyConvention
from gaitswarm.sim.robot.identifiable import (
    CONVENTIONAL_VARIABLES,
    identifiable_variables,
    with_parameters,
)
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.walks import quadruped_files


def packed(robot: Robot) -> np.ndarray:
    return pack_parameters(robot, SCENARIOS[0], 2e-4)


def described_values(robot: Robot) -> dict[str, float]:
    """What a robot's description says of its identifiable parameters, by name."""
    d = robot.description
    values = {"battery_voltage": d.supply.voltage, "battery_resistance": d.supply.resistance}
    if d.body_mass is not None:
        values["body_mass"] = d.body_mass
    for joint, efficiency in zip(robot.joint_names, robot.actuators().efficiency, strict=True):
        values[f"efficiency_{joint}"] = float(efficiency)
    for leg, contact in zip(d.legs, robot.contacts(), strict=True):
        for field in ("stiffness", "damping", "sole", "friction"):
            values[f"{field}_{leg.name}"] = getattr(contact, field)
    return values


def test_the_hexapod_has_the_45_of_the_thesis() -> None:
    names = [variable.name for variable in identifiable_variables(load_robot("szabadka2"))]
    assert len(names) == len(set(names)) == 45
    counts = {
        kind: sum(name.startswith(f"{kind}_") for name in names)
        for kind in ("battery", "efficiency", "stiffness", "damping", "sole", "friction")
    }
    assert counts == {
        "battery": 2,
        "efficiency": 18,
        "stiffness": 6,
        "damping": 6,
        "sole": 6,
        "friction": 6,
    }


def test_a_robot_of_ones_own_has_those_of_its_own_legs() -> None:
    robot = load_robot(quadruped_files())
    names = [variable.name for variable in identifiable_variables(robot)]
    assert len(names) == 3 + 3 * 4 + 4 * 4
    changed = with_parameters(robot, {names[-1]: 0.33})
    assert changed.contacts()[-1].friction == 0.33
    assert changed.contacts()[0] == robot.contacts()[0]


def test_every_described_value_lies_within_the_bounds_of_the_search() -> None:
    robot = load_robot("szabadka2")
    described = described_values(robot)
    variables = {variable.name: variable for variable in identifiable_variables(robot)}
    # The mass of the body is the URDF's, as long as the description has no other.
    assert variables.keys() - described.keys() == {"body_mass"}
    for name, value in described.items():
        assert variables[name].low <= value <= variables[name].high


def test_described_values_change_nothing() -> None:
    robot = load_robot("szabadka2")
    np.testing.assert_array_equal(
        packed(with_parameters(robot, described_values(robot))), packed(robot)
    )


@pytest.mark.parametrize(
    ("name", "value", "field", "index"),
    [
        ("battery_voltage", 9.5, "supply_voltage", 0),
        ("battery_resistance", 0.1, "supply_resistance", 0),
        ("body_mass", 4.4, "base_mass", 0),
        ("stiffness_left_rear", 4321.0, "stiffness", 5),
        ("damping_right_front", 77.0, "damping", 0),
        ("sole_left_front", 0.005, "sole", 1),
        ("friction_right_middle", 0.7, "friction", 2),
    ],
)
def test_each_reaches_the_kernels_own_input(
    name: str, value: float, field: str, index: int
) -> None:
    robot = load_robot("szabadka2")
    before, after = packed(robot), packed(with_parameters(robot, {name: value}))
    where = Layout(robot).slices[field].start + index
    assert after[where] == value
    touched = np.flatnonzero(before != after)
    # A body of another mass has another inertia too.
    allowed = {"base_mass", "base_moment", "base_inertia"} if name == "body_mass" else {field}
    spans = [Layout(robot).slices[f] for f in allowed]
    assert all(any(s.start <= i < s.stop for s in spans) for i in touched)
    if name != "body_mass":
        assert touched.tolist() == [where]


def test_efficiency_is_the_named_gearheads_friction_alone() -> None:
    robot = load_robot("szabadka2")
    joint = robot.joint_names.index("left_front_femur")
    lossless = with_parameters(robot, {"efficiency_left_front_femur": 1.0})
    before, after = robot.actuators().viscous, lossless.actuators().viscous
    assert np.flatnonzero(before != after).tolist() == [joint]
    assert after[joint] == robot.actuators().motor_friction[joint]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("efficiency_left_front_femur", 1.2),
        ("battery_voltage", -1.0),
        ("body_mass", 0.0),
        ("stiffness_left_rear", 0.0),
    ],
)
def test_a_value_that_no_robot_has_is_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(SimulationInputError, match=f"^{name}: "):
        with_parameters(load_robot("szabadka2"), {name: value})


CHOICES = [
    (variable.name, index, choice)
    for variable in CONVENTIONAL_VARIABLES
    for index, choice in enumerate(variable.choices)
]


def test_conventions_have_the_choices_of_the_description() -> None:
    choices = {v.name: v.choices for v in CONVENTIONAL_VARIABLES if v.choices}
    assert choices == {
        "energy": get_args(EnergyConvention),
        "contact_law": get_args(ContactLaw),
        "planned_soles": get_args(PlannedSoles),
    }


def test_conventions_are_next_to_the_identified_parameters() -> None:
    names = {variable.name for variable in CONVENTIONAL_VARIABLES}
    own = {variable.name for variable in identifiable_variables(load_robot("szabadka2"))}
    assert len(names) == len(CONVENTIONAL_VARIABLES)
    assert names.isdisjoint(own)


@pytest.mark.parametrize(("name", "index", "choice"), CHOICES)
def test_a_choice_is_given_by_name_or_index(name: str, index: int, choice: str) -> None:
    robot = load_robot("szabadka2")
    named, counted = (with_parameters(robot, {name: value}) for value in (choice, index))
    d = named.description
    assert d == counted.description
    assert getattr(d.supply if name == "energy" else d, name) == choice


@pytest.mark.parametrize("name", ["szabadka2", "szabadka2-identified"])
def test_one_efficiency_is_that_of_every_joint_but_one_with_its_own(name: str) -> None:
    robot = load_robot(name)
    values = {"efficiency": 0.93, "efficiency_left_rear_tibia": 0.5}
    assert (with_parameters(robot, {"efficiency": 0.93}).actuators().efficiency == 0.93).all()
    efficiency = with_parameters(robot, values).actuators().efficiency
    assert efficiency.tolist() == [0.93] * 17 + [0.5]


@pytest.mark.parametrize("name", ["szabadka2", "szabadka2-identified"])
def test_the_slip_velocity_is_that_of_every_foot(name: str) -> None:
    changed = with_parameters(load_robot(name), {"slip_velocity": 0.12, "friction_left_rear": 0.4})
    assert [contact.slip_velocity for contact in changed.contacts()] == [0.12] * 6
    assert changed.description.contact.slip_velocity == 0.12
    assert changed.contacts()[-1].friction == 0.4


@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction", "load_friction"])
def test_dry_friction_is_that_of_every_gearhead(name: str) -> None:
    robot = with_parameters(load_robot("szabadka2-identified"), {name: 0.3})
    assert {getattr(gear, name) for gear in robot.description.gearheads.values()} == {0.3}
    assert robot.has_dry_friction


def test_the_current_filter_is_that_of_the_sensors() -> None:
    robot = load_robot("szabadka2")
    d = with_parameters(robot, {"current_filter": 0.004}).description
    sensors = robot.description.sensors.model_copy(update={"current_filter": 0.004})
    assert d == robot.description.model_copy(update={"sensors": sensors})


@pytest.mark.parametrize("name", ["szabadka2", "szabadka2-identified"])
def test_conventions_leave_all_else(name: str) -> None:
    robot = load_robot(name)
    d = robot.description
    described = {
        "energy": d.supply.energy,
        "contact_law": d.contact_law,
        "slip_velocity": d.contact.slip_velocity,
        "current_filter": d.sensors.current_filter,
        "planned_soles": d.planned_soles,
    }
    assert with_parameters(robot, described).description == d


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"contact_law": "ice"}, "contact_law: 'ice' is not one of its choices linear_zone, "),
        ({"energy": 9.0}, "energy: 9 is not one of its choices signed, positive, absolute"),
        ({"efficiency": 1.5}, "efficiency: "),
        ({"slip_velocity": 0.0}, "slip_velocity: "),
        (
            {"contact_law": "dead_zone", "slip_velocity": 0.004},
            "contact_law, slip_velocity: contact.stick_velocity: must be less than slip_velocity",
        ),
        ({"body_mass": "heavy"}, "body_mass: 'heavy' is not a number"),
    ],
)
def test_a_convention_that_no_robot_has_is_refused_by_name(
    values: dict[str, float | str], message: str
) -> None:
    with pytest.raises(SimulationInputError) as refused:
        with_parameters(load_robot("szabadka2-identified"), values)
    assert str(refused.value).startswith(message)
