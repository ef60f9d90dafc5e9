"""What a look at a robot of one's own shows."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.sim.variables import Variable
from gaitswarm.views.base import View


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
    """What came of standing still, simulated with all joints held as stiffly as they can be."""

    seconds: float = Field(description="For how long [s].")
    normal_forces: float = Field(description="Sum over the feet, mean of the last fifth [N].")
    weight: float = Field(description="Of the robot [N].")
    height: float = Field(description="Of the body's origin over the ground at the end [m].")


class MeshView(View):
    """A mesh that the URDF names. Pictures could show it; nothing that is simulated needs it."""

    name: str = Field(
        description="As the URDF has it.", examples=["package://a1_description/meshes/hip.dae"]
    )
    path: str | None = Field(description="File that was found; null for none.")


class RobotCheckView(View):
    """A robot as it is loaded, and how it stands."""

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
        description="What `robot init` guessed, as robot.toml still has it, one sentence each."
    )
    warnings: list[str] = Field(description="What is unphysical or was guessed badly.")
    parameters: list[Variable] = Field(
        default_factory=list,
        description="What an identification or calibration may fit of it, with bounds.",
    )
