"""Robots: drafts from a URDF, checks of custom robots, and meshes."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Path, Response, status

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import Computing, ServerSettings
from gaitswarm.api.documentation import binary, problems
from gaitswarm.api.responses import BinaryResponse, tagged_response
from gaitswarm.meshes import MeshLibrary
from gaitswarm.robots import RobotDraftRequest, check_robot, run_robot_draft
from gaitswarm.services.optimizer.views import MEDIA_TYPE
from gaitswarm.sim.robot import RobotFiles
from gaitswarm.views import PREFIX, CatalogueView
from gaitswarm.views.robots import MeshFileView, RobotCheckView, RobotDraftView

router = APIRouter(prefix=f"{PREFIX}/robots")

DraftBody = Annotated[RobotDraftRequest, Depends(validated(RobotDraftRequest, "request"))]
FilesBody = Annotated[RobotFiles, Depends(validated(RobotFiles, "robot"))]

Digest = Annotated[
    str,
    Path(
        pattern=r"^[0-9a-f]{64}$",
        description="SHA-256 of the robot's robot.urdf, as in the header of a replay.",
        examples=[64 * "0"],
    ),
]


@router.post(
    "/drafts",
    tags=["robots"],
    operation_id="draft_robot",
    summary="Draft a robot from a URDF",
    responses=problems(400, 413, 422),
)
async def draft_robot(request: DraftBody, computing: Computing) -> RobotDraftView:
    """Find legs, choose a stance, propose actuators and two scenarios, as `gaitswarm robot init`.

    The response's `toml` and `urdf` are the `robot` of jobs, simulations and replays; its `job` has
    the required fields of a job. Motors, gears and battery are guesses to start from. Nothing is
    stored.
    """
    return await computing.run(partial(run_robot_draft, request))


@router.post(
    "/checks",
    tags=["robots"],
    operation_id="check_robot",
    summary="Check a custom robot",
    responses=problems(400, 413, 422),
)
async def check_custom_robot(robot: FilesBody, computing: Computing) -> RobotCheckView:
    """Load a robot and let it stand for a second with all joints held, as `gaitswarm robot check`.

    Returns masses, reach, loads of the soles, and warnings about implausible bodies. Meshes are not
    looked up, so `meshes` is empty. Nothing is stored.
    """
    return await computing.run(partial(check_robot, robot, folder=None, field=""))


@router.get(
    "/{digest}/meshes",
    tags=["catalogue"],
    operation_id="list_meshes",
    summary="List the meshes of a robot",
    responses=problems(422),
)
def list_meshes(digest: Digest, settings: ServerSettings) -> CatalogueView[MeshFileView]:
    """Return the meshes that the robot's URDF names, and which of them are available.

    Empty for a robot that is in none of the folders of GAITSWARM_ROBOTS. Simulations need no
    meshes.
    """
    meshes = MeshLibrary(settings.robots).of(digest)
    return CatalogueView(
        items=[MeshFileView.from_mesh(digest, k, mesh) for k, mesh in enumerate(meshes)]
    )


@router.get(
    "/{digest}/meshes/{number}",
    tags=["catalogue"],
    operation_id="get_mesh",
    summary="Get a mesh",
    response_class=BinaryResponse,
    responses=binary("The file, in the format given by the list.")
    | {status.HTTP_304_NOT_MODIFIED: {"description": "The file matches If-None-Match."}}
    | problems(404, 422),
)
def get_mesh(
    digest: Digest,
    number: Annotated[int, Path(ge=0, le=100_000, description="Index in the list.", examples=[0])],
    settings: ServerSettings,
    if_none_match: Annotated[
        str | None, Header(max_length=1000, description="ETag of a cached file.")
    ] = None,
) -> Response:
    """Return the file of a mesh, with the ETag of its content.

    Only files of at most 32 MiB that the robot's URDF names, in the robot's folder or in the
    package that the URDF names.
    """
    content = MeshLibrary(settings.robots).content(digest, number)
    headers = {"Cache-Control": "private, no-cache"}
    return tagged_response(content, MEDIA_TYPE, if_none_match, headers)
