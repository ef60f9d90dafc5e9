"""A robot of one's own on request, from its URDF. Knows nothing of HTTP."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.errors import simulation_errors
from gaitswarm.robots import check_name, frame_of, own_name
from gaitswarm.sim.proposal.apart import propose_apart
from gaitswarm.sim.proposal.drive import ActuatorChoice
from gaitswarm.sim.proposal.frame import Axis
from gaitswarm.sim.robot.bounds import LONGEST_NAME, LONGEST_URDF, MOST_ELEMENTS, MOST_LINKS
from gaitswarm.views.robot_draft import RobotDraftView


class RobotDraftRequest(BaseModel):
    """A URDF, of which a robot is to be made."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str | None = Field(
        default=None,
        min_length=1,
        max_length=LONGEST_NAME,
        description="Of the robot: begins with a letter or digit, and has no / and no \\; null for"
        " that which the URDF has, or `robot`.",
        examples=["a1"],
    )
    urdf: str = Field(
        max_length=LONGEST_URDF,
        description=f"Text of its URDF: {MOST_LINKS} links and as many joints at most,"
        f" {MOST_ELEMENTS} elements at most, no document type.",
    )
    actuator: ActuatorChoice = Field(
        default="auto",
        description="Kind of its actuators: DC motors with gearheads, or torque-controlled ones;"
        " `auto` decides by the torques and rates of the URDF.",
    )
    up: Axis | None = Field(
        default=None,
        description="Axis of the URDF's first link that points up; null for z, which is refused if"
        " the legs speak against it.",
    )
    forward: Axis | None = Field(
        default=None,
        description="Axis of its first link that points ahead, at right angles to `up`; null for x,"
        " with a warning if the legs speak against it.",
    )


def run_robot_draft(request: RobotDraftRequest) -> RobotDraftView:
    """Find legs, choose a stance, propose actuators and two walks."""
    name = request.name or own_name(request.urdf) or "robot"
    check_name(name)
    frame = frame_of(request.up, request.forward)
    with simulation_errors("urdf"):
        made = propose_apart(request.urdf, name, request.actuator, frame)
    return RobotDraftView(
        name=name, toml=made.toml, urdf=made.urdf, job=made.job, guesses=list(made.notes)
    )
