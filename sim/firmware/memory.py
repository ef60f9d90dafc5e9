"""Memory of firmware on the thesis's microcontroller (5.2): trajectories, tables, code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.firmware.integers import LawIntegers, in_16_bits
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.scenario import Scenario

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


@dataclass(frozen=True, slots=True)
class Budget:
    """A microcontroller."""

    name: str
    flash: int  # [B]
    ram: int  # [B]
    cycles: int  # per control tick


BUDGET: Final = Budget("MSP430F2618", flash=116 << 10, ram=8 << 10, cycles=32_000)
"""One per leg: 16 MHz at 500 Hz."""

CODE_BYTES: Final = 2048
"""Estimate for the control tick without tables, with a margin: a Cortex-M0's is half as long."""


@dataclass(frozen=True, slots=True)
class Memory:
    """Memory of firmware; trajectories are on the robot's central ARM, or on the legs."""

    tables: int  # of the fuzzy tables, eq. 5.1 [B].
    trajectories: int  # of all joints of all scenarios [B]
    trajectories_of_a_leg: int  # of one leg's joints [B]
    ram: int  # state of the controller between ticks [B]

    @classmethod
    def of(cls, law: LawIntegers, trajectories: Sequence[TrajectoryTable]) -> Memory:
        tables = (table for table in (law.direct, law.integrated) if table is not None)
        # A 64-bit integral and a 32-bit error per joint, and a flag.
        return cls(
            tables=sum(table.values.nbytes for table in tables),
            trajectories=sum(table.bytes for table in trajectories),
            trajectories_of_a_leg=sum(table.bytes_of_a_leg for table in trajectories),
            ram=JOINTS_PER_LEG * (8 + 4) + 4,
        )

    @property
    def flash(self) -> int:
        """Of the controller, its code counted as `CODE_BYTES` [B]."""
        return self.tables + CODE_BYTES

    @property
    def fits(self) -> bool:
        """Whether the controller fits the microcontroller, without trajectories."""
        return self.flash <= BUDGET.flash

    @property
    def trajectories_fit(self) -> bool:
        """Whether a leg's trajectories fit in addition to its controller."""
        return self.flash + self.trajectories_of_a_leg <= BUDGET.flash

    def remarks(self) -> tuple[str, ...]:
        """Describe what does not fit, with the remedy."""
        remarks = []
        if not self.fits:
            remarks.append(
                f"tables of {self.tables} B and about {CODE_BYTES} B of code exceed the flash of an"
                f" {BUDGET.name} ({BUDGET.flash} B) by {self.flash - BUDGET.flash} B; use a table"
                " of fewer bits (8x6: 16384 B instead of 65536 B) or a microcontroller with more"
            )
        if not self.trajectories_fit:
            rest = max(0, BUDGET.flash - self.flash)
            remarks.append(
                f"a leg's trajectories take {self.trajectories_of_a_leg} B, but its {BUDGET.name}"
                f" has {rest} B left; let the robot's central processor play them, as in the"
                " thesis, or write fewer scenarios"
            )
        return tuple(remarks)
