"""A robot that was proposed from its URDF."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from gaitswarm.views.base import View


class RobotDraftView(View):
    """A robot's files, as `gaitswarm robot init` writes them; nothing of it is stored."""

    name: str = Field(description="Of the robot.", examples=["a1"])
    toml: str = Field(description="Text of robot.toml, with a comment on every guess.")
    urdf: str = Field(
        description="Text of robot.urdf: as it was sent, with a frame at the end of every leg whose"
        " foot is no link."
    )
    job: dict[str, Any] = Field(
        description="Fields of a job of this robot, unless it says otherwise: two scenarios, the"
        " controller, bounds where they follow from the robot, the preference."
    )
    guesses: list[str] = Field(description="What to look at, one sentence each.")
