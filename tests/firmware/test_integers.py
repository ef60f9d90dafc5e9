"""Integers of firmware, wide enough for all readings, and tables of desired angles."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gaitswarm.sim.assembly import control_steps
from gaitswarm.sim.controllers import CONTROLLERS, ControlLaw, ControllerName, LookupTable
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.firmware.microcontroller import (
    LawIntegers,
    TrajectoryTable,
    in_16_bits,
    law_integers,
    trajectory_table,
)
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from tests.examples.walks import short_walk

ROBOT = load_robot("szabadka2-reconstructed")
CODING, _ = control_steps(ROBOT)
LARGEST = 65535


def integers_of(controller: ControllerName, name: str) -> LawIntegers:
    family = CONTROLLERS[controller]
    return law_integers(family.compile(family.published[name]), CODING)


@pytest.mark.parametrize(
    ("controller", "name", "bits"),
    [("fuzzy-pi", "A", 32), ("fuzzy-pi-3", "fuzzy-pso", 64), ("pi", "validation", 32)],
)
def test_extreme_readings_stay_within_the_ranges(
    controller: ControllerName, name: str, bits: int
) -> None:
    law = integers_of(controller, name)
    assert law.fine_bits == bits
    within = {own.name: own.largest for own in law.ranges}
    error = np.array([-LARGEST, -1, 0, 1, LARGEST], dtype=np.int64)
    change, current = 2 * error, np.abs(error)
    direct = error * law.law.proportional_gain + change * law.law.derivative_gain
    for table in law.tables.values():
        for reading, gain in (
            (error, table.error_gain),
            (current, table.current_gain),
            (change, table.velocity_gain),
        ):
            assert np.abs(reading * gain).max() + (1 << 15) <= within["index"]
    if "direct" in law.tables:
        direct = direct + law.tables["direct"].respond(error, current, change)
    assert np.abs(direct).max() + (1 << 15) <= within["now"]
    assert all(own.largest < 1 << (own.bits - 1) for own in law.ranges)


def test_narrow_integers_are_used_where_they_suffice() -> None:
    def bits(gain: int) -> int:
        return law_integers(ControlLaw(proportional_gain=gain), CODING).fine_bits

    reach = ((1 << 31) - 1 - (1 << 16) - (1 << 15)) // LARGEST
    assert (bits(reach), bits(reach + 1)) == (32, 64)


def test_an_inference_has_no_firmware() -> None:
    class Inference:
        def respond(self, error: object, current: object, change: object) -> object:
            raise NotImplementedError

    with pytest.raises(SimulationInputError, match="requires a table"):
        law_integers(ControlLaw(direct=Inference()), CODING)  # type: ignore[arg-type]


def test_gains_beyond_the_simulators_integers_are_refused() -> None:
    table = LookupTable(np.zeros((2, 1, 1), dtype=np.int8), 1, error_gain=1 << 40, current_gain=0)
    with pytest.raises(SimulationInputError, match=r"direct\.error_gain"):
        law_integers(ControlLaw(direct=table), CODING)


def test_an_angle_of_more_than_half_a_turn_is_refused_by_name() -> None:
    codes = np.array([[0, 32767], [-32768, 32768]], dtype=np.int64)
    assert in_16_bits(codes[:1], np.int16, "x: the angle", ["coxa", "femur"]).tolist() == [
        [0, 32767]
    ]
    with pytest.raises(SimulationInputError, match="x: the angle of femur is 32768 counts after 1"):
        in_16_bits(codes, np.int16, "x: the angle", ["coxa", "femur"])


def test_a_current_beyond_its_converter_is_refused_by_name() -> None:
    # Full scale, rounded to steps of 16 counts.
    codes = CODING.current_codes(np.array([[1.0, 1e6]]))
    assert codes[0, 1] == 65536
    with pytest.raises(SimulationInputError, match="x: the current of femur is 65536 counts"):
        in_16_bits(codes, np.uint16, "x: the current", ["coxa", "femur"])


def played(table: TrajectoryTable, ticks: int) -> np.ndarray:
    """(T, J): as trajectory.h has it."""
    rows = np.arange(ticks)
    n, begins = len(table.rows), table.repeats_from
    late = rows >= n
    rows[late] = begins + (rows[late] - begins) % (n - begins) if table.repeats else n - 1
    return table.rows[rows][:, table.columns]


@pytest.mark.parametrize(
    "scenario",
    [
        SCENARIOS[0],
        SCENARIOS[5],
        short_walk(name="half-ticks", cycle_time=1.733),
        short_walk(name="slow-source", cycle_time=1.0, trajectory_rate=20.0, fir_ms=93),
    ],
    ids=lambda s: s.name,
)
def test_a_table_that_repeats_plays_a_walk_of_any_length(scenario: Scenario) -> None:
    table = trajectory_table(ROBOT, scenario)
    assert table.repeats
    longer = scenario.model_copy(update={"cycles": 11.0})
    codes = desired_angles(ROBOT, longer).codes(ROBOT.description.sensors.angle_counts)
    np.testing.assert_array_equal(played(table, len(codes)), codes)
    # The two tripods of a walk straight ahead need three angles each.
    assert table.rows.shape[1] == (12 if scenario.turn else 6)
    assert table.bytes == 2 * table.rows.size


def test_a_walk_that_never_repeats_is_written_whole() -> None:
    scenario = short_walk(cycle_time=1.0003, cycles=2)
    table = trajectory_table(ROBOT, scenario)
    assert not table.repeats
    codes = desired_angles(ROBOT, scenario).codes(ROBOT.description.sensors.angle_counts)
    np.testing.assert_array_equal(played(table, len(codes)), codes)
    assert dataclasses.astuple(table)[2] == len(codes)
