"""What firmware takes of the thesis's microcontroller (5.2), and the way out if it is too much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from gaitswarm.sim.firmware.integers import LawIntegers
from gaitswarm.sim.firmware.trajectory_table import TrajectoryTable
from gaitswarm.sim.robot.description import JOINTS_PER_LEG


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
