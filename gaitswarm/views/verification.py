"""What was found when evidence was checked."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.views.base import View


class CheckView(View):
    """One thing that was checked."""

    name: str = Field(
        description="archive, hashes, contents, robot, fitness, best, designs, search, replay,"
        " certificates; of a certificate also summary, design.",
        examples=["fitness"],
    )
    passed: bool | None = Field(
        description="Whether it is as it should be; null where the job rules the check out.",
        examples=[True],
    )
    detail: str = Field(
        description="What was compared, or what differs.",
        examples=["625 of 625 follow from the raw objectives, to the bit"],
    )
    certificate: str | None = Field(
        default=None,
        description="Identifier of the certificate that it is about; null for the job itself.",
    )


class DifferenceView(View):
    """A number that was simulated anew and has other bits."""

    iteration: int = Field(description="Iteration of the evaluation, from 0.", examples=[24])
    particle: int = Field(description="Its particle, from 0.", examples=[7])
    case: str = Field(description="Scenario or recording.", examples=["slope-fast"])
    what: str = Field(description="Objective, or `status`.", examples=["torque"])
    stored: float | str | None = Field(description="As the evidence has it.", examples=[8.71])
    simulated: float | str | None = Field(description="As it is here and now.", examples=[8.72])
    certificate: str | None = Field(
        default=None, description="The certificate that it is of; null for the job itself."
    )


class VerificationView(View):
    """What was found when evidence was checked."""

    sha256: str = Field(description="Of the file.", examples=["9f86d081884c7d65..."])
    job: str | None = Field(
        description="Identifier of the job; null if it cannot be read.", examples=["k2q7zr5dm9xw"]
    )
    verified: bool = Field(description="Whether no check failed.", examples=[True])
    checks: list[CheckView] = Field(description="In their order; a damaged file ends them early.")
    provenance: list[str] = Field(
        description="What numbers depend on here that is not as it was, and what that means; empty"
        " if all is equal. No failure by itself: the replay says whether it matters.",
        examples=[["other simulation code"]],
    )
    replayed: int = Field(description="Evaluations that were simulated anew [1].", examples=[21])
    seed: int = Field(description="By which they were drawn.", examples=[7])
    differences: list[DifferenceView] = Field(
        description="Numbers with other bits, the first hundred."
    )
