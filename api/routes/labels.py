"""What people write on jobs, and how they find them by that."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from gaitswarm.api.access import Actor, may_command
from gaitswarm.api.dependencies import JobId, Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.reads import job_in_full
from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.views import PREFIX, JobView
from gaitswarm.views.job import JobFacetsView

router = APIRouter(prefix=PREFIX, tags=["jobs"])


@router.get(
    "/job-facets",
    operation_id="count_jobs",
    summary="Count jobs by what they are found by",
    responses=problems(422),
)
def count_jobs(
    service: Service,
    archived: Annotated[
        bool | None, Query(description="Only jobs that are archived, or that are not.")
    ] = None,
) -> JobFacetsView:
    """How many jobs there are in each state, and of each robot, controller, preference and tag."""
    return JobFacetsView.from_counts(service.facets(archived=archived))


@router.patch(
    "/jobs/{job_id}",
    operation_id="label_job",
    dependencies=[Depends(may_command)],
    summary="Name, note, tag or archive a job",
    responses=problems(400, 403, 404, 413, 422),
)
def label_job(change: LabelsChange, job_id: JobId, service: Service, actor: Actor) -> JobView:
    """Write on a job what people want to know of it: a JSON merge patch of its labels.

    Its spec and its results stay as they are.
    """
    return job_in_full(service, service.label(job_id, change, actor=actor))
