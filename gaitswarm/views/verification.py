"""Results of checking evidence or a stored history."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.services.optimizer.views import View

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
        description="Evaluations to draw and repeat, besides the best one [1]; 0 for no simulation"
        " at all.",
        examples=[20],
    )
    seed: int | None = Field(
        default=None,
        ge=0,
        lt=2**63,
        description="Seed of the draw; null for a random one.",
    )
    head: Digest | None = Field(
        default=None,
        description="Digest of an iteration noted earlier: the history must contain it.",
    )


class CheckView(View):
    """One thing that was checked."""

    name: str = Field(
        description="archive, hashes, contents, robot, fitness, best, designs, search, chain,"
        " replay, head, certificates; of a certificate also summary, design.",
        examples=["fitness"],
    )
    passed: bool | None = Field(
        description="Whether the check passed; null where it does not apply.",
        examples=[True],
    )
    detail: str = Field(
        description="Details: what was compared, or what differs.",
        examples=["625 of 625 follow from the raw objectives, to the bit"],
    )
    certificate: str | None = Field(
        default=None,
        description="Identifier of the certificate that it is about; null for the job itself.",
    )


class DifferenceView(View):
    """A repeated number with other bits."""

    iteration: int = Field(description="Iteration of the evaluation, from 0.", examples=[24])
    particle: int = Field(description="Its particle, from 0.", examples=[7])
    case: str = Field(description="Scenario or recording.", examples=["slope-fast"])
    what: str = Field(description="Objective, or `status`.", examples=["torque"])
    stored: float | str | None = Field(description="Value in the evidence.", examples=[8.71])
    simulated: float | str | None = Field(description="Value computed here.", examples=[8.72])
    certificate: str | None = Field(
        default=None, description="The certificate that it is of; null for the job itself."
    )


class HistoryVerificationView(View):
    """Verification of a job's stored history."""

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
        description="Changes of provenance on this machine, if a replay was requested. Not a"
        " failure by itself: the replay shows whether it matters."
    )
    replayed: int = Field(description="Evaluations that were repeated [1].", examples=[21])
    seed: int = Field(description="Seed of the draw.", examples=[7])
    differences: list[DifferenceView] = Field(
        description="Numbers with other bits, the first hundred."
    )


class VerificationView(View):
    """Results of checking evidence or a stored history."""

    sha256: str = Field(description="Of the file.", examples=["9f86d081884c7d65..."])
    job: str | None = Field(
        description="Identifier of the job; null if it cannot be read.", examples=["k2q7zr5dm9xw"]
    )
    verified: bool = Field(description="Whether no check failed.", examples=[True])
    checks: list[CheckView] = Field(description="In their order; a damaged file ends them early.")
    provenance: list[str] = Field(
        description="Changes of provenance on this machine, and what they mean; empty"
        " if nothing changed. Not a failure by itself: the replay shows whether it matters.",
        examples=[["other simulation code"]],
    )
    replayed: int = Field(description="Evaluations that were repeated [1].", examples=[21])
    seed: int = Field(description="Seed of the draw.", examples=[7])
    differences: list[DifferenceView] = Field(
        description="Numbers with other bits, the first hundred."
    )
