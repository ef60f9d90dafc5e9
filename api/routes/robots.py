"""Robots of one's own: proposed from a URDF, and looked at. Nothing of them is stored."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import Slots
from gaitswarm.api.documentation import problems
from gaitswarm.robots import RobotDraftRequest, check_robot, run_robot_draft
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.views import PREFIX
from gaitswarm.views.robots import RobotCheckView, RobotDraftView

router = APIRouter(prefix=f"{PREFIX}/robots", tags=["robots"])

DraftBody = Annotated[RobotDraftRequest, Depends(validated(RobotDraftRequest, "request"))]
FilesBody = Annotated[RobotFiles, Depends(validated(RobotFiles, "robot"))]


@router.post(
    "/drafts",
    operation_id="draft_robot",
    summary="Make a robot of a URDF",
    responses=problems(400, 413, 422),
)
async def draft_robot(request: DraftBody, slots: Slots) -> RobotDraftView:
    """Find legs, choose a stance, propose actuators and two walks: `gaitswarm robot init`.

    The answer's `toml` and `urdf` are the `robot` of jobs, simulations and replays; its `job` has
    the fields that a job needs. It is a place to begin: motors, gears and battery are guesses.
    """
    return await slots.run(partial(run_robot_draft, request))


@router.post(
    "/checks",
    operation_id="check_robot",
    summary="Look at a robot of one's own",
    responses=problems(400, 413, 422),
)
async def look_at_robot(robot: FilesBody, slots: Slots) -> RobotCheckView:
    """Load a robot and let it stand for a second, all joints held: `gaitswarm robot check`.

    Masses, reach, what the soles carry, and warnings of what no body has. Meshes are not looked
    for, so `meshes` is empty.
    """
    return await slots.run(partial(check_robot, robot, folder=None, field=""))
