"""Logs of a perturbed twin, and of the simulator itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.measurement.measured_files import parse_measured_log
from gaitswarm.sim.measurement.measured_log import Quantity, simulated_log
from gaitswarm.sim.validation import Tolerance
from scripts.synthesize import (
    Instruments,
    Perturbation,
    converted,
    perturbed,
    synthetic_log,
)
from tests.examples.walks import PUBLISHED_A, logged_walk
from tests.validation.conftest import TwoWalks
from tests.validation.walks import compare

pytestmark = pytest.mark.slow

NO_CHANGE = Perturbation.of({})
PERFECT = Instruments(
    current_noise=0.0,
    supply_noise=0.0,
    potentiometer_noise=0.0,
    acceleration_noise=0.0,
    rate_noise=0.0,
    battery_noise=0.0,
    lead=0.0,
    clock_offset=0.0,
)


def test_a_simulated_walk_has_every_quantity_in_its_unit(walks: TwoWalks) -> None:
    log, walk = walks.simulated, walks.walk
    np.testing.assert_array_equal(log.current, np.abs(walk.current))
    np.testing.assert_array_equal(log.control_voltage, walk.voltage)
    np.testing.assert_array_equal(log.supply, np.repeat(walk.supply[:, None], 6, axis=1))
    np.testing.assert_array_equal(log.body_rate, walk.base_velocity[:, 3:])
    assert log.joints == walks.robot.joint_names
    assert not log.synthetic


def test_the_batterys_current_is_its_voltages_drop_over_its_resistance(walks: TwoWalks) -> None:
    supply = walks.robot.description.supply
    assert walks.simulated.battery_current is not None
    np.testing.assert_allclose(
        walks.simulated.battery_current[:, 0],
        (supply.voltage - walks.walk.supply) / supply.resistance,
        atol=1e-9,
    )


def test_backlash_shows_between_encoder_and_potentiometer(walks: TwoWalks) -> None:
    robot = perturbed(walks.robot, NO_CHANGE.model_copy(update={"backlash": 0.04}))
    walk = logged_walk(walks.scenario, robot=robot)
    log = simulated_log(robot, walk)
    assert log.potentiometer is not None
    assert 0.015 < np.abs(log.joint_angle - log.potentiometer).max() < 0.05
    np.testing.assert_array_equal(log.potentiometer, walk.joint_angle)
    np.testing.assert_array_equal(walks.simulated.joint_angle, walks.simulated.potentiometer)


def test_the_bodys_acceleration_is_that_of_its_path(walks: TwoWalks) -> None:
    """The logged path, differenced twice, is the acceleration turned into the world's axes."""
    walk = walks.walk
    x, y, z, w = walk.base_orientation.T
    a = walk.body_acceleration()
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    world = np.einsum("ijt,tj->ti", rotation, a)
    path = np.gradient(np.gradient(walk.base_position, 0.002, axis=0), 0.002, axis=0)
    # Over a cycle, so that differences of differences do not count.
    window = np.ones(50) / 50
    for axis in range(3):
        smooth, expected = (np.convolve(s[:, axis], window, "valid") for s in (world, path))
        assert np.abs(smooth - expected).max() < 0.05 * np.abs(expected).max()


def test_a_walk_that_ended_early_is_refused(walks: TwoWalks) -> None:
    current = walks.walk.current.copy()
    current[-1] = np.nan
    with pytest.raises(SimulationInputError, match="ended early"):
        simulated_log(walks.robot, replace(walks.walk, current=current))


def test_a_synthetic_log_says_so_in_its_file(walks: TwoWalks) -> None:
    assert walks.synthetic.synthetic
    head = walks.text.splitlines()[:3]
    assert "# origin: synthetic" in head
    assert any("NOT measured" in line for line in head)
    back = parse_measured_log(walks.text, walks.robot)
    assert back.synthetic
    assert dict(back.metadata) == dict(walks.synthetic.metadata)
    for quantity in Quantity:
        np.testing.assert_array_equal(back.values(quantity), walks.synthetic.values(quantity))


