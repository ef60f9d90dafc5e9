"""What a job's best is measured against."""

from __future__ import annotations

from pydantic import Field

from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.reference import Reference, ReferenceKind
from gaitswarm.views.base import View, finite


class ReferenceView(View):
    """The design that a job's best is measured against."""

    name: str = Field(
        description="Study or preference that it was published for; or `start design`.",
        examples=["A"],
    )
    kind: ReferenceKind = Field(
        default="published",
        description="`published`, or `start` of a robot of one's own, for which none was published:"
        " the middle of the job's bounds.",
        examples=["published"],
    )
    fitness: float | None = Field(
        description="What it comes to in the job's scenarios under its preference, in double"
        " precision [1]; null where it does not walk in all of them.",
        examples=[20.93],
    )

    @classmethod
    def from_reference(cls, reference: Reference | None) -> ReferenceView | None:
        """Make a view of a reference."""
        if reference is None or reference.name is None:
            return None
        return cls(name=reference.name, kind=reference.kind, fitness=finite(reference.fitness))


class JobReferenceView(View):
    """A job's best beside the design that it is measured against."""

    id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    reference: ReferenceView | None = Field(
        description="The published or the start design; null where there is none."
    )
    best_fitness: float | None = Field(
        description="Least fitness of the job so far [1]; null while every design has failed.",
        examples=[12.8],
    )
    gain: float | None = Field(
        description="Share by which that is less than the reference's [1]; null where one of them"
        " is not known.",
        examples=[0.39],
    )
    reason: str | None = Field(
        description="Why there is no gain, for people; null if there is one.", examples=[None]
    )

    @classmethod
    def from_comparison(cls, job: Job, reason: str | None) -> JobReferenceView:
        """Make a view of a job with its reference."""
        return cls(
            id=job.id,
            reference=ReferenceView.from_reference(job.reference),
            best_fitness=finite(job.progress.best_fitness),
            gain=finite(job.gain),
            reason=reason,
        )
