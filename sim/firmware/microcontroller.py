"""Integer widths and memory that a control law and its trajectories need on a microcontroller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.base import ControlLaw, LookupTable
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD, FRACTION_BITS, INTEGRAL_BITS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.kernel.walk import CODE_LIMIT, Coding, check_gains
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario

_INT32: Final = (1 << 31) - 1

Narrow = TypeVar("Narrow", np.int16, np.uint16)

_NARROW: Final = 32
_WIDE: Final = 64


@dataclass(frozen=True, slots=True)
class Range:
    """Largest value of a number in the control tick."""

    name: str  # in tick.c
    meaning: str  # with its unit
    largest: int  # absolute
    bits: int  # of the integer that holds it, sign included


@dataclass(frozen=True, slots=True, eq=False)
class LawIntegers:
    """A control law in the integers of a microcontroller."""

    law: ControlLaw
    tables: Mapping[str, LookupTable]  # of the parts `direct` and `integrated`
    # width of numbers with 16 fraction bits, 32 or 64: the smaller one that suffices
    fine_bits: int
    ranges: tuple[Range, ...]


def law_integers(law: ControlLaw, coding: Coding) -> LawIntegers:
    """Bound every number of the control tick for any readings."""
    check_gains(law, torque=False)
    tables: dict[str, LookupTable] = {}
    for part, response in (("direct", law.direct), ("integrated", law.integrated)):
        if isinstance(response, LookupTable):
            tables[part] = response
        elif response is not None:
            raise SimulationInputError("firmware requires a table instead of an inference")
    half = 1 << (FRACTION_BITS - 1)
    change = 2 * CODE_LIMIT
    products = max(map(_largest_product, tables.values()), default=0) + half
    now = (
        CODE_LIMIT * abs(law.proportional_gain)
        + change * abs(law.derivative_gain)
        + _largest_output(tables.get("direct"))
        + half
    )
    grown = (
        (coding.pwm_counts << INTEGRAL_BITS)
        + CODE_LIMIT * abs(law.integral_gain)
        + _largest_output(tables.get("integrated"))
        + (1 << (INTEGRAL_BITS - 1))
    )
    # The middle of an axis is added to its index; tables have fewer than 2^16 rows.
    fine = _NARROW if max(products, now) <= _INT32 - (1 << 16) else _WIDE
    return LawIntegers(
        law,
        tables,
        fine,
        (
            Range("error", "angle error [counts]", CODE_LIMIT, _NARROW),
            Range("change", "of the error over a tick [counts]", change, _NARROW),
            Range("current", "absolute current [counts]", CODE_LIMIT, _NARROW),
            Range("index", "of a table, 16 fraction bits", products, fine),
            Range("now", "direct part [PWM counts], 16 fraction bits", now, fine),
            Range("grown", "integral part [PWM counts], 32 fraction bits", grown, _WIDE),
            Range("pwm", "output [PWM counts]", coding.pwm_counts, 16),
        ),
    )


def in_16_bits(
    codes: NDArray[np.int64], kind: type[Narrow], what: str, joints: Sequence[str]
) -> NDArray[Narrow]:
    """Check and convert codes (T, J) [counts] to the robot's 16 bits."""
    limits = np.iinfo(kind)
    beyond = (codes < limits.min) | (codes > limits.max)
    if beyond.any():
        tick, joint = (int(index) for index in np.argwhere(beyond)[0])
        raise SimulationInputError(
            f"{what} of {joints[joint]} is {int(codes[tick, joint])} counts after {tick} ticks,"
            " which exceeds the firmware's 16 bits; leave this scenario out"
        )
    return codes.astype(kind)


def _largest_product(table: LookupTable) -> int:
    """Of a reading and its index gain."""
    return max(
        CODE_LIMIT * abs(table.error_gain),
        CODE_LIMIT * abs(table.current_gain),
        2 * CODE_LIMIT * abs(table.velocity_gain),
    )


def _largest_output(table: LookupTable | None) -> int:
    if table is None:
        return 0
    values = max(int(table.values.max()), -int(table.values.min()))
    return values * abs(table.output_gain)


