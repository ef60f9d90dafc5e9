"""Results of checking evidence or a stored history."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from gaitswarm.services.optimizer.views import IterationIndex, JobName, Particle, View

DIGEST: Final = "^[0-9a-f]{64}$"
"""Of an iteration: SHA-256, in hexadecimal digits."""

Digest = Annotated[str, Field(pattern=DIGEST)]
Certificate = Annotated[
    str | None, Field(description="Identifier of its certificate; null for the job itself.")
]


class CheckView(View):
    """Result of one check."""

    name: str = Field(examples=["fitness"])
    """archive, hashes, contents, robot, fitness, best, designs, search, chain, replay, head,
    certificates; of a certificate also summary, design."""
    passed: bool | None = Field(description="Whether it passed; null if it does not apply.")
    detail: str = Field(examples=["625 of 625 follow from the raw objectives, to the bit"])
    """What was compared, or what differs."""
    certificate: Certificate = None


class DifferenceView(View):
    """A repeated number with other bits."""

    iteration: IterationIndex
    particle: Particle
    case: str = Field(description="Scenario or recording.", examples=["slope-fast"])
    what: str = Field(description="Objective, or `status`.", examples=["torque"])
    stored: float | str | None = Field(description="Value in the evidence.", examples=[8.71])
    simulated: float | str | None = Field(description="Value computed here.", examples=[8.72])
    certificate: Certificate = None


class ReplayedView(View):
    """Checks of a job, and of evaluations that were repeated."""

    verified: bool = Field(description="Whether no check failed.", examples=[True])
    checks: list[CheckView] = Field(description="In their order; a damaged file ends them early.")
    provenance: list[str] = Field(examples=[["other simulation code"]])
    """Changes of provenance on this machine, if any. Not a failure by itself: the replay shows
    whether it matters."""
    replayed: int = Field(description="Evaluations that were repeated.", examples=[21])
    seed: int = Field(description="Seed of the draw.", examples=[7])
    differences: list[DifferenceView]
    """Numbers with other bits, the first hundred."""


class HistoryVerificationView(ReplayedView):
    """Verification of a job's stored history."""

    job: JobName
    iterations: int = Field(description="Intact iterations, from the first on.", examples=[25])
    head: str | None = Field(
        description="Digest of the last of these iterations; null if there is none.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )
    broken_at: int | None = Field(description="First damaged iteration; null if there is none.")


class VerificationView(ReplayedView):
    """Results of checking evidence or a stored history."""

    unproved: list[str] = Field(default=["id", "state", "times"])
    """What the file says of the job without proof."""
    sha256: str = Field(description="Of the file.", examples=["9f86d081884c7d65..."])
    job: str | None = Field(description="Identifier of the job; null if it cannot be read.")
