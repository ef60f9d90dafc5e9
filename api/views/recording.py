"""Recorded walks at a glance."""

from __future__ import annotations

from pydantic import Field

from api.views.base import View
from sim.controllers.fixed_point import CONTROL_PERIOD
from sim.identification.recorded_walk import RecordedWalk


class RecordingView(View):
    """A recorded walk without its numbers."""

    id: str = Field(
        description="Identifier, as in `recordings` of a job.",
        examples=["0f343b0931126a20f133d67c2b018a3b"],
    )
    scenario: str = Field(description="Name of its scenario.", examples=["normal-fast"])
    controller: str = Field(description="Controller that drove it.", examples=["fuzzy-pi"])
    joints: int = Field(description="Joints whose currents were measured.", examples=[18])
    rows: int = Field(description="Rows, 500 a second.", examples=[1500])
    seconds: float = Field(description="Time that is compared [s].", examples=[3.0])
    mean_current: float = Field(
        description="Mean over rows and joints of the absolute current [A].", examples=[0.14]
    )
    synthetic: bool = Field(
        description="Whether it was computed, not measured on a robot.", examples=[False]
    )

    @classmethod
    def from_walk(cls, recording_id: str, walk: RecordedWalk) -> RecordingView:
        """recording_id: as the store gave it."""
        return cls(
            id=recording_id,
            scenario=walk.scenario.name,
            controller=walk.controller,
            joints=len(walk.joints),
            rows=len(walk.current),
            seconds=len(walk.current) * CONTROL_PERIOD,
            mean_current=float(walk.amperes.mean()),
            synthetic=walk.synthetic,
        )
