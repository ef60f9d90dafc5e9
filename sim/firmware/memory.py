"""What firmware takes of the thesis's microcontroller (5.2), and the way out if it is too much."""

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
"""A cycle that is no whole number of ticks may repeat after some."""


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryTable:
    """Desired angles by row and column, played at the control rate.

    Row 0 is the pose in which a walk begins; after the last one comes row `repeats_from`.

    Attributes:
        name: of the scenario.
        rows: (N, C) [counts of angle].
        repeats_from: a row; N for a walk that does not repeat.
        columns: by joint its column, (J,).
    """

    name: str
    rows: NDArray[np.int16]
    repeats_from: int
    columns: NDArray[np.intp]

    @property
    def repeats(self) -> bool:
        """Whether the walk can go on for ever."""
        return self.repeats_from < len(self.rows)

    @property
    def bytes(self) -> int:
        """Memory of all rows, eq. 5.1 with rows in place of table entries [B]."""
        return self.rows.nbytes

    @property
    def bytes_of_a_leg(self) -> int:
        """Memory of one leg's columns, should its microcontroller keep them [B]."""
        return len(self.rows) * JOINTS_PER_LEG * self.rows.itemsize


def trajectory_table(robot: Robot, scenario: Scenario) -> TrajectoryTable:
    """Fold a gait's desired angles, to the bit, where they repeat."""
    cycle = scenario.cycle_time / CONTROL_PERIOD
    for cycles in range(1, _MOST_CYCLES + 1):
        period = round(cycles * cycle)
        if abs(cycles * cycle - period) > 1e-6:
            continue
        # Once more than it takes, to see that it repeats.
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
    """Each column once, in the order of the joints that have it first."""
    distinct, first, columns = np.unique(codes, axis=1, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return TrajectoryTable(
        name, np.ascontiguousarray(distinct[:, order]), repeats_from, rank[columns.ravel()]
    )


@dataclass(frozen=True, slots=True)
class Budget:
    """A microcontroller.

    Attributes:
        name: of the type.
        flash: [B].
        ram: [B].
        cycles: of a control tick.
    """

    name: str
    flash: int
    ram: int
    cycles: int


BUDGET: Final = Budget("MSP430F2618", flash=116 << 10, ram=8 << 10, cycles=32_000)
"""One a leg: 16 MHz at 500 Hz."""

CODE_BYTES: Final = 2048
"""Of the control tick without its tables, with room: a Cortex-M0's is half as long."""


@dataclass(frozen=True, slots=True)
class Memory:
    """Bytes of firmware; trajectories are played by the robot's central ARM, or kept on the legs.

    Attributes:
        tables: of the fuzzy tables, eq. 5.1 [B].
        trajectories: of all joints of all scenarios [B].
        trajectories_of_a_leg: the same of one leg's joints [B].
        ram: that the controller remembers from tick to tick [B].
    """

    tables: int
    trajectories: int
    trajectories_of_a_leg: int
    ram: int

    @classmethod
    def of(cls, law: LawIntegers, trajectories: Sequence[TrajectoryTable]) -> Memory:
        """Add up what is written."""
        tables = (table for table in (law.direct, law.integrated) if table is not None)
        # An integral of 64 bits and an error of 32 a joint, and a flag.
        return cls(
            tables=sum(table.values.nbytes for table in tables),
            trajectories=sum(table.bytes for table in trajectories),
            trajectories_of_a_leg=sum(table.bytes_of_a_leg for table in trajectories),
            ram=JOINTS_PER_LEG * (8 + 4) + 4,
        )

    @property
    def flash(self) -> int:
        """Of the controller, its code taken as `CODE_BYTES` [B]."""
        return self.tables + CODE_BYTES

    @property
    def fits(self) -> bool:
        """Whether the controller fits the microcontroller, its trajectories kept elsewhere."""
        return self.flash <= BUDGET.flash

    @property
    def trajectories_fit(self) -> bool:
        """Whether a leg's trajectories fit beside its controller."""
        return self.flash + self.trajectories_of_a_leg <= BUDGET.flash

    def remarks(self) -> tuple[str, ...]:
        """What does not fit, and the way out."""
        remarks = []
        if not self.fits:
            remarks.append(
                f"tables of {self.tables} B and some {CODE_BYTES} B of code are"
                f" {self.flash - BUDGET.flash} B more than the flash of an {BUDGET.name}"
                f" ({BUDGET.flash} B); take a table of fewer bits (8x6 are 16384 B in place of"
                " 65536 B), or a microcontroller with more"
            )
        if not self.trajectories_fit:
            rest = max(0, BUDGET.flash - self.flash)
            remarks.append(
                f"a leg's trajectories take {self.trajectories_of_a_leg} B, and {rest} B of its"
                f" {BUDGET.name} are left; let the robot's central processor play them, as the"
                " thesis's does, or write fewer scenarios"
            )
        return tuple(remarks)