def test_another_seed_changes_the_noise_alone(walks: TwoWalks) -> None:
    other = synthetic_log(walks.robot, walks.scenario, "fuzzy-pi", PUBLISHED_A, seed=8)
    for quantity in Quantity:
        differs = bool((other.values(quantity) != walks.synthetic.values(quantity)).any())
        # What the robot computes and what its encoders count has no noise.
        assert differs == (
            quantity
            in (
                Quantity.CURRENT,
                Quantity.SUPPLY,
                Quantity.POTENTIOMETER,
                Quantity.BODY_ACCELERATION,
                Quantity.BODY_RATE,
                Quantity.BATTERY_CURRENT,
            )
        )


def test_an_unperturbed_twin_with_perfect_instruments_agrees_but_for_the_converters(
    walks: TwoWalks,
) -> None:
    log = synthetic_log(
        walks.robot,
        walks.scenario,
        "fuzzy-pi",
        PUBLISHED_A,
        seed=1,
        perturbation=NO_CHANGE,
        instruments=PERFECT,
    )
    sensors = walks.robot.description.sensors
    step = sensors.current_step / sensors.current_counts
    np.testing.assert_allclose(log.current, walks.simulated.current, atol=0.51 * step)
    np.testing.assert_allclose(
        log.joint_angle, walks.simulated.joint_angle, atol=0.51 / sensors.angle_counts
    )
    np.testing.assert_array_equal(log.supply, walks.simulated.supply)
    comparison = compare(log, walks.simulated, walks.scenario.cycle_time)
    assert {q.whole.tolerance for q in comparison.quantities} <= {
        Tolerance.GREEN,
        Tolerance.YELLOW,
    }
    assert comparison.verdict.validated


def test_the_toolkit_finds_lag_and_differences_of_the_perturbed_twin(walks: TwoWalks) -> None:
    comparison = compare(walks.synthetic, walks.simulated, walks.scenario.cycle_time)
    assert comparison.lag == pytest.approx(Instruments().lead)
    assert comparison.cycles == 1
    assert comparison.synthetic
    desired, currents, supply = (
        comparison.quantity(q).whole
        for q in (Quantity.DESIRED_ANGLE, Quantity.CURRENT, Quantity.SUPPLY)
    )
    assert desired.rmae < 1e-9
    assert 0.10 < currents.rmae < 0.60
    # Five percent of the battery's voltage, and somewhat more over its resistance.
    assert 0.04 < supply.rmae < 0.10
    assert not comparison.verdict.validated


def test_every_perturbation_reaches_the_twin(walks: TwoWalks) -> None:
    robot = walks.robot
    for name in Perturbation.model_fields:
        value = {"friction_left_rear": 0.5} if name == "parameters" else 0.5
        change = NO_CHANGE.model_copy(update={name: value})
        assert perturbed(robot, change).description != robot.description
    assert perturbed(robot, NO_CHANGE).description == robot.description


def test_potentiometers_are_at_legs_1_and_3(walks: TwoWalks) -> None:
    joints = walks.robot.joint_names
    assert walks.synthetic.potentiometer_joints == joints[0:3] + joints[6:9]


def test_currents_pass_a_converter_of_12_bits(walks: TwoWalks) -> None:
    counts = walks.synthetic.current * 2079.0 / 16.0
    np.testing.assert_allclose(counts, np.rint(counts), atol=1e-9)
    amperes = np.array([-0.3, 0.0, 0.24, 0.26, 1e6])
    np.testing.assert_array_equal(converted(amperes, 0.5), [0.0, 0.0, 0.0, 0.5, 4095 * 0.5])


def test_a_twin_that_falls_has_no_log(walks: TwoWalks) -> None:
    crushed = walks.scenario.model_copy(update={"load": 50.0})
    with pytest.raises(SimulationInputError, match="did not finish the walk"):
        synthetic_log(walks.robot, crushed, "fuzzy-pi", PUBLISHED_A, seed=1)
    with pytest.raises(SimulationInputError, match="seed"):
        synthetic_log(walks.robot, walks.scenario, "fuzzy-pi", PUBLISHED_A, seed=-1)
