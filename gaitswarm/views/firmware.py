"""Firmware that was written for a design."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.services.optimizer.views import View, finite
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.firmware import BUDGET, Firmware


class FirmwareTableView(View):
    """A fuzzy table."""

    name: str = Field(description="direct, or integrated.", examples=["direct"])
    shape: list[int] = Field(
        description="Entries by angle error, current and change of the error [1].",
        examples=[[1024, 64, 1]],
    )
    bytes: int = Field(description="Memory, eq. 5.1 [B].", examples=[65536])


class FirmwareTrajectoryView(View):
    """Desired angles of a walk."""

    scenario: str = Field(description="Name of the walk.", examples=["normal-fast"])
    sample_rate: float = Field(description="Rows a second [Hz].", examples=[500.0])
    rows: int = Field(description="Of the table [1].", examples=[755])
    columns: int = Field(
        description="Angles of a row; joints that move alike share one [1].", examples=[6]
    )
    repeats_from: int | None = Field(
        description="Row that comes after the last one; null if the walk does not repeat.",
        examples=[5],
    )
    bytes: int = Field(description="Memory of all joints, eq. 5.1 [B].", examples=[9060])
    bytes_of_a_leg: int = Field(description="Memory of one leg's joints [B].", examples=[4530])


class FirmwareWalkView(View):
    """A simulated walk that the firmware's test repeats."""

    scenario: str = Field(description="Name of the walk.", examples=["normal-fast"])
    status: str = Field(description="How it ended.", examples=["ok"])
    ticks: int = Field(description="Control ticks until then [1].", examples=[2250])
    samples: int = Field(description="Outputs that are compared [1].", examples=[40500])


class FirmwareMemoryView(View):
    """Memory that firmware needs on a leg's microcontroller, without its code."""

    processor: str = Field(description="Type of the microcontroller.", examples=["MSP430F2618"])
    flash: int = Field(description="Of the microcontroller [B].", examples=[118784])
    ram: int = Field(description="Of the microcontroller [B].", examples=[8192])
    cycles: int = Field(description="Of the microcontroller in a sample [1].", examples=[32000])
    tables: int = Field(description="Of the fuzzy tables [B].", examples=[65536])
    trajectories: int = Field(description="Of all joints and scenarios [B].", examples=[71820])
    trajectories_of_a_leg: int = Field(
        description="Of one leg's joints in all scenarios [B].", examples=[31380]
    )
    remembered: int = Field(description="RAM, from tick to tick [B].", examples=[40])
    fits: bool = Field(
        description="Whether controller and tables fit, trajectories kept elsewhere."
    )
    remarks: list[str] = Field(description="What does not fit, and the way out.", examples=[[]])


class FirmwareView(View):
    """A folder of C for a microcontroller."""

    folder: str | None = Field(
        default=None,
        description="Where it is; null for one that a server describes.",
        examples=["firmware"],
    )
    label: str = Field(description="What people call the design.", examples=["published A"])
    controller: ControllerName = Field(description="Of the design.", examples=["fuzzy-pi"])
    design: dict[str, float] = Field(
        description="Values by variable; of a categorical one the index of a choice.",
        examples=[{"P": 0.454, "I": 0.147}],
    )
    files: dict[str, int] = Field(
        description="Size of every file [B].", examples=[{"tick.c": 4600}]
    )
    integer_bits: int = Field(
        description="Width of the numbers with 16 fraction bits, 32 or 64 [bit].", examples=[32]
    )
    tables: list[FirmwareTableView] = Field(description="Fuzzy tables; none for P, PI, PID.")
    table_difference: dict[str, float | None] | None = Field(
        description="By objective, how far the walks are from those by the table of 10 x 6 bits, at"
        " most over the scenarios [1]; null with that table.",
        examples=[None],
    )
    trajectories: list[FirmwareTrajectoryView] = Field(description="By scenario.")
    walks: list[FirmwareWalkView] = Field(description="By scenario.")
    samples: int = Field(description="Of all walks [1].", examples=[280800])
    memory: FirmwareMemoryView = Field(description="Against that of the thesis's microcontroller.")

    @classmethod
    def from_firmware(
        cls,
        firmware: Firmware,
        *,
        folder: str | None,
        label: str,
        controller: ControllerName,
        design: dict[str, float],
    ) -> FirmwareView:
        """Make a view of firmware.

        Args:
            firmware: that was written.
            folder: where; None for nowhere yet.
            label: what people call the design.
            controller: of the design.
            design: values by variable.
        """
        parts = {"direct": firmware.law.direct, "integrated": firmware.law.integrated}
        memory = firmware.memory
        return cls(
            folder=folder,
            label=label,
            controller=controller,
            design=design,
            files={name: len(content) for name, content in firmware.files.items()},
            integer_bits=firmware.law.fine_bits,
            tables=[
                FirmwareTableView(
                    name=name, shape=list(table.values.shape), bytes=table.values.nbytes
                )
                for name, table in parts.items()
                if table is not None
            ],
            table_difference=(
                None
                if firmware.table_difference is None
                else {name: finite(value) for name, value in firmware.table_difference.items()}
            ),
            trajectories=[
                FirmwareTrajectoryView(
                    scenario=table.name,
                    sample_rate=1.0 / CONTROL_PERIOD,
                    rows=len(table.rows),
                    columns=table.rows.shape[1],
                    repeats_from=table.repeats_from if table.repeats else None,
                    bytes=table.bytes,
                    bytes_of_a_leg=table.bytes_of_a_leg,
                )
                for table in firmware.trajectories
            ],
            walks=[
                FirmwareWalkView(
                    scenario=log.scenario.name,
                    status=log.status.label,
                    ticks=log.ticks,
                    samples=log.pwm.size,
                )
                for log in firmware.logs
            ],
            samples=firmware.samples,
            memory=FirmwareMemoryView(
                processor=BUDGET.name,
                flash=BUDGET.flash,
                ram=BUDGET.ram,
                cycles=BUDGET.cycles,
                tables=memory.tables,
                trajectories=memory.trajectories,
                trajectories_of_a_leg=memory.trajectories_of_a_leg,
                remembered=memory.ram,
                fits=memory.fits,
                remarks=list(memory.remarks()),
            ),
        )