_MOST_CYCLES: Final = 4
"""Cycles after which a gait may repeat if its cycle is not a whole number of ticks."""


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryTable:
    """Desired angles of a walk as a table, played at the control rate.

    Row 0 is the pose at the start of a walk; row `repeats_from` follows the last one.
    """

    name: str  # of the scenario
    rows: NDArray[np.int16]  # (N, C) [counts of angle]
    repeats_from: int  # a row; N for a walk that does not repeat
    columns: NDArray[np.intp]  # column by joint, (J,)

    @property
    def repeats(self) -> bool:
        return self.repeats_from < len(self.rows)

    @property
    def bytes(self) -> int:
        """Memory of all rows, eq. 5.1 with rows in place of table entries [B]."""
        return self.rows.nbytes

    @property
    def bytes_of_a_leg(self) -> int:
        """Memory of one leg's columns, if its microcontroller stores them [B]."""
        return len(self.rows) * JOINTS_PER_LEG * self.rows.itemsize


def trajectory_table(robot: Robot, scenario: Scenario) -> TrajectoryTable:
    """Find the period at which a gait's coded angles repeat exactly, and keep one period."""
    cycle = scenario.cycle_time / CONTROL_PERIOD
    for cycles in range(1, _MOST_CYCLES + 1):
        period = round(cycles * cycle)
        if abs(cycles * cycle - period) > 1e-6:
            continue
        # One period more than needed, to verify the repetition.
        codes = _codes(robot, scenario, max(scenario.cycles, 2.0 * cycles + 1.0))
        differing = np.flatnonzero((codes[:-period] != codes[period:]).any(axis=1))
        begins = int(differing[-1]) + 1 if differing.size else 0
        if begins <= len(codes) - 2 * period:
            return _table(scenario.name, codes[: begins + period], begins)
    codes = _codes(robot, scenario, scenario.cycles)
    return _table(scenario.name, codes, len(codes))


def _codes(robot: Robot, scenario: Scenario, cycles: float) -> NDArray[np.int16]:
    """(T, J) [counts of angle]."""
    planned = desired_angles(robot, scenario.model_copy(update={"cycles": cycles}))
    codes = planned.codes(robot.description.sensors.angle_counts).astype(np.int64)
    return in_16_bits(codes, np.int16, f"{scenario.name}: the desired angle", robot.joint_names)


def _table(name: str, codes: NDArray[np.int16], repeats_from: int) -> TrajectoryTable:
    """Store equal columns once, in the order of their first joints."""
    distinct, first, columns = np.unique(codes, axis=1, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return TrajectoryTable(
        name, np.ascontiguousarray(distinct[:, order]), repeats_from, rank[columns.ravel()]
    )


CODE_BYTES: Final = 2048
"""Estimate for the control tick without tables, with a margin: a Cortex-M0's is half as long."""


@dataclass(frozen=True, slots=True)
class Memory:
    """Memory of firmware; trajectories are on the robot's central ARM, or on the legs."""

    # One microcontroller per leg: its flash [B], RAM [B], and cycles per tick at 16 MHz and 500 Hz.
    processor: ClassVar = "MSP430F2618"
    flash: ClassVar = 116 << 10
    ram: ClassVar = 8 << 10
    cycles: ClassVar = 32_000

    # State between ticks [B]: a 64-bit integral and a 32-bit error per joint, and a flag.
    remembered: ClassVar = JOINTS_PER_LEG * (8 + 4) + 4

    tables: int  # of the fuzzy tables, eq. 5.1 [B]
    trajectories: int  # of all joints of all scenarios [B]
    trajectories_of_a_leg: int  # of one leg's joints [B]

    @classmethod
    def of(cls, law: LawIntegers, trajectories: Sequence[TrajectoryTable]) -> Memory:
        return cls(
            sum(table.values.nbytes for table in law.tables.values()),
            sum(table.bytes for table in trajectories),
            sum(table.bytes_of_a_leg for table in trajectories),
        )

    @property
    def _left(self) -> int:
        """Flash that the controller leaves [B]."""
        return self.flash - self.tables - CODE_BYTES

    @property
    def fits(self) -> bool:
        """Whether the controller fits the microcontroller, without trajectories."""
        return self._left >= 0

    @property
    def remarks(self) -> list[str]:
        """What does not fit, with the remedy."""
        remarks = []
        if not self.fits:
            remarks.append(
                f"tables of {self.tables} B and about {CODE_BYTES} B of code exceed the flash of an"
                f" {self.processor} ({self.flash} B) by {-self._left} B; use a table of fewer bits"
                " (8x6: 16384 B instead of 65536 B) or a microcontroller with more"
            )
        if self.trajectories_of_a_leg > self._left:
            remarks.append(
                f"a leg's trajectories take {self.trajectories_of_a_leg} B, but its"
                f" {self.processor} has {max(0, self._left)} B left; let the robot's central"
                " processor play them, as in the thesis, or write fewer scenarios"
            )
        return remarks
