"""What commands to jobs take."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.services.optimizer.jobs.job import LARGEST_BUDGET
from gaitswarm.services.optimizer.jobs.priority import HIGHEST, LOWEST


class ExtensionRequest(BaseModel):
    """Another budget for a job."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    iterations: int = Field(
        ge=1,
        le=LARGEST_BUDGET,
        description="Budget in all, in iterations of `particles` designs each: more than the job"
        " has spent [1].",
        examples=[50],
    )


class ResumeRequest(BaseModel):
    """How a job goes on."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    accept_changes: bool = Field(
        default=False,
        description="Whether it goes on although what its numbers depend on has changed, which is"
        " then recorded in its `provenance`. Otherwise such a job fails and says what has changed.",
        examples=[True],
    )


class PriorityRequest(BaseModel):
    """Another priority for a job."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    priority: int = Field(
        ge=LOWEST, le=HIGHEST, description="The higher, the sooner; 0 is usual [1].", examples=[5]
    )
