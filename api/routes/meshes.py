"""Meshes of robots whose folders the server knows. A path of a file is never asked for."""

from __future__ import annotations

import hashlib
from typing import Annotated

from fastapi import APIRouter, Header, Path, Response, status

from gaitswarm.api.dependencies import ServerSettings
from gaitswarm.api.documentation import binary, problems
from gaitswarm.api.routes.simulations import BinaryResponse
from gaitswarm.meshes import MeshLibrary
from gaitswarm.views import PREFIX, CatalogueView
from gaitswarm.views.robots import MeshFileView

router = APIRouter(prefix=PREFIX, tags=["catalogue"])

Digest = Annotated[
    str,
    Path(
        pattern=r"^[0-9a-f]{64}$",
        description="SHA-256 of the robot's robot.urdf, as the header of a replay has it.",
        examples=[64 * "0"],
    ),
]


@router.get(
    "/robots/{digest}/meshes",
    operation_id="list_meshes",
    summary="List a robot's meshes",
    responses=problems(422),
)
def list_meshes(digest: Digest, settings: ServerSettings) -> CatalogueView[MeshFileView]:
    """Meshes that the robot's URDF names, and which of them can be had here.

    None for a robot that is in none of the folders of GAITSWARM_ROBOTS. Nothing that is simulated
    needs meshes.
    """
    found = MeshLibrary(settings.robots).of(digest)
    return CatalogueView(
        items=[MeshFileView.from_mesh(digest, k, mesh) for k, mesh in enumerate(found)]
    )


@router.get(
    "/robots/{digest}/meshes/{number}",
    operation_id="get_mesh",
    summary="Get a mesh",
    response_class=BinaryResponse,
    responses=binary("The file, in the format that the list says.")
    | {status.HTTP_304_NOT_MODIFIED: {"description": "It is the one of If-None-Match still."}}
    | problems(404, 422),
)
def get_mesh(
    digest: Digest,
    number: Annotated[int, Path(ge=0, le=100_000, description="Place in the list.", examples=[0])],
    settings: ServerSettings,
    if_none_match: Annotated[
        str | None, Header(max_length=1000, description="ETag of what is there already.")
    ] = None,
) -> Response:
    """The file of a mesh, with an ETag of its content.

    Only files of at most 32 MiB that the robot's own URDF names, in its folder or in the package
    that it names.
    """
    content = MeshLibrary(settings.robots).content(digest, number)
    tag = f'"{hashlib.sha256(content).hexdigest()}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
    if if_none_match is not None and tag in if_none_match:
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    return BinaryResponse(content, headers=headers)
