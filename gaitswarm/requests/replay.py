"""One design walking to be looked at: what is asked, and how it is done. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Final

from pydantic import Field

from gaitswarm.mesh_library import urdf_digest
from gaitswarm.requests.design import resolved
from gaitswarm.requests.walk import WorldRequest
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.replay import CONTROL_RATE, replay
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.scenario import ScenarioChoice
from gaitswarm.views.replay import encoded_replay

MOST_POSES: Final = 1_000_000
"""Poses of links in a replay; one of 40 s at 500 Hz has half as many of a shipped robot."""


class ReplayRequest(WorldRequest):
    """One design and the walk in which to look at it."""

    scenario: ScenarioChoice = Field(
        default="normal-fast",
        description="Name or number of a preset (see /v1/scenarios), or your own.",
        examples=["normal-fast"],
    )
    rate: float = Field(
        default=50.0,
        ge=1.0,
        le=CONTROL_RATE,
        description="Frames a second; each is the nearest tick of 2 ms, whose time is exact [Hz].",
    )


def run_replay(request: ReplayRequest) -> bytes:
    """Let the design walk, to be looked at."""
    scenario = resolved(request.scenario)
    request.check_design()
    request.check_reach(scenario, field="scenario")
    robot = load_robot(request.robot)
    poses = request.rate * request.simulated_seconds([scenario]) * len(robot.urdf.links)
    if poses > MOST_POSES:
        raise InvalidRequest(
            f"the replay would have {poses:.3g} poses of links, more than {MOST_POSES}; choose"
            " fewer frames a second or cycles",
            field="rate",
        )
    walk = request.walk(scenario, log=True)
    (log,) = walk.logs
    if log is None:
        raise AssertionError("a gait within reach is walked")
    return encoded_replay(
        replay(robot, log, rate=request.rate, load=scenario.load),
        robot,
        request.walked(scenario),
        rate=request.rate,
        status=Status(walk.outcome.statuses[0]),
        objectives=walk.outcome.objectives[0],
        urdf=urdf_digest(request.robot.urdf) if isinstance(request.robot, RobotFiles) else None,
    )
