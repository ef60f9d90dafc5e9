"""The file format of measured logs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.sim.errors import MeasuredLogError, SimulationInputError
from gaitswarm.sim.measurement.measured_files import parse_measured_log
from gaitswarm.sim.measurement.measured_log import MeasuredLog, Quantity
from gaitswarm.sim.robot.robot import Robot
from scripts.measured_logs import format_measured_log
from tests.validation.walks import renamed_robot, szabadka, walking_log, without_supplements

ROWS = 120


def small_log(robot: Robot) -> MeasuredLog:
    return walking_log(robot, rows=ROWS)


def assert_same(one: MeasuredLog, other: MeasuredLog) -> None:
    assert (one.joints, one.legs, one.potentiometer_joints) == (
        other.joints,
        other.legs,
        other.potentiometer_joints,
    )
    assert dict(one.metadata) == dict(other.metadata)
    np.testing.assert_array_equal(one.time, other.time)
    for quantity in Quantity:
        assert one.channels(quantity) == other.channels(quantity)
        np.testing.assert_array_equal(one.values(quantity), other.values(quantity))


@pytest.mark.parametrize("robot", [szabadka(), renamed_robot()], ids=["szabadka2", "other names"])
@pytest.mark.parametrize("change", [lambda log: log, without_supplements], ids=["all", "needed"])
def test_a_log_is_read_back_to_the_bit(
    robot: Robot, change: Callable[[MeasuredLog], MeasuredLog]
) -> None:
    log = change(small_log(robot))
    assert_same(parse_measured_log(format_measured_log(log), robot), log)


def test_every_heading_has_its_unit() -> None:
    (head,) = [
        line for line in format_measured_log(small_log(szabadka())).splitlines() if "q_D" in line
    ]
    assert head.startswith("time [s],q_D.right_front_coxa [rad],q_D.right_front_femur [rad],")
    for heading in (
        "U_P.left_rear_tibia [V]",
        "q.left_rear_tibia [rad]",
        "I_M.left_rear_tibia [A]",
        "U_S.left_rear [V]",
        "q_POT.right_middle_coxa [rad]",
        "a_BODY.z [g]",
        "w_BODY.x [rad/s]",
        "I_B.battery [A]",
    ):
        assert heading in head.split(",")
    assert len(head.split(",")) == 1 + 4 * 18 + 6 + 6 + 3 + 3 + 1


def test_columns_may_stand_in_any_order_and_editors_may_add_their_marks() -> None:
    robot, log = szabadka(), small_log(szabadka())
    title, metadata, *table = format_measured_log(log).splitlines()
    turned = [",".join(reversed(line.split(","))) for line in table]
    text = "\r\n".join(["\ufeff" + title, metadata, "", *turned, "", ""])
    assert_same(parse_measured_log(text, robot), log)


Edit = Callable[[list[str]], None]


def replace_cell(line: int, column: str, value: str) -> Edit:
    def edit(lines: list[str]) -> None:
        index = lines[2].split(",").index(column)
        cells = lines[line - 1].split(",")
        cells[index] = value
        lines[line - 1] = ",".join(cells)

    return edit


def drop_column(column: str) -> Edit:
    def edit(lines: list[str]) -> None:
        index = lines[2].split(",").index(column)
        for k in range(2, len(lines)):
            cells = lines[k].split(",")
            del cells[index]
            lines[k] = ",".join(cells)

    return edit


def drop_lines(first: int, last: int) -> Edit:
    def edit(lines: list[str]) -> None:
        del lines[first - 1 : last]

    return edit


ANGLE = "q.right_front_femur [rad]"
CURRENT = "I_M.left_rear_tibia [A]"


@pytest.mark.parametrize(
    ("edit", "line", "column", "problem"),
    [
        (replace_cell(3, ANGLE, "q.right_front_femur [deg]"), 3, ANGLE, "'deg'.*'rad'"),
        (replace_cell(3, ANGLE, "q.right_front_femur"), 3, ANGLE, "no unit.*'rad'"),
        (replace_cell(3, "time [s]", "time [ms]"), 3, "time [s]", "'ms'.*'s'"),
        (replace_cell(3, ANGLE, "q.right_fnort_femur [rad]"), 3, None, "unknown"),
        (replace_cell(3, ANGLE, CURRENT), 3, CURRENT, "twice"),
        (drop_column(ANGLE), 3, ANGLE, "missing"),
        (drop_column("time [s]"), 3, "time [s]", "missing"),
        (drop_column("a_BODY.y [g]"), 3, "a_BODY.y [g]", "missing"),
        (drop_column("w_BODY.x [rad/s]"), 3, "w_BODY.x [rad/s]", "missing"),
        (drop_column("U_S.right_rear [V]"), 3, "U_S.right_rear [V]", "missing"),
        (replace_cell(9, CURRENT, "nan"), 9, CURRENT, "nan is not a finite"),
        (replace_cell(9, CURRENT, "inf"), 9, CURRENT, "inf is not a finite"),
        (replace_cell(9, CURRENT, "-0.1"), 9, CURRENT, "-0.1 A is negative"),
        (replace_cell(9, CURRENT, "much"), 9, CURRENT, "'much' is not a number"),
        (replace_cell(9, CURRENT, ""), 9, CURRENT, "'' is not a number"),
        (replace_cell(9, CURRENT, "1_0"), 9, CURRENT, "'1_0' is not a number"),
        (replace_cell(9, CURRENT, "0.1,0.2"), 9, None, "93 values for the 92 columns"),
        (replace_cell(9, "time [s]", "0.7"), 9, "time [s]", "0.002 s apart"),
        (drop_lines(9, 9), 9, "time [s]", "0.004 s after"),
        (drop_lines(50, ROWS + 3), 49, None, "46 rows; at least 100"),
        (drop_lines(4, ROWS + 3), 3, None, "0 rows; at least 100"),
        (drop_lines(3, ROWS + 3), None, None, "no headings"),
    ],
)
def test_what_is_wrong_is_named_with_line_column_and_unit(
    edit: Edit, line: int | None, column: str | None, problem: str
) -> None:
    lines = format_measured_log(small_log(szabadka())).splitlines()
    edit(lines)
    with pytest.raises(MeasuredLogError, match=problem) as caught:
        parse_measured_log("\n".join(lines), szabadka())
    assert caught.value.line == line
    if line is not None:
        assert f"line {line}" in str(caught.value)
    if column is not None:
        assert caught.value.column == column
        assert f"column '{column}'" in str(caught.value)


def test_a_log_of_another_robot_is_refused_by_its_first_strange_column() -> None:
    text = format_measured_log(small_log(renamed_robot()))
    with pytest.raises(MeasuredLogError, match=r"R-front_coxa.*unknown.*right_front_coxa"):
        parse_measured_log(text, szabadka())


@pytest.mark.parametrize("value", ["two\nlines", "", " padded"])
def test_metadata_that_would_not_be_read_back_is_not_written(value: str) -> None:
    log = replace(small_log(szabadka()), metadata={"note": value})
    with pytest.raises(MeasuredLogError, match="note"):
        format_measured_log(log)


def test_a_log_of_impossible_shape_cannot_be_made() -> None:
    log = small_log(szabadka())
    with pytest.raises(SimulationInputError, match="I_M: shape"):
        replace(log, current=log.current[:, :5])
    with pytest.raises(SimulationInputError, match="q_POT: no joint 'tail'"):
        replace(log, potentiometer_joints=("tail", *log.potentiometer_joints[1:]))
