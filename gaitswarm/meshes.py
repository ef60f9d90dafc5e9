"""Meshes of robots as a server lists and serves them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import Field

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.robot.meshes import FORMS, MeshFormat, served_meshes
from gaitswarm.views.base import PREFIX


class MeshFileView(View):
    """A mesh that a robot's URDF names, and whether this server has its file."""

    name: str = Field(description="As the URDF has it.", examples=["meshes/hip.stl"])
    format: MeshFormat | None = Field(
        description="Media type by file extension; null if the file is not served.",
        examples=["stl"],
    )
    url: str | None = Field(
        description="Path of the file; null if it is not served.",
        examples=["/v1/robots/" + 64 * "0" + "/meshes/0"],
    )
    problem: str | None = Field(description="Why it is not served; null if it is.", examples=[None])


def mesh_views(folders: Sequence[Path], digest: str) -> list[MeshFileView]:
    """Describe the meshes of a robot."""
    return [
        MeshFileView(
            name=name,
            format=FORMS.get(Path(name).suffix.lower()),
            url=None if isinstance(found, str) else f"{PREFIX}/robots/{digest}/meshes/{number}",
            problem=found if isinstance(found, str) else None,
        )
        for number, (name, found) in enumerate(served_meshes(folders, digest).items())
    ]


def mesh_content(folders: Sequence[Path], digest: str, number: int) -> bytes:
    """A mesh of a robot, by its number in the list."""
    meshes = list(served_meshes(folders, digest).items())
    if number >= len(meshes):
        raise NotFound(f"the robot has no mesh {number}, but {len(meshes)} in all")
    name, found = meshes[number]
    if isinstance(found, str):
        raise NotFound(f"mesh {name[:200]}: {found}")
    try:
        return found.read_bytes()
    except OSError as error:
        raise NotFound(f"mesh {name[:200]}: {error.strerror}") from error
