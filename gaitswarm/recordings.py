"""Recorded walks: views of them, and recordings made of measured logs."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime

from pydantic import Field

from gaitswarm.services.optimizer.errors import InvalidRequest, simulation_errors
from gaitswarm.services.optimizer.jobs.designs import DesignRequest
from gaitswarm.services.optimizer.jobs.listing import RecordingEntry
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.identification import RecordedWalk, record
from gaitswarm.sim.measurement.measured_files import parse_measured_log
from gaitswarm.sim.measurement.measured_log import MeasuredWalk, Quantity, synchronise
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import Scenario, ScenarioChoice, find_scenario
from gaitswarm.sim.validation import Verdict, compare_synchronised


class RecordingBase(View):
    """A recorded walk."""

    id: str = Field(examples=["0f343b0931126a20f133d67c2b018a3b"])
    """Identifier, as in `recordings` of a job."""
    scenario: str = Field(description="Name of its scenario.", examples=["normal-fast"])
    controller: str = Field(description="Controller that drove it.", examples=["fuzzy-pi"])
    joints: int = Field(description="Joints whose currents were measured.", examples=[18])
    rows: int = Field(description="Rows, 500 a second.", examples=[1500])
    seconds: float = Field(description="Time that is compared [s].", examples=[3.0])
    synthetic: bool = Field(description="Whether it was computed, not measured.")


class RecordingView(RecordingBase):
    """A recorded walk without its numbers."""

    walk: Scenario = Field(description="Its scenario in full.")
    design: dict[str, float] = Field(examples=[{"P": 0.454, "I": 0.147}])
    """Value of each of the controller's variables, and of any gait variable; of a categorical one
    the index of a choice."""
    mean_current: float = Field(examples=[0.14])
    """Mean over rows and joints of the absolute current [A]."""
    peak_current: float = Field(description="Largest of these currents [A].", examples=[0.85])

    @classmethod
    def from_walk(cls, recording_id: str, walk: RecordedWalk) -> RecordingView:
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


class RecordingEntryView(RecordingBase):
    """A recorded walk in a list."""

    created_at: datetime = Field(description="When it was first stored.")
    size: int = Field(description="Characters of the stored document.", examples=[206113])

    @classmethod
    def from_entry(cls, entry: RecordingEntry) -> RecordingEntryView:
        return cls(**entry._asdict(), seconds=entry.rows * CONTROL_PERIOD)


class SignalView(View):
    """One quantity of a measured log (thesis table 2.2)."""

    name: str = Field(description="Its symbol, as in the headings.", examples=["I_M"])
    unit: str = Field(description="Unit.", examples=["A"])
    description: str = Field(description="Its meaning.", examples=["absolute motor current"])
    channels: int = Field(description="Measured joints, legs or axes; 0 if it was not measured.")


class MeasuredWalkView(View):
    """Contents of a measured log, and the recording made of it."""

    recording: RecordingView = Field(description="The recording, for jobs to fit to.")
    rows: int = Field(description="Rows of the log, 500 a second.", examples=[2300])
    seconds: float = Field(description="Length of the log [s].", examples=[4.6])
    signals: list[SignalView] = Field(description="Every quantity that a log may have.")
    offset: float = Field(description="Begin of the walk in the log, from the simulated one's [s].")
    cycles: int = Field(examples=[3])
    """Recorded cycles: whole ones that log and simulation share."""
    cycle_time: float = Field(description="Time of a walking cycle [s].", examples=[1.5])
    correlation: float = Field(examples=[0.9998])
    """Of the log's desired angles with the simulated ones, 1 for the same gait."""
    verdict: Verdict = Field(description="Whether the log validates the model (thesis 2.3).")


class MeasuredWalkRequest(DesignRequest):
    """A measured log, and the design and scenario that it was measured with."""

    scenario: ScenarioChoice
    """The walk: name or number of a preset (see /v1/scenarios), or your own, with as many cycles as
    were measured."""
    log: str = Field(
        min_length=1,
        description="Text of the log: CSV with 500 rows a second and the unit in every heading, in"
        " the format of docs/validation.md.",
        examples=["time [s],q_D.right_front_coxa [rad]\n0.0,0.3217\n0.002,0.3218\n"],
    )


def read_measured_walk(
    request: MeasuredWalkRequest, store: Callable[[RecordedWalk], str]
) -> MeasuredWalkView:
    """Read a log, find its lag from the simulated design, and store a recording of it."""
    request.check_design()
    scenario, design = find_scenario(request.scenario), request.numbers
    robot = load_robot(request.robot)
    with simulation_errors("scenario"):
        walk = MeasuredWalk.of(robot, scenario, request.controller, design)
    # Before the simulation, which takes longer.
    try:
        log = parse_measured_log(request.log, robot)
        with simulation_errors("scenario"):
            simulated = walk.simulated()
        pair = synchronise(log, simulated, walk.cycle_time)
        recording = record(pair, scenario, request.controller, design)
    except MeasuredLogError as error:
        raise InvalidRequest(str(error), field="log") from error
    return MeasuredWalkView(
        recording=RecordingView.from_walk(store(recording), recording),
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
        verdict=compare_synchronised(pair).verdict,
    )
