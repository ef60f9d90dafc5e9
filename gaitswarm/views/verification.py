"""What was found when evidence was checked."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.views.base import View

DIGEST: Final = "^[0-9a-f]{64}$"
"""Of an iteration: SHA-256, in hexadecimal digits."""

Digest = Annotated[str, Field(pattern=DIGEST)]


class VerificationRequest(BaseModel):
    """How thoroughly the history of a job is verified."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    replay: int = Field(
        default=0,
        ge=0,
        le=100_000,
        description="Evaluations to draw and simulate anew, besides the best one [1]; 0 for no walk"
        " at all.",
        examples=[20],
    )
    seed: int | None = Field(
        default=None,
        ge=0,
        lt=2**63,
        description="By which they are drawn; null for one that nobody can foresee.",
    )
    head: Digest | None = Field(
        default=None,
        description="Digest of an iteration that was noted down earlier, to be looked for: the"
        " history has to be the one that it was of.",
    )


class CheckView(View):
    """One thing that was checked."""

    name: str = Field(
        description="archive, hashes, contents, robot, fitness, best, designs, search, chain,"
        " replay, head, certificates; of a certificate also summary, design.",
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


class HistoryVerificationView(View):
    """What was found when the stored history of a job was checked."""

    job: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    verified: bool = Field(description="Whether no check failed.", examples=[True])
    iterations: int = Field(
        description="Iterations that are as they were committed, from the first on [1].",
        examples=[25],
    )
    head: str | None = Field(
        description="Digest of the last of these iterations; null if there is none.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )
    broken_at: int | None = Field(
        description="The first iteration that is not as it was committed; null if there is none.",
        examples=[None],
    )
    checks: list[CheckView] = Field(
        description="`chain`; `head` if one was given; `replay` if walks were asked for."
    )
    provenance: list[str] = Field(
        description="What numbers depend on here that is not as it was, if walks were asked for. No"
        " failure by itself: the replay says whether it matters."
    )
    replayed: int = Field(description="Evaluations that were simulated anew [1].", examples=[21])
    seed: int = Field(description="By which they were drawn.", examples=[7])
    differences: list[DifferenceView] = Field(
        description="Numbers with other bits, the first hundred."
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
