"""Recorded walks, without their numbers."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from gaitswarm.services.optimizer.jobs.listing import RecordingEntry
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.sim.measurement.measured_log import MeasuredLog, Quantity
from gaitswarm.sim.measurement.synchronise import Synchronised
from gaitswarm.sim.scenario import Scenario


class RecordingView(View):
    """A recorded walk without its numbers."""

    id: str = Field(
        description="Identifier, as in `recordings` of a job.",
        examples=["0f343b0931126a20f133d67c2b018a3b"],
    )
    scenario: str = Field(description="Name of its scenario.", examples=["normal-fast"])
    walk: Scenario = Field(description="That scenario in full.")
    controller: str = Field(description="Controller that drove it.", examples=["fuzzy-pi"])
    design: dict[str, float] = Field(
        description="Value of each of its variables, and of any gait variable, as it walked; of"
        " a categorical one the index of a choice.",
        examples=[{"P": 0.454, "I": 0.147}],
    )
    joints: int = Field(description="Joints whose currents were measured.", examples=[18])
    rows: int = Field(description="Rows, 500 a second.", examples=[1500])
    seconds: float = Field(description="Time that is compared [s].", examples=[3.0])
    mean_current: float = Field(
        description="Mean over rows and joints of the absolute current [A].", examples=[0.14]
    )
    peak_current: float = Field(description="Largest of these currents [A].", examples=[0.85])
    synthetic: bool = Field(
        description="Whether it was computed, not measured on a robot.", examples=[False]
    )

    @classmethod
    def from_walk(cls, recording_id: str, walk: RecordedWalk) -> RecordingView:
        """Make a view of a recording."""
        return cls(
            id=recording_id,
            scenario=walk.scenario.name,
            walk=walk.scenario,
            controller=walk.controller,
            design=walk.design,
            joints=len(walk.joints),
            rows=len(walk.current),
            seconds=len(walk.current) * CONTROL_PERIOD,
            mean_current=float(walk.amperes.mean()),
            peak_current=float(walk.amperes.max()),
            synthetic=walk.synthetic,
        )


class RecordingEntryView(View):
    """A recorded walk in a list. One that this server cannot read has an id, a time and a size."""

    id: str = Field(
        description="Identifier, as in `recordings` of a job.",
        examples=["0f343b0931126a20f133d67c2b018a3b"],
    )
    created_at: datetime = Field(description="When it was first stored.")
    scenario: str | None = Field(
        description="Name of its scenario; null if it cannot be read.", examples=["normal-fast"]
    )
    controller: str | None = Field(
        description="Controller that drove it; null if it cannot be read.", examples=["fuzzy-pi"]
    )
    joints: int | None = Field(description="Joints whose currents were measured.", examples=[18])
    rows: int | None = Field(description="Rows.", examples=[1500])
    rate: float = Field(description="Rows a second [1/s].", examples=[500.0])
    seconds: float | None = Field(description="Time that is compared [s].", examples=[3.0])
    size: int = Field(description="Characters of the stored document.", examples=[206113])
    synthetic: bool = Field(
        description="Whether it was computed, not measured on a robot.", examples=[False]
    )

    @classmethod
    def from_entry(cls, entry: RecordingEntry) -> RecordingEntryView:
        """Make a view of a recording in a list."""
        return cls(
            id=entry.id,
            created_at=entry.created_at,
            scenario=entry.scenario,
            controller=entry.controller,
            joints=entry.joints,
            rows=entry.rows,
            rate=1.0 / CONTROL_PERIOD,
            seconds=None if entry.rows is None else entry.rows * CONTROL_PERIOD,
            size=entry.size,
            synthetic=entry.synthetic,
        )


class SignalView(View):
    """One quantity of a measured log (thesis table 2.2)."""

    name: str = Field(description="Its symbol, as in the headings.", examples=["I_M"])
    unit: str = Field(description="Unit.", examples=["A"])
    description: str = Field(
        description="What it is, for people.", examples=["absolute motor current"]
    )
    channels: int = Field(
        description="Joints, legs or axes that were measured; 0 for a quantity that was not.",
        examples=[18],
    )


class MeasuredWalkView(View):
    """What was read of a measured log, and the recording that was made of it."""

    recording: RecordingView = Field(description="The recording, for jobs to fit to.")
    rows: int = Field(description="Rows of the log, 500 a second.", examples=[2300])
    seconds: float = Field(description="Length of the log [s].", examples=[4.6])
    signals: list[SignalView] = Field(description="Every quantity that a log may have.")
    offset: float = Field(
        description="How much later the walk begins in the log than the simulated walk does [s].",
        examples=[0.1],
    )
    cycles: int = Field(
        description="Whole walking cycles that log and simulated walk share: those recorded.",
        examples=[3],
    )
    cycle_time: float = Field(description="Time of a walking cycle [s].", examples=[1.5])
    correlation: float = Field(
        description="Of the log's desired angles with the simulated ones, 1 for the same gait.",
        examples=[0.9998],
    )

    @classmethod
    def from_log(
        cls, recording: RecordingView, log: MeasuredLog, pair: Synchronised
    ) -> MeasuredWalkView:
        """Make a view of what was read."""
        return cls(
            recording=recording,
            rows=len(log.time),
            seconds=len(log.time) * CONTROL_PERIOD,
            signals=[
                SignalView(
                    name=quantity.value,
                    unit=quantity.unit,
                    description=quantity.meaning,
                    channels=len(log.channels(quantity)),
                )
                for quantity in Quantity
            ],
            offset=pair.lag_seconds,
            cycles=pair.cycles,
            cycle_time=pair.cycle_time,
            correlation=pair.correlation,
        )
