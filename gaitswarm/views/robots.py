"""Drafts and checks of robots, and their meshes"""

from __future__ import annotations

from typing import Any

from pydantic import Field

from gaitswarm.meshes import FoundMesh, MeshFormat
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.variables import Variable
from gaitswarm.views.base import PREFIX


class LinkMeshView(View):
    """A mesh on a link, for display only."""

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

    @classmethod
    def from_mesh(cls, digest: str, number: int, mesh: FoundMesh) -> MeshFileView:
        """Make a view of a mesh."""
        url = None if mesh.path is None else f"{PREFIX}/robots/{digest}/meshes/{number}"
        return cls(name=mesh.name, format=mesh.form, url=url, problem=mesh.problem)


class CheckedLegView(View):
    """A leg."""

    name: str = Field(description="Of the leg.", examples=["FL"])
    joints: list[str] = Field(description="Its joints, from the body on.")
    foot: str = Field(description="Link or fixed joint at its end.")
    length: float = Field(description="From the first joint to the foot, stretched [m].")
    mass: float = Field(description="Of its three links with what is fixed to them [kg].")
    reach: float = Field(
        description="How far the foot gets below the highest hip within the joints' limits [m]."
    )
    points: list[tuple[float, float, float]] = Field(
        description="Where its joints and its foot are in the body's frame when it stands [m]."
    )


class StandingStillView(View):
    """Result of standing still with all joints held as stiffly as possible."""

    seconds: float = Field(description="For how long [s].")
    normal_forces: float = Field(description="Sum over the feet, mean of the last fifth [N].")
    weight: float = Field(description="Of the robot [N].")
    height: float = Field(description="Of the body's origin over the ground at the end [m].")


class MeshView(View):
    """A mesh that the URDF names, for display only."""

    name: str = Field(
        description="As the URDF has it.", examples=["package://a1_description/meshes/hip.dae"]
    )
    path: str | None = Field(description="File that was found; null for none.")


class RobotCheckView(View):
    """A loaded robot and how it stands."""

    name: str = Field(description="Of the robot.")
    mass: float = Field(description="Without load [kg].")
    body_mass: float = Field(
        description="Of the body with all that is held or fixed to it, without legs [kg]."
    )
    joints: int = Field(description="That move.")
    legs: list[CheckedLegView] = Field(description="In the order of robot.toml.")
    held: dict[str, float] = Field(description="Joints of no leg, each with its angle [rad].")
    centre_of_mass: tuple[float, float, float] = Field(
        description="In the body's frame when it stands [m]."
    )
    standing: StandingStillView = Field(description="How it stands.")
    meshes: list[MeshView] = Field(description="That the URDF names, in its order.")
    guesses: list[str] = Field(
        description="Guesses of `robot init` that are still in robot.toml, one sentence each."
    )
    warnings: list[str] = Field(description="What is unphysical or was guessed badly.")
    parameters: list[Variable] = Field(
        default_factory=list,
        description="What an identification or calibration may fit of it, with bounds.",
    )


class RobotDraftView(View):
    """A robot's files as `gaitswarm robot init` writes them; nothing is stored."""

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
    guesses: list[str] = Field(description="Guesses to check, one sentence each.")
