"""Meshes of a robot's links, and which of their files a server gives out."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.mesh_library import FoundMesh, MeshFormat
from gaitswarm.sim.robot.shapes import VisualMesh
from gaitswarm.views.base import View
from gaitswarm.views.links import PREFIX


class LinkMeshView(View):
    """A mesh on a link. Only pictures have it."""

    name: str = Field(
        description="Of its file, as the URDF has it.",
        examples=["package://a1_description/meshes/hip.dae"],
    )
    origin: tuple[float, float, float, float, float, float, float] = Field(
        description="Of its frame in its link's: x, y, z [m], then quaternion x, y, z, w.",
        examples=[[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]],
    )
    scale: tuple[float, float, float] = Field(
        description="Along its own x, y and z [1].", examples=[[0.001, 0.001, 0.001]]
    )
    colour: tuple[float, float, float, float] | None = Field(
        description="Red, green, blue and opacity of its material, 0 to 1; null for none.",
        examples=[[0.1, 0.1, 0.1, 1.0]],
    )

    @classmethod
    def from_mesh(cls, mesh: VisualMesh) -> LinkMeshView:
        """Make a view of a mesh."""
        return cls(name=mesh.name, origin=mesh.origin, scale=mesh.scale, colour=mesh.colour)


class MeshFileView(View):
    """A mesh that a robot's URDF names, and whether this server has its file."""

    name: str = Field(description="As the URDF has it.", examples=["meshes/hip.stl"])
    format: MeshFormat | None = Field(
        description="Of the file, by its ending; null for one that is not given out.",
        examples=["stl"],
    )
    url: str | None = Field(
        description="Path of the file; null if it is not given out.",
        examples=["/v1/robots/" + 64 * "0" + "/meshes/0"],
    )
    problem: str | None = Field(
        description="Why it is not given out; null if it is.", examples=[None]
    )

    @classmethod
    def from_mesh(cls, digest: str, number: int, mesh: FoundMesh) -> MeshFileView:
        """Make a view of a mesh."""
        url = None if mesh.path is None else f"{PREFIX}/robots/{digest}/meshes/{number}"
        return cls(name=mesh.name, format=mesh.form, url=url, problem=mesh.problem)
